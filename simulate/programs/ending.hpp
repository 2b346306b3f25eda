// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/program/program.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// The last lines of drape-simulate: NO-GO when the cloth did not come to rest.
[[nodiscard]] Ending ending_of(const SimulateResult& result, const std::filesystem::path& out);

/// Throws Error(usage) when one of the two is missing.
void require_scene_and_out(const std::filesystem::path& scene, const std::filesystem::path& out);

/// Reads a scene's objects; what can be none, such as a mesh in another unit, is an Error.
[[nodiscard]] Ending objects_read(const std::filesystem::path& scene);

}  // namespace drape::simulate
