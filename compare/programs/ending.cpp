// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/ending.hpp"

#include <fmt/format.h>

#include <map>

#include "compare/tables/budget.hpp"
#include "compare/tables/match.hpp"
#include "compare/tables/tables.hpp"
#include "core/files/files.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Kinds of gaps with their counts, in alphabetical order.
std::map<std::string, int> counted_gaps(const Sheet& sheet) {
  std::map<std::string, int> counts;
  for (const Gap& gap : sheet.gaps) ++counts[kind_of_gap(gap.reason)];
  return counts;
}

std::vector<std::string> rejected_marks(const Session& session, const Outcome& outcome) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    for (const auto& [reason, count] : counted_gaps(session.drapes[i].input.measured.sheet)) {
      lines.push_back(fmt::format("{}: {} mark{} not measured: {}", outcome.reports[i].called(),
                                  count, count == 1 ? "" : "s", reason));
    }
  }
  return lines;
}

std::string tables_of(const Session& session, const Outcome& outcome) {
  std::string text;
  const auto add = [&text](const Table& table) { text += text_of(table) + '\n'; };
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const DrapeInput& input = session.drapes[i].input;
    const Report& report = outcome.reports[i];
    if (!report.real_virtual.empty()) add(real_virtual_table(input, report));
    for (const BranchSet& set : report.branch_sets) add(branch_table(input, report, set));
    if (!report.real_surface.empty()) add(surface_table(input, report));
    if (!report.virtual_virtual.empty()) add(virtual_virtual_table(report));
  }
  for (const VirtualGroup& group : outcome.groups) add(virtual_group_table(group));
  return text;
}

}  // namespace

Ending ending_of(const Session& session, const Outcome& outcome) {
  Ending ending;
  ending.tables = tables_of(session, outcome);
  ending.go = outcome.go();
  ending.verdict = outcome.sentence();
  if (ending.go && !outcome.reports.empty())
    ending.numbers.emplace_back("what GO means",
                                "the numbers can be relied on; whether the simulation agrees with "
                                "the cloth is the match");
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    for (auto& [name, value] : key_numbers(session.drapes[i].input, outcome.reports[i]))
      ending.numbers.emplace_back(outcome.reports[i].called() + ", " + name, value);
  }
  if (outcome.stored) {
    ending.numbers.emplace_back(
        "store",
        fmt::format("{}: run {}, {} comparisons added, {} were there already", outcome.store,
                    outcome.run, outcome.stored->added, outcome.stored->present));
  }
  if (!outcome.report.empty()) ending.numbers.emplace_back("report", outcome.report);
  ending.rejected = rejected_marks(session, outcome);
  ending.warnings = outcome.warnings;
  const std::vector<std::string> reasons = outcome.reasons();
  for (std::size_t i = 1; i < reasons.size(); ++i)
    ending.warnings.push_back("NO-GO also because " + reasons[i]);
  if (!outcome.store.empty())
    ending.next_command =
        fmt::format("drape results {} --store {}", outcome.reports.empty() ? "tables" : "list",
                    shell_word(outcome.store));
  return ending;
}

namespace {

Json json_of(const std::optional<ModelRest>& model) {
  if (!model) return nullptr;
  return {{"mean_mm", model->distance_m / mm},
          {"least_mm", model->least_m / mm},
          {"largest_mm", model->largest_m / mm},
          {"range", model->range},
          {"ends_without_rest", model->lost},
          {"from_headline_mm", model->apart_m ? Json(*model->apart_m / mm) : Json()},
          {"other_branch", model->other_branch ? Json(*model->other_branch) : Json()}};
}

Json json_of(const Session& session, const Outcome& outcome, const Ending& ending) {
  Json json;
  json["verdict"] = ending.go ? "GO" : "NO-GO";
  json["sentence"] = ending.verdict;
  json["reasons"] = outcome.reasons();
  json["warnings"] = outcome.warnings;
  json["numbers"] = Json::object();
  for (const auto& [name, value] : ending.numbers) json["numbers"][name] = value;
  json["drapes"] = Json::array();
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = outcome.reports[i];
    const DrapeInput& input = session.drapes[i].input;
    const auto in_mm = [](const std::optional<double>& x) { return x ? Json(*x / mm) : Json(); };
    Json drape;
    drape["name"] = report.name;
    drape["label"] = report.called();
    drape["measurement"] = report.go() ? "GO" : "NO-GO";
    drape["cause"] = report.go() ? Json() : Json(report.no_go.front());
    drape["match"] = name_of(report.match.match);
    drape["match_reason"] = report.match.reason;
    drape["match_rests_on"] = report.match.rests_on;
    drape["match_value_mm"] = in_mm(report.match.value_m);
    drape["match_limit_mm"] = in_mm(report.match.limit_m);
    drape["match_remedies"] = report.match.remedies;
    drape["error_number"] = report.match.error_number ? Json(*report.match.error_number) : Json();
    drape["from_measured_shape"] = json_of(report.match.model);
    drape["match_bases"] = json_of(basis_table(report));
    drape["repeats"] = json_of(repeats_table(report));
    drape["expanded_uncertainty_mm"] =
        report.budget ? Json(report.budget->expanded_m / mm) : Json();
    drape["inputs_uncertainty_mm"] = report.budget ? Json(report.budget->inputs_m / mm) : Json();
    drape["own_error_mm"] = report.budget ? Json(report.budget->own_m / mm) : Json();
    drape["budget_complete"] = report.budget ? Json(report.budget->missing.empty()) : Json();
    if (report.budget) drape["budget"] = json_of(budget_table(*report.budget));
    drape["marks"] = report.measurement.marks;
    drape["gaps"] = report.measurement.gaps;
    drape["sigma_median_mm"] = in_mm(report.measurement.sigma_median_m);
    drape["sigma_max_mm"] = in_mm(report.measurement.sigma_max_m);
    drape["real_vs_virtual"] = json_of(real_virtual_table(input, report));
    drape["branches"] = Json::array();
    for (const BranchSet& set : report.branch_sets) {
      drape["branches"].push_back({{"label", set.label},
                                   {"branches_sha256", set.sha256},
                                   {"sentence", branch_sentence(input, set)},
                                   {"table", json_of(branch_table(input, report, set))}});
    }
    drape["folds"] = json_of(shape_table(input));
    drape["waves"] = json_of(wave_table(input));
    drape["real_vs_surface"] = json_of(surface_table(input, report));
    drape["virtual_vs_virtual"] = json_of(virtual_virtual_table(report));
    json["drapes"].push_back(std::move(drape));
  }
  json["virtual_groups"] = Json::array();
  for (const VirtualGroup& group : outcome.groups) {
    json["virtual_groups"].push_back(
        {{"name", group.name}, {"virtual_vs_virtual", json_of(virtual_group_table(group))}});
  }
  json["rejected"] = ending.rejected;
  json["next_command"] = ending.next_command;
  return json;
}

}  // namespace

int print_ending(const Session& session, const Outcome& outcome, const Ending& ending,
                 const CommonOptions& common) {
  if (common.json) {
    print_text(pretty(json_of(session, outcome, ending)));
  } else if (!common.quiet) {
    print_text(printable(printed(ending)));
  }
  return ending.go ? 0 : 1;
}

}  // namespace drape::compare
