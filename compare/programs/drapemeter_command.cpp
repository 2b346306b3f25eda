// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "compare/hems/hem_files.hpp"
#include "compare/programs/commands.hpp"
#include "compare/programs/drapemeter_options.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"

namespace drape::compare {

namespace {

/// Outputs, and the inputs given by name; those in folders are found later.
StepFiles named_files(const DrapemeterArguments& arguments) {
  StepFiles files;
  if (arguments.out) files.outputs = {*arguments.out / "hems.csv", *arguments.out / "hems.json"};
  for (const auto* list : {&arguments.inputs, &arguments.compared})
    for (const auto& file : *list)
      if (!std::filesystem::is_directory(file)) files.inputs.push_back(file);
  return files;
}

/// Command with hems.csv as --compare for simulations, which are to be tested, else as input.
std::string next_command(const HemSet& set, const DrapemeterGeometry& geometry,
                         const std::string& csv) {
  const auto all = [&](const auto& is) {
    return !set.hems.empty() && std::all_of(set.hems.begin(), set.hems.end(), is);
  };
  const bool simulated = all([](const auto& hem) { return hem.kind == HemKind::simulated; });
  std::string text = fmt::format("drape drapemeter {} --disc-mm {:.10g}", simulated ? "REAL" : csv,
                                 geometry.disc_m / units::mm);
  if (!all([](const auto& hem) { return hem.own_specimen; }))
    text += fmt::format(" --specimen-mm {:.10g}", geometry.specimen_m / units::mm);
  return text + " --compare " + (simulated ? csv : "SHEET");
}

int run_drapemeter(const DrapemeterArguments& arguments, std::vector<std::string> words,
                   const CommonOptions& common) {
  const StepFiles named = named_files(arguments);
  RunRecord record(
      "drape-compare", std::move(words),
      arguments.out ? run_record_path(*arguments.out / "hems.json") : std::filesystem::path(),
      named);
  const HemReadOptions options = read_options(arguments, thread_count(common));
  HemSet real = read_hems(arguments.inputs, options);
  HemReadOptions virtual_options = options;
  virtual_options.names.clear();
  HemSet compared;
  if (!arguments.compared.empty()) {
    compared = read_hems(arguments.compared, virtual_options);
    refuse_other_kinds(real, compared);
    refuse_copies_of(real, compared);
  }
  MatchOptions match_options;
  match_options.significance = arguments.significance;
  const std::vector<HemMatch> matches = match_hems(real.hems, compared.hems, match_options);
  for (const auto& inputs : {real.inputs, compared.inputs})
    for (const auto& file : inputs)
      if (std::find(named.inputs.begin(), named.inputs.end(), file) == named.inputs.end())
        record.input(file);
  Ending ending = ending_of(real, compared, matches);
  if (arguments.out) {
    const auto &csv = named.outputs[0], &json = named.outputs[1];
    write_durable(csv, hems_csv(options.geometry, real.hems));
    write_record(json, HemsFile{options.geometry, real.hems, real.refused,
                                match_options.significance, matches});
    ending.next_command = next_command(real, options.geometry, shell_word(csv.string()));
  }
  return finish(ending, common, record);
}

}  // namespace

int drapemeter_command(int argc, char** argv) {
  return run_command<DrapemeterArguments>(
      argc, argv, "drape-compare drapemeter",
      "Drape coefficient, nodes and Fourier orders of hems, from pictures or sheets.",
      run_drapemeter);
}

}  // namespace drape::compare
