// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/tables/tables.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr double kMicrojoule = 1e-6;

const Branch& facts_of(const DrapeInput& input, const BranchComparison& one) {
  return *input.simulations[one.as_placed.simulation].branch;
}

/// The first that is given may not be the first of its list.
double least_j_of(const DrapeInput& input, const BranchSet& set) {
  const Branch& first = facts_of(input, set.branches.front());
  return first.least_j.value_or(first.energy_j);
}

std::string role_of(const DrapeInput& input, const BranchSet& set, std::size_t k) {
  std::string role = facts_of(input, set.branches[k]).number == 1 ? "least energy" : "";
  if (k == set.nearest) role += role.empty() ? "nearest" : ", nearest";
  return role;
}

}  // namespace

Table branch_table(const DrapeInput& input, const Report& report, const BranchSet& set) {
  Table table;
  table.title =
      fmt::format("Branches, experiment {}: equilibria of {}, by energy", report.name, set.label);
  table.names = {"branch", "energy_uJ",    "above_least_uJ", "starts", "hem_nodes",
                 "stable", "mean_dist_mm", "sigma_mean_mm",  "max_mm"};
  table.headings = {"branch", "energy (µJ)",    "above least (µJ)", "starts",  "folds of the hem",
                    "stable", "mean dist (mm)", "± (mm)",           "max (mm)"};
  table.numeric = {true, true, true, true, true, false, true, true, true};
  const bool turned = set.branches.front().turned.has_value();
  if (turned) {
    for (const char* name : {"turned_mean_mm", "turn_deg", "half_turn"})
      table.names.emplace_back(name);
    for (const char* head : {"mean after best turn (mm)", "turn (°)", "sheet half turned"})
      table.headings.emplace_back(head);
    table.numeric.insert(table.numeric.end(), {true, true, false});
  }
  table.names.emplace_back("role");
  table.headings.emplace_back("");
  table.numeric.push_back(false);
  const double least_j = least_j_of(input, set);
  for (std::size_t k = 0; k < set.branches.size(); ++k) {
    const BranchComparison& one = set.branches[k];
    const Branch& branch = facts_of(input, one);
    const DistanceStatistics& s = one.as_placed.statistics;
    std::vector<std::string> cells = {
        std::to_string(branch.number),
        fmt::format("{:.2f}", branch.energy_j / kMicrojoule),
        fmt::format("{:.2f}", (branch.energy_j - least_j) / kMicrojoule),
        std::to_string(branch.starts),
        std::to_string(branch.hem_nodes),
        branch.stable ? "yes" : "no, a saddle",
        mm_text(s.mean_m),
        mm_text(s.sigma_mean_m),
        mm_text(s.max_m)};
    if (turned) {
      cells.push_back(mm_text(one.turned->mean_m));
      cells.push_back(fmt::format("{:.1f}", one.turned->turn_rad / units::deg));
      cells.emplace_back(one.turned->half_turn ? "yes" : "no");
    }
    cells.push_back(role_of(input, set, k));
    table.add(std::move(cells));
  }
  table.marked_row = set.nearest;
  return table;
}

std::string branch_sentence(const DrapeInput& input, const BranchSet& set) {
  const BranchComparison &nearest = set.branches[set.nearest], &first = set.branches.front();
  const Branch& taken = facts_of(input, nearest);
  const bool whole = set.branches.size() >= static_cast<std::size_t>(taken.of);
  const char* turn = nearest.turned ? " after the best turn" : "";
  std::string text =
      fmt::format("nearest{} is branch {} of {}, {:.3f} mm{}", whole ? "" : " of those given",
                  taken.number, taken.of, nearest.match_m() / mm, turn);
  if (taken.number == 1) {
    text += ", which also has the least energy";
  } else {
    text += fmt::format("; branch 1 of least energy, {:.2f} µJ below, ",
                        (taken.energy_j - least_j_of(input, set)) / kMicrojoule);
    text += facts_of(input, first).number == 1
                ? fmt::format("{:.3f} mm{}", first.match_m() / mm, turn)
                : "is not given";
  }
  if (set.runner_up && facts_of(input, set.branches[*set.runner_up]).number != 1) {
    const BranchComparison& next = set.branches[*set.runner_up];
    text += fmt::format("; next nearest branch {}, {:.3f} mm", facts_of(input, next).number,
                        next.match_m() / mm);
  }
  return text;
}

}  // namespace drape::compare
