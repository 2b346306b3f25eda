// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/files/json_file.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// Range over which the Kawabata curves are approximated: where a first run strains the cloth, or
/// all that was measured, as the paper.
enum class CurveFit { drape, whole };

/// Options common to the programs that simulate one scene.
struct RunArguments {
  std::filesystem::path scene, out;
  std::optional<std::filesystem::path> fabric, start;
  int grid = 21;
  CurveFit fit = CurveFit::drape;
  SimulateOptions options;
};

/// An option whose words are the names of an enumeration.
template <class Enum>
void add_names(Command& app, const std::string& option, Enum& value, const std::string& what) {
  std::vector<std::pair<std::string, Enum>> choices;
  for (std::size_t i = 0; i < std::size(names_of<Enum>); ++i)
    choices.emplace_back(names_of<Enum>[i], static_cast<Enum>(i));
  app.add_choice<Enum>(option, value, choices, what);
}

void add_fit_option(Command& app, CurveFit& fit);

/// SCENE, --fabric, --grid, --segments, --start-from; --out with its own words.
void add_run_options(Command& app, RunArguments& args, const std::string& out_holds);

/// The files behind them.
struct RunInputs {
  Scene scene;
  Fabric fabric;
  Print print;
  std::optional<Sheet> measured;
};

/// Scene, its fabric or another, and print. Throws Error(bad_input) where no cloth has such a
/// friction or gravity, or the pins are farther apart than the fabric was stretched.
[[nodiscard]] RunInputs read_checked(const std::filesystem::path& scene,
                                     const std::optional<std::filesystem::path>& fabric);

/// The measured sheet, or another simulator's mesh, that places a drape of the scene. Throws
/// Error(bad_input) for gravity that no real drape has, and for a sheet of another print.
[[nodiscard]] Sheet read_start_of(const std::filesystem::path& file, const Scene& scene,
                                  const Print& print);

/// Throws Error(bad_input) where the sheet says that it was measured of another scene.
void require_same_drape(const std::filesystem::path& reference, const Scene& scene);

/// Throws Error(usage), before anything is touched, where an output is one of the inputs or a file
/// of the scene or its fabric, of which nothing is given for the scene's own. Returns
/// the files with those among the inputs.
StepFiles refuse_to_replace(const std::filesystem::path& scene,
                            const std::optional<std::filesystem::path>& fabric, StepFiles files);

/// Files read of --start-from; a record takes them when it begins, before any output is touched.
[[nodiscard]] std::vector<std::filesystem::path> start_inputs(const RunArguments& args);

/// The same, and throws Error(usage) where it is a sheet in a folder `branch-*` of --out, in whose
/// place a branch would be written, and Error(bad_input) where the list there cannot be read.
[[nodiscard]] StepFiles start_beside_branches(const RunArguments& args);

/// Writes branches.json after removing the sheets that the earlier one names, and before any new
/// sheet: whenever a run may end, every sheet of a branch stands in the list.
void write_branch_list(const std::filesystem::path& out, const Json& json, RunRecord& record);

/// Reads them, books all but start_inputs() in the record and sets the grid of the options and,
/// after a first run, the reach of the curves. Throws Error.
[[nodiscard]] RunInputs read_run_inputs(RunArguments& args, RunRecord& record);

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

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::CurveFit>[] = {"drape", "whole"};
