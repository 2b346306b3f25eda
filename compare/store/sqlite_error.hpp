// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "core/error.hpp"

namespace SQLite {
class Exception;
}

namespace drape::compare {

inline constexpr int kBusyTimeout_ms = 10000;

/// One clear sentence for what SQLite reported about the store.
[[nodiscard]] Error store_error(const std::filesystem::path& file,
                                const SQLite::Exception& exception);

}  // namespace drape::compare
