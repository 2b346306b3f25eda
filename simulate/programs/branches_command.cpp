// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "core/error.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "simulate/ensemble/band.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

struct BranchesArguments : RunArguments {
  BranchOptions branches;
};

int run_branches(BranchesArguments& args, std::vector<std::string> words,
                 const CommonOptions& common) {
  if (args.scene.empty() || args.out.empty())
    throw usage_error("SCENE or --out is missing", "give both");
  RunRecord record("drape-simulate", std::move(words), args.out / "branches.run.json",
                   start_beside_branches(args));
  const RunInputs inputs = read_run_inputs(args, record);
  args.options.solver = Solver::fall;
  args.options.threads = thread_count(common);
  const BranchResult result = simulate_branches(inputs.scene, inputs.fabric, inputs.print,
                                                inputs.measured, args.options, args.branches);
  Json json = branches_json(result.branches);
  const GridSpec grid{args.options.rows, args.options.cols, inputs.print.patch_m};
  const std::vector<MarkBand> band = band_of(result.branches, grid, inputs.print);
  add_band(band, members_at_rest(result.branches), json);
  if (result.branches.friction_band)
    add_friction_band(*result.branches.friction_band, grid, inputs.print, json);
  if (result.branches.memory_band)
    add_memory_band(*result.branches.memory_band, grid, inputs.print, json);
  if (inputs.measured) {
    add_measured(assign(*inputs.measured, result.branches, grid, band),
                 start_from_measured(inputs.scene, inputs.fabric, inputs.print, *inputs.measured,
                                     args.options),
                 json);
  }
  write_branch_list(args.out, json, record);
  Ending ending;
  ending.warnings = inputs.fabric.warnings;
  for (std::size_t k = 0; k < result.sheets.size(); ++k) {
    const fs::path folder = args.out / fmt::format("branch-{:02}", k + 1);
    write_sheet(folder / "sheet.ply", result.sheets[k]);
    for (const char* name : {"sheet.ply", "sheet.json"}) record.output(folder / name);
    const Branch& branch = result.branches.found[k];
    ending.numbers.push_back(
        {fmt::format("branch {}", k + 1),
         fmt::format("{:.2f} uJ, {} folds, {} of the starts{}{}", branch.energy_j / 1e-6,
                     branch.hem.nodes, branch.starts.size(), branch.own_start < 0 ? ", sought" : "",
                     branch.report.stable ? "" : ", a saddle")});
  }
  for (const int start : result.branches.not_at_rest)
    ending.rejected.push_back(fmt::format("start {} did not come to rest", start));
  for (const RefusedStarts& one : result.branches.refused)
    ending.rejected.push_back(fmt::format("start{} {}: {}", one.starts.size() == 1 ? "" : "s",
                                          fmt::join(one.starts, ", "), one.why));
  ending.go = !result.sheets.empty();
  ending.verdict = fmt::format("{} equilibri{} from {} starts", result.sheets.size(),
                               result.sheets.size() == 1 ? "um" : "a", args.branches.starts);
  ending.next_command = fmt::format(
      "drape-compare MEASURED.ply {}/branch-*/sheet.ply "
      "--store results.sqlite --report report.html",
      shell_word(args.out.string()));
  return finish(resting_on(no_go_of(inputs.measured), std::move(ending)), common, record);
}

}  // namespace

int branches_command(int argc, char** argv) {
  Command app("Finds the equilibria of a drape from many starts.", "drape-simulate branches");
  CommonOptions common;
  add_common_options(app, common);
  BranchesArguments args;
  add_run_options(app, args, "folder for branches.json and branch-NN/sheet.ply");
  app.add_option("--kicks", args.branches.kicks,
                 "most tries on one grid for a lower rest, where the sheet touches nothing; 0: "
                 "none; on two pins whose line parts it the sheet falls folded along that line "
                 "instead")
      ->range(0, 100000)
      ->capture_default_str();
  app.add_option("--starts", args.branches.starts, "seeded starts; the first is the scene's own")
      ->range(1, 10000)
      ->capture_default_str();
  app.add_flag(
      "--internal-friction", args.options.internal_friction,
      "use both branches of the bending and shear loops; also the interval that they leave");
  return run_program(app, argc, argv, common,
                     [&] { return run_branches(args, arguments_of(argc, argv), common); });
}

}  // namespace drape::simulate
