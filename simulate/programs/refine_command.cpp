// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/earlier_sheets.hpp"
#include "simulate/objects/scene_files.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"
#include "simulate/refine/refine.hpp"
#include "simulate/start/start_file.hpp"
#include "simulate/study/study.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;
using units::mm;

namespace {

/// Arguments of `drape simulate refine`.
struct RefineArguments {
  std::filesystem::path folder, scene, out;
  std::optional<std::filesystem::path> fabric, start;
  RefineOptions how;
  double goal_mm = RefineOptions{}.goal_m / units::mm;  ///< replaces that of `how`
};

constexpr double kSame_m = 1e-6;  // rounding of the file

SimulateOptions options_of(const CertificateClaim& claim, const SimulatedSource& source) {
  SimulateOptions options;
  options.rows = claim.rows;
  options.cols = claim.cols;
  options.segments = claim.segments;
  options.reach = claim.reach;
  options.model = claim.model;
  options.mass = claim.paper_mass ? MassRule::paper : MassRule::area;
  options.solver = source.solver == "static" ? Solver::newton : Solver::fall;
  options.internal_friction = claim.memory.has_value();
  return options;
}

/// `cause`: why nothing was refined; empty: it was.
Ending ending_of(const Refinement& refinement, const RefineArguments& args,
                 const std::string& cause) {
  Ending ending;
  const auto finest = refinement.finest_at_rest();
  ending.go = finest.has_value();
  ending.verdict = cause.empty() ? left_sentence(refinement) : cause;
  for (const RefinedGrid& grid : refinement.grids)
    ending.numbers.emplace_back(
        folder_of(grid),
        fmt::format("{}, {} steps{}", grid.result.report.sentence, grid.result.report.steps,
                    grid.apart_m
                        ? fmt::format(", {:.3f} mm from the grid before", *grid.apart_m / mm)
                        : std::string()));
  const fs::path sheet =
      finest ? args.out / folder_of(refinement.grids[*finest]) / "sheet.ply" : args.out;
  ending.next_command =
      fmt::format("drape-compare MEASURED.ply {} {} --store results.sqlite --report report.html",
                  shell_word((args.folder / "sheet.ply").string()), shell_word(sheet.string()));
  return ending;
}

/// Throws Error(usage) where a sheet that is read stands in place of one that may be written, or is
/// of an earlier run there.
void refuse_replaced(const RefineArguments& args, const std::vector<GridSpec>& grids) {
  StepFiles replaced{{}, {args.folder / "sheet.json"}};
  if (args.start)
    for (const fs::path& file : start_files(*args.start)) replaced.inputs.push_back(file);
  std::vector<fs::path> folders = earlier_grids(args.out);
  for (const GridSpec& grid : grids)
    folders.push_back(args.out / fmt::format("{}x{}", grid.rows, grid.cols));
  for (const fs::path& folder : folders)
    for (const fs::path& file : sheet_files(folder)) replaced.outputs.push_back(file);
  refuse_to_replace(args.scene, args.fabric, std::move(replaced));
}

/// Refines a simulation's folder, writes and says what was found; exit code. Throws Error.
int run_refine(RefineArguments args, std::vector<std::string> words, const CommonOptions& common) {
  if (args.folder.empty() || args.scene.empty() || args.out.empty())
    throw usage_error("FOLDER, --scene or --out is missing", "give all three");
  args.how.goal_m = args.goal_mm * mm;
  args.how.check();
  const fs::path rest_file = args.folder / "sheet.json";
  const CertificateClaim claim = read_claim(args.folder);
  const Rest rest{read_sheet(rest_file), claim.contact_forces};
  auto [scene, fabric, print, measured] = read_checked(args.scene, args.fabric);
  if (args.start) measured = read_start_of(*args.start, scene, print);
  const auto* source = std::get_if<SimulatedSource>(&rest.sheet.source);
  if (source == nullptr || source->scene_sha256 != sha256_of_file(args.scene) ||
      source->fabric_sha256 != fabric_sha256(fabric) ||
      !((rest.sheet.patch_m - print.patch_m).norm() <= kSame_m))
    throw bad_input(
        "the sheet was simulated from another content of scene or fabric, or of another patch",
        {.file = rest_file.string()}, "simulate it again");
  if (args.start && source->start_sha256 != start_sha256(*args.start))
    throw bad_input(
        source->start_sha256
            ? fmt::format("the sheet was placed by another start than {}", args.start->string())
            : "the sheet was simulated without --start-from",
        {.file = rest_file.string(), .field = "source.start_sha256"},
        "give the start that it was simulated with, or simulate it again");
  const std::vector<GridSpec> finer =
      refined_grids({claim.rows, claim.cols, print.patch_m}, args.how.finest);
  refuse_replaced(args, finer);
  RunRecord record("drape-simulate", std::move(words), args.out / "refinement.run.json");
  record.input(rest_file);
  record.input(args.folder / "certificate.json");
  if (!claim.contact_forces.empty()) record.input(args.folder / "contact_forces.csv");
  for (const fs::path& file : files_of(scene, fabric)) record.input(file);
  if (args.start)
    for (const fs::path& file : start_files(*args.start)) record.input(file);
  const std::optional<std::string> no_go = rest.sheet.no_go ? rest.sheet.no_go : no_go_of(measured);
  SimulateOptions options = options_of(claim, *source);
  options.threads = thread_count(common);
  Refinement refinement;
  std::string cause;
  if (!claim.at_rest)
    cause = "the sheet to refine is not at rest";
  else if (finer.empty())
    cause = fmt::format("{}x{} particles are as fine as --finest {} allows", claim.rows, claim.cols,
                        args.how.finest);
  if (cause.empty()) refinement = refine(scene, fabric, print, measured, options, rest, args.how);
  remove_durable(args.out / "refinement.json");
  remove_sheets(earlier_grids(args.out));
  for (RefinedGrid& grid : refinement.grids) {
    auto& own = std::get<SimulatedSource>(grid.result.sheet.source);
    own.start_sha256 = source->start_sha256;
    own.solver = source->solver;
    own.refined_from_sha256 = sha256_of_file(rest_file);
    grid.result.sheet.no_go = no_go;
    options.rows = grid.result.sheet.rows;
    options.cols = grid.result.sheet.cols;
    write_outputs(args.out / folder_of(grid), grid.result, options, record);
  }
  write_json(args.out / "refinement.json",
             refinement_json(refinement, print, args.how, sha256_of_file(rest_file), args.out));
  record.output(args.out / "refinement.json");
  Ending ending = ending_of(refinement, args, cause);
  ending.warnings = fabric.warnings;
  return finish(resting_on(no_go, std::move(ending)), common, record);
}

}  // namespace

int refine_command(int argc, char** argv) {
  Command app(
      "Carries a drape that rests over to finer grids and states what the grid leaves.\n\n"
      "  drape simulate refine out/C/simulations/31-5 --scene rigs/bench1/scenes/C.toml --out "
      "out/C/refined",
      "drape-simulate refine");
  CommonOptions common;
  add_common_options(app, common);
  RefineArguments args;
  app.add_option("FOLDER", args.folder, "of a simulation, with sheet.ply and certificate.json");
  app.add_option("--scene", args.scene, "scene.toml that was simulated");
  app.add_option("--fabric", args.fabric, "fabric.toml; default: the scene's");
  app.add_option("--start-from", args.start,
                 "measured sheet.ply or mesh.toml that placed the start and pins");
  app.add_option("--finest", args.how.finest, "particles along the longer side, at most")
      ->capture_default_str();
  app.add_option("--goal-mm", args.goal_mm,
                 "no finer grid is tried where this one leaves less, mean over the marks")
      ->capture_default_str();
  app.add_option("--out", args.out, "folder for refinement.json and NxN/sheet.ply");
  return run_program(app, argc, argv, common,
                     [&] { return run_refine(args, arguments_of(argc, argv), common); });
}

}  // namespace drape::simulate
