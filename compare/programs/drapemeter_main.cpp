// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/hems/hem_files.hpp"
#include "compare/programs/drapemeter_options.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"

using namespace drape;
using namespace drape::compare;

namespace {

int run(const DrapemeterArguments& arguments, std::vector<std::string> words,
        const CommonOptions& common) {
  RunRecord record(
      "drape-drapemeter", std::move(words),
      arguments.out ? run_record_path(*arguments.out / "hems.json") : std::filesystem::path());
  const HemReadOptions options = read_options(arguments, thread_count(common));
  const HemSet real = read_hems(arguments.inputs, options);
  HemReadOptions virtual_options = options;
  virtual_options.names.clear();
  HemSet compared;
  if (!arguments.compared.empty()) compared = read_hems(arguments.compared, virtual_options);
  refuse_copies_of(real, compared);
  MatchOptions match_options;
  match_options.significance = arguments.significance;
  const std::vector<HemMatch> matches = match_hems(real.hems, compared.hems, match_options);
  for (const auto& file : real.inputs) record.input(file);
  for (const auto& file : compared.inputs) record.input(file);
  Ending ending = ending_of(real, compared, matches);
  if (arguments.out) {
    const auto csv = *arguments.out / "hems.csv", json = *arguments.out / "hems.json";
    write_durable(csv, hems_csv(options.geometry, real.hems));
    write_json(json, hems_json(options.geometry, real, matches, match_options));
    record.output(csv);
    record.output(json);
    ending.next_command =
        fmt::format("drape drapemeter {} --disc-mm {:.10g} --specimen-mm {:.10g} --compare SHEET",
                    shell_word(csv.string()), options.geometry.disc_m / units::mm,
                    options.geometry.specimen_m / units::mm);
  }
  return finish(ending, common, record);
}

}  // namespace

int main(int argc, char** argv) {
  Command app("Drape coefficient, nodes and Fourier orders of hems, from pictures or sheets.",
              "drape-drapemeter");
  CommonOptions common;
  DrapemeterArguments arguments;
  add_common_options(app, common);
  add_options(app, arguments);
  return run_program(app, argc, argv, common,
                     [&] { return run(arguments, arguments_of(argc, argv), common); });
}
