// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/program/program.hpp"
#include "simulate/simulate.hpp"
#include "simulate/validation/validation.hpp"

namespace drape::simulate {

/// The last lines of drape-simulate: NO-GO when the cloth did not come to rest.
[[nodiscard]] Ending ending_of(const SimulateResult& result, const std::filesystem::path& out);

/// Throws Error(usage) when one of the two is missing: only --validate needs neither.
void require_scene_and_out(const std::filesystem::path& scene, const std::filesystem::path& out);

/// Reads a scene's objects; what can be none, such as a mesh in another unit, is an Error.
[[nodiscard]] Ending objects_read(const std::filesystem::path& scene);

/// Runs the closed-form checks and prints their table (not with --json) and ending; exit code.
[[nodiscard]] int run_checks(const CommonOptions& common);

/// GO when every check meets its goal.
[[nodiscard]] Ending ending_of(const Checks& checks);

}  // namespace drape::simulate
