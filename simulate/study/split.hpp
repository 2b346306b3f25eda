// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/simulate.hpp"
#include "simulate/study/sensitivity.hpp"

namespace drape::simulate {

/// One change of the model and what it does to the mean distance from the reference sheet.
struct SplitRow {
  std::string what;        ///< e.g. "mass rule paper"
  bool continued = false;  ///< from the base's equilibrium, so on its branch; else from the start
  bool at_rest = false;
  double distance_m = 0;  ///< mean over the reference's marks
  double change_m = 0;    ///< change of that distance, against the base
  double moved_m = 0;     ///< mean displacement of the marks from the base
  double energy_j = 0;
  int folds = 0;  ///< folds of the hem
};

/// Where the distance between a drape and its reference comes from.
struct ErrorSplit {
  SimulateOptions options;  ///< options of the base
  StaticReport base;
  std::string base_sentence;  ///< end of the base, judged as by simulate_checked()
  std::vector<MarkId> marks;  ///< marks of the reference that lie on the patch
  double friction = 0;
  std::vector<SplitRow> rows;  ///< the base first
  /// Absent when the base is not at rest or a saddle.
  std::optional<std::vector<Sensitivity>> sensitivities;
  std::optional<std::string> no_go;  ///< reason of the measurement of the reference or the start
  std::vector<SceneEffect> scene;    ///< empty when not asked for or the base is not at rest
};

struct SplitOptions {
  int starts = 8;                 ///< for the rows about the branch; 1: none
  bool only_first_order = false;  ///< the sensitivities alone
  bool scene_values = false;      ///< those to place and size of the objects and to friction too
};

/// Drapes the scene with the static solver, after a fall where the options say so, finds how the
/// distance from `reference` answers to each value of the fabric, and repeats the drape with one
/// thing changed at a time: mass rule, twist, friction, segments, contact between particles, grid,
/// internal friction and branch. Throws Error for wrong input.
[[nodiscard]] ErrorSplit split_error(const Scene& scene, const Fabric& fabric, const Print& print,
                                     const std::optional<Sheet>& measured, const Sheet& reference,
                                     const SimulateOptions& options, const SplitOptions& how);

/// Schema drapebench/sensitivity/1.
[[nodiscard]] Json sensitivity_json(const ErrorSplit& split);
/// One row per variant, units in the headings.
[[nodiscard]] std::string split_csv(const ErrorSplit& split);

}  // namespace drape::simulate
