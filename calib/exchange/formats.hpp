// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/exchange/exchange.hpp"

namespace drape::calib {

/// Cameras in one file, with the names stated there.
[[nodiscard]] std::vector<Camera> cameras_of(const std::filesystem::path& file,
                                             ExchangeFormat format, const ImportOptions& options);

}  // namespace drape::calib
