// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/program/program.hpp"
#include "core/units.hpp"
#include "simulate/refine/refine.hpp"

namespace drape::simulate {

/// Arguments of `drape simulate refine`.
struct RefineArguments {
  std::filesystem::path folder, scene, out;
  std::optional<std::filesystem::path> fabric, start;
  RefineOptions how;
  double goal_mm = RefineOptions{}.goal_m / units::mm;  ///< replaces that of `how`
};

/// Refines a simulation's folder, writes and says what was found; exit code. Throws Error.
[[nodiscard]] int run_refine(RefineArguments args, std::vector<std::string> words,
                             const CommonOptions& common);

}  // namespace drape::simulate
