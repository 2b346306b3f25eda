// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/branch_list.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// Options common to the programs that simulate one scene.
struct RunArguments {
  std::filesystem::path scene, out;
  std::optional<std::filesystem::path> fabric, start;
  CurveFit fit = CurveFit::drape;
  SimulateOptions options;
};

/// SCENE, --fabric, --segments, --fit, --start-from, --internal-friction, --out.
void fields(Fields& f, RunArguments& args);
/// --coarsest-mm, --seed, --thickness-mm, and `finest`: --spacing-mm too.
void mesh_fields(Fields& f, DrapeOptions& options, bool finest);

/// The files behind them.
struct RunInputs {
  Scene scene;
  Fabric fabric;
  Print print;
  std::optional<Sheet> measured;

  /// Every file that was read but the start: scene, print, fabric with its curves, meshes.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;
};

/// Scene, its fabric or another, and print. Throws Error(usage) where SCENE is missing,
/// Error(bad_input) where no cloth has such a friction or gravity, or the pins are farther apart
/// than the fabric was stretched.
[[nodiscard]] RunInputs read_checked(const std::filesystem::path& scene,
                                     const std::optional<std::filesystem::path>& fabric);

/// The measured sheet, or another simulator's mesh, that places a drape of the scene. Throws
/// Error(bad_input) for gravity that no real drape has, and for a sheet of another print.
[[nodiscard]] Sheet read_start_of(const std::filesystem::path& file, const Scene& scene,
                                  const Print& print);

/// Throws Error(bad_input) where the sheet says that it was measured of another scene.
void require_same_drape(const Sheet& reference, const Scene& scene);

/// Reads the inputs of `args`. Throws Error(usage), before anything is touched, where --out is
/// missing or an output is one of the inputs.
[[nodiscard]] RunInputs read_run_inputs(const RunArguments& args,
                                        const std::vector<std::filesystem::path>& outputs);

/// A record of a run, with the inputs booked.
[[nodiscard]] RunRecord record_of(const RunArguments& args, const RunInputs& inputs,
                                  std::vector<std::string> words,
                                  const std::filesystem::path& file);

/// Sets the reach of the curves after a first run, where the fit asks for it.
void set_reach(RunArguments& args, const RunInputs& inputs);

/// Files in a folder `branch-*` of `out`, in whose place a branch would be written. Throws
/// Error(bad_input) where the list there cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> earlier_branch_files(
    const std::filesystem::path& out);

/// Writes branches.json after removing the sheets that the earlier one names, and before any new
/// sheet: whenever a run may end, every sheet of a branch stands in the list.
void write_branch_list(const std::filesystem::path& out, const BranchList& list, RunRecord& record);

[[nodiscard]] inline std::optional<std::string> no_go_of(const std::optional<Sheet>& measured) {
  return measured ? measured->no_go : std::nullopt;
}

/// A drape placed by a measured sheet that is NO-GO is NO-GO, in the words of the first cause.
[[nodiscard]] inline Ending resting_on(const std::optional<std::string>& no_go, Ending ending) {
  if (!no_go) return ending;
  if (!ending.go) ending.rejected.push_back(ending.verdict);
  ending.go = false;
  ending.verdict = "placed by a measured sheet that is NO-GO: " + *no_go;
  return ending;
}

}  // namespace drape::simulate
