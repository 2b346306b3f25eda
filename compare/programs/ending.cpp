// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/ending.hpp"

#include <fmt/format.h>

#include "core/files/files.hpp"
#include "core/program/shell_word.hpp"

namespace drape::compare {

Ending ending_of(const RunReport& report, const Outcome& outcome) {
  Ending ending;
  ending.go = report.go;
  ending.verdict = report.sentence;
  for (const ReportedDrape& drape : report.drapes) {
    const DistanceFigures shown = figures_of(drape);
    if (!shown.mean.empty())
      ending.numbers.emplace_back(
          drape.label, fmt::format("{} mm apart, U {} mm, {}", shown.mean, shown.expanded,
                                   drape::name_of(drape.match.match)));
  }
  if (outcome.stored)
    ending.numbers.emplace_back(
        "store",
        fmt::format("{}: run {}, {} comparisons added, {} were there already", outcome.store,
                    outcome.run, outcome.stored->added, outcome.stored->present));
  if (!outcome.report.empty()) ending.numbers.emplace_back("report", outcome.report);
  ending.rejected = outcome.not_compared;
  ending.warnings = outcome.warnings;
  for (std::size_t i = 1; i < report.reasons.size(); ++i)
    ending.warnings.push_back("NO-GO also because " + report.reasons[i]);
  if (!outcome.store.empty())
    ending.next_command = fmt::format("drape results {} --store {}",
                                      report.run ? fmt::format("show {}", *report.run) : "tables",
                                      shell_word(outcome.store));
  return ending;
}

int print_ending(const RunReport& report, const Ending& ending, const CommonOptions& common) {
  if (common.json) {
    Value all = value_of(report);
    const Value end = value_of(ending);
    for (const auto& [key, value] : *end.get_if<Value::Table>())
      if (all.find(key) == nullptr) all[key] = value;
    print_text(pretty(all));
  } else if (!common.quiet) {
    std::string page;
    for (const auto& [name, value] : ending.numbers)
      if (name == "report") page = value;
    print_text(printable(ending_text(report, first_line(report), page)));
    if (!ending.next_command.empty())
      print_text("next    " + printable(ending.next_command) + "\n");
  }
  return ending.go ? 0 : 1;
}

}  // namespace drape::compare
