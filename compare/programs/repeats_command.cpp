// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/programs/commands.hpp"
#include "compare/records/provenance.hpp"
#include "compare/repeats/mark_repeats.hpp"
#include "compare/repeats/repeat_sheets.hpp"
#include "compare/store/inputs.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {

namespace {

struct RepeatsArguments {
  std::vector<std::filesystem::path> repeats, compared;
  std::optional<std::filesystem::path> out;
  double significance = 0.05;
};

void fields(Fields& f, RepeatsArguments& a) {
  f(Field{"sheet",
          "measured sheets, repeats of one drape (stated in each, or used to position a sheet of "
          "--compare)"}
        .called("SHEET"),
    a.repeats);
  f.otherwise(
      Field{"compare", "simulated sheet of the same drape; can be given several times"}.per_flag(),
      a.compared);
  f.otherwise({"significance", "probability that a real repeat counts as outside", 1, 0.001, 0.5},
              a.significance);
  f({"out", "repeats.json to write"}, a.out);
}

std::vector<SheetFile> sheets_of(const std::vector<std::filesystem::path>& files) {
  std::vector<SheetFile> sheets;
  for (const auto& file : files) sheets.push_back(read_sheet_file(file));
  return sheets;
}

int run_repeats(const RepeatsArguments& arguments, std::vector<std::string> words,
                const CommonOptions& common) {
  StepFiles files{{}, files_of_sheets(arguments.repeats)};
  for (const auto& file : files_of_sheets(arguments.compared)) files.inputs.push_back(file);
  if (arguments.out) files.outputs = {*arguments.out};
  RunRecord record("drape-compare", std::move(words),
                   arguments.out ? run_record_path(*arguments.out) : std::filesystem::path(),
                   files);
  const std::vector<SheetFile> repeats = sheets_of(arguments.repeats);
  const std::vector<SheetFile> compared = sheets_of(arguments.compared);
  require_one_drape(repeats, compared);
  const MarkRepeats found = mark_repeats(repeats, compared, arguments.significance);
  Ending ending;
  for (const auto* sheets : {&repeats, &compared})
    for (const std::string& reason : no_go_of(*sheets)) ending.rejected.push_back(reason);
  for (std::string& reason : moved_objects(repeats, compared))
    ending.rejected.push_back(std::move(reason));
  ending.go = ending.rejected.empty();
  ending.verdict =
      fmt::format("{} repeats with {} marks in common", arguments.repeats.size(), found.marks);
  for (const auto& match : found.matches)
    ending.numbers.emplace_back(match.name,
                                std::string(name_of(match.verdict)) +
                                    (match.p ? fmt::format(", p {:.3f}", *match.p) : "") +
                                    (match.reason.empty() ? "" : "; " + match.reason));
  if (arguments.out)
    write_record(*arguments.out, RepeatsFile{arguments.significance, repeats, found});
  return finish(ending, common, record);
}

}  // namespace

int repeats_command(int argc, char** argv) {
  return run_command<RepeatsArguments>(argc, argv, "drape-compare repeats",
                                       "Tests whether a virtual sheet is inside the repeats of the "
                                       "real one, by marks, hem and spectrum.",
                                       run_repeats);
}

}  // namespace drape::compare
