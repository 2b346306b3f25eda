// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "calib/acceptance/protocol.hpp"
#include "core/acceptance_file.hpp"
#include "core/program/program.hpp"

namespace drape::calib {

[[nodiscard]] AcceptanceFile file_of(const Acceptance& acceptance, const AcceptanceDates& dates);

/// Verdict and figures as text; `page` is the protocol.
[[nodiscard]] Ending ending_of(const Acceptance& acceptance, const std::filesystem::path& page);

}  // namespace drape::calib
