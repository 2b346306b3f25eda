// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/ensemble/bands.hpp"
#include "simulate/ensemble/beyond_first_order.hpp"
#include "simulate/ensemble/branches.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

struct BranchesArguments : RunArguments {
  EnsembleOptions ensemble;
};

void fields(Fields& f, BranchesArguments& args) {
  fields(f, static_cast<RunArguments&>(args));
  mesh_fields(f, args.options.drape, true);
  fields(f, args.ensemble);
}

Ending ending_of(const BranchList& list) {
  Ending ending;
  for (const ListedBranch& branch : list.branches)
    ending.numbers.emplace_back(
        fmt::format("branch {}", branch.number),
        fmt::format("{:.2f} uJ, {} folds, {} of the starts{}{}", branch.energy_j / 1e-6,
                    branch.hem_nodes, branch.starts.size(), branch.sought ? ", sought" : "",
                    branch.stable ? "" : ", a saddle"));
  if (list.unseen)
    ending.numbers.emplace_back(
        "unseen", fmt::format("{:.0f} % of starts may end on other branches, at most {:.0f} % (95 "
                              "%)",
                              100 * list.unseen->fraction, 100 * list.unseen->upper95));
  for (const int start : list.not_at_rest)
    ending.rejected.push_back(fmt::format("start {} did not come to rest", start));
  for (const RefusedStarts& one : list.refused)
    ending.rejected.push_back(
        one.starts.empty() ? "a folded start: " + one.why
                           : fmt::format("start {}: {}", fmt::join(one.starts, ", "), one.why));
  for (const ListedBranch& branch : list.branches)
    if (!branch.not_polished.empty())
      ending.warnings.push_back(fmt::format("branch {} stays on the coarsest mesh: {}",
                                            branch.number, branch.not_polished));
  ending.go = !list.branches.empty();
  ending.verdict = fmt::format("{} equilibri{} from {} starts", list.branches.size(),
                               list.branches.size() == 1 ? "um" : "a", list.starts.value_or(0));
  return ending;
}

int run_branches(BranchesArguments args, std::vector<std::string> words,
                 const CommonOptions& common) {
  const std::vector<fs::path> earlier =
      args.out.empty() ? std::vector<fs::path>{} : earlier_branch_files(args.out);
  const RunInputs inputs = read_run_inputs(args, earlier);
  RunRecord record = record_of(args, inputs, std::move(words), args.out / "branches.run.json");
  set_reach(args, inputs);
  args.ensemble.threads = thread_count(common);
  const SimulateOptions& options = args.options;
  const EnsembleCase own =
      ensemble_case(inputs.scene, inputs.fabric, inputs.print, inputs.measured, options);
  const Ensemble ensemble = find_branches(own, args.ensemble);
  BranchList list = list_of(ensemble, own);
  write_branch_list(args.out, list, record);
  OwnBands bands = bands_of_own(
      ensemble, own, fit_laws(inputs.fabric, options.segments, options.reach), args.ensemble);
  list.friction_band = std::move(bands.friction);
  list.memory_band = std::move(bands.memory);
  list.beyond_first_order = beyond_first_order(ensemble, own, inputs.measured, args.ensemble);
  const std::vector<std::size_t> likely = could_be_real(ensemble);
  std::vector<FinishedBranch> finished;
  for (std::size_t k = 0; k < ensemble.branches.size(); ++k) {
    const bool polish = std::find(likely.begin(), likely.end(), k) != likely.end();
    FinishedBranch& one =
        finished.emplace_back(finish_branch(ensemble, k, own, polish, list.branches[k]));
    one.result.sheet.no_go = no_go_of(inputs.measured);
    write_outputs((args.out / list.branches[k].sheet).parent_path(), one.result, record);
    one.result.drape.reset();  // meshes and factors of many branches need much memory
  }
  if (inputs.measured) {
    list.measured = place_measured(ensemble, own, finished, list.band);
    start_from_measured(own, *list.measured);
  }
  write_record(args.out / "branches.json", list);
  Ending ending = ending_of(list);
  ending.warnings.insert(ending.warnings.begin(), own.fitted.warnings.begin(),
                         own.fitted.warnings.end());
  ending.next_command = fmt::format(
      "drape compare MEASURED.ply {}/branch-*/sheet.ply --store results.sqlite --report "
      "report.html",
      shell_word(args.out.string()));
  return finish(resting_on(no_go_of(inputs.measured), std::move(ending)), common, record);
}

}  // namespace

int branches_command(int argc, char** argv) {
  return run_command<BranchesArguments>(
      argc, argv, "drape-simulate branches", "Finds the equilibria of a drape from many starts.",
      run_branches,
      {{"--grid", "--coarsest-mm is the mesh of the starts, --spacing-mm the finest"},
       {"--kicks", "a cloth on two pins falls folded as well, and no other rests are sought"}});
}

}  // namespace drape::simulate
