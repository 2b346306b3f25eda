// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/program.hpp"
#include "simulate/simulate.hpp"

namespace drape {

/// The last lines of drape-simulate: NO-GO when the cloth did not come to rest.
[[nodiscard]] Ending ending_of(const SimulateResult& result, const std::filesystem::path& out);

}  // namespace drape
