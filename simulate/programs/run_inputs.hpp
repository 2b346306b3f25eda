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

/// Options common to programs that simulate one scene.
struct RunArguments {
  std::filesystem::path scene, out;
  std::optional<std::filesystem::path> fabric, start;
  CurveFit fit = CurveFit::drape;
  SimulateOptions options;
};

/// SCENE, --fabric, --segments, --fit, --start-from, --internal-friction, --out.
void fields(Fields& f, RunArguments& args);
/// Describes --coarsest-mm, --seed, --thickness-mm and, with `finest`, --spacing-mm.
void mesh_fields(Fields& f, DrapeOptions& options, bool finest);

/// Contents of the input files.
struct RunInputs {
  Scene scene;
  Fabric fabric;
  Print print;
  std::optional<Sheet> measured;

  /// Every input file except the start: scene, print, fabric with its curves, meshes.
  [[nodiscard]] std::vector<std::filesystem::path> files() const;
};

/// Reads the scene, its own or another fabric, and the print. Throws Error(usage) if SCENE is
/// missing, Error(bad_input) for an impossible friction or gravity, or if pins are farther apart
/// than the fabric was stretched in its tests.
[[nodiscard]] RunInputs read_checked(const std::filesystem::path& scene,
                                     const std::optional<std::filesystem::path>& fabric);

/// Reads the measured sheet, or another simulator's mesh, that positions a drape of the scene.
/// Throws Error(bad_input) for a gravity of no real drape, and for a sheet with another print.
[[nodiscard]] Sheet read_start_of(const std::filesystem::path& file, const Scene& scene,
                                  const Print& print);

/// Throws Error(bad_input) if the sheet states that it was measured with another scene.
void require_same_drape(const Sheet& reference, const Scene& scene);

/// Reads the inputs of `args`. Throws Error(usage), before touching anything, if --out is missing
/// or an output is one of the inputs.
[[nodiscard]] RunInputs read_run_inputs(const RunArguments& args,
                                        const std::vector<std::filesystem::path>& outputs);

/// Makes the record of a run, including its inputs.
[[nodiscard]] RunRecord record_of(const RunArguments& args, const RunInputs& inputs,
                                  std::vector<std::string> words,
                                  const std::filesystem::path& file);

/// Sets the range of the curve fits by a first run, if `--fit` asks for it.
void set_reach(RunArguments& args, const RunInputs& inputs);

/// Files in folders `branch-*` of `out` that a new branch would replace. Throws Error(bad_input) if
/// the list there cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> earlier_branch_files(
    const std::filesystem::path& out);

/// Removes the sheets named in an earlier branches.json, then writes the new list before any new
/// sheet, so that even an interrupted run leaves no sheet that is not listed.
void write_branch_list(const std::filesystem::path& out, const BranchList& list, RunRecord& record);

[[nodiscard]] inline std::optional<std::string> no_go_of(const std::optional<Sheet>& measured) {
  return measured ? measured->no_go : std::nullopt;
}

/// Makes the ending NO-GO, quoting the first cause, if the measured sheet that placed the drape is.
[[nodiscard]] inline Ending resting_on(const std::optional<std::string>& no_go, Ending ending) {
  if (!no_go) return ending;
  if (!ending.go) ending.rejected.push_back(ending.verdict);
  ending.go = false;
  ending.verdict = "placed by a measured sheet that is NO-GO: " + *no_go;
  return ending;
}

}  // namespace drape::simulate
