// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Half a width within which all is equally likely, to a standard uncertainty (JCGM 100, 4.3.7).
const double kRectangular = 1 / std::sqrt(3.0);
/// A value that nobody measured lies within half of what was put in its place; a measured Kawabata
/// value repeats within 5 % (one standard deviation).
constexpr double kStandInHalfWidth = 0.5, kMeasuredPart = 0.05;
constexpr double kCoverage = 2;

const RealVirtual& headline_of(const Report& report) {
  return report.real_virtual[*report.headline];
}

bool names(const std::vector<std::string>& stand_ins, const std::string& word) {
  return std::any_of(stand_ins.begin(), stand_ins.end(),
                     [&](const std::string& what) { return what.find(word) != std::string::npos; });
}

/// The simulation that differs from the headline in nothing but its grid, the next coarser; or in
/// nothing but its segments.
const RealVirtual* neighbour_of(const DrapeInput& input, const Report& report, bool other_grid) {
  const Simulation& chosen = input.simulations[headline_of(report).simulation];
  const RealVirtual* best = nullptr;
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& other = input.simulations[row.simulation];
    if (other.other_simulator || other.branch || other.source().model != chosen.source().model ||
        other.source().solver != chosen.source().solver)
      continue;
    const bool same_grid = other.sheet.sheet.rows == chosen.sheet.sheet.rows;
    const bool same_segments = other.source().segments == chosen.source().segments;
    if (other_grid ? same_grid || !same_segments : !same_grid || same_segments) continue;
    const auto& known = best == nullptr ? row : *best;
    const bool finer =
        other.sheet.sheet.rows >= input.simulations[known.simulation].sheet.sheet.rows;
    if (finer) best = &row;
  }
  return best;
}

void add_neighbour(const DrapeInput& input, const Report& report, bool other_grid, Budget& budget) {
  const std::string what = other_grid ? "grid" : "segments per curve";
  const RealVirtual* other = neighbour_of(input, report, other_grid);
  if (other == nullptr) {
    budget.missing.push_back(what + ": simulate two");
    return;
  }
  const double change = other->statistics.mean_m - headline_of(report).statistics.mean_m;
  budget.lines.push_back(
      {what, std::abs(change) * kRectangular,
       fmt::format("{} gives {:+.3f} mm; as much may be left, up or down",
                   input.simulations[other->simulation].run_label(), change / mm)});
}

void add_measurement(const DrapeInput& input, const Report& report, Budget& budget) {
  const DistanceStatistics& s = headline_of(report).statistics;
  if (s.sigma_mean_m)
    budget.lines.push_back({"marks, each by itself", *s.sigma_mean_m, "covariance of each mark"});
  else
    budget.missing.emplace_back("marks: they carry no covariance");
  const auto& own = input.measured.sheet.error_budget;
  if (own && own->calibration_m)
    budget.lines.push_back(
        {"calibration, common to all marks", *own->calibration_m / std::sqrt(3.0),
         fmt::format("{:.4f} mm RMS in space, as if every mark moved along its distance",
                     *own->calibration_m / mm)});
  else
    budget.missing.emplace_back("calibration: its file gives no covariance");
}

/// Standard uncertainty of what a scene value's sensitivity is given per unit of, and its origin.
std::optional<std::pair<double, std::string>> scene_uncertainty(const Scene& scene,
                                                                const std::string& value) {
  const auto from = [](double u, const char* unit, bool stated) {
    return std::pair(
        u, fmt::format("{:g}{} {}", u, unit, stated ? "as stated" : "assumed, nothing is stated"));
  };
  if (value == "friction") {
    if (scene.friction_uncertainty) return from(*scene.friction_uncertainty, "", true);
    if (names(scene.stand_ins, "friction"))
      return std::pair(kStandInHalfWidth * scene.friction * kRectangular,
                       fmt::format("stand-in: within {:g} %", 100 * kStandInHalfWidth));
    return std::pair(kMeasuredPart * scene.friction, std::string("5 % of it"));
  }
  // "object_2_x_mm", "object_2_size_mm"
  const std::string prefix = "object_";
  if (!value.starts_with(prefix)) return std::nullopt;
  const std::size_t index = std::stoul(value.substr(prefix.size())) - 1;
  const ObjectUncertainty own = scene.uncertainty_of(index);
  const bool size = value.find("size") != std::string::npos;
  return size ? from(own.size_m() / mm, " mm", own.stated_size_m.has_value())
              : from(own.place_m() / mm, " mm", own.stated_place_m.has_value());
}

void add_sensitivities(const DrapeInput& input, const std::optional<ErrorSplitFile>& split,
                       const FabricFacts& fabric, Budget& budget) {
  if (!split || !input.scene) {
    budget.missing.emplace_back(
        "place and size of the objects, friction and fabric values: run drape sensitivity beside "
        "the sheet");
    return;
  }
  for (const ValueEffect& one : split->values) {
    const std::string kind = one.value.substr(0, one.value.find('_'));
    const bool stand_in = names(fabric.stand_ins, kind + " curves");
    const double part = stand_in ? kStandInHalfWidth * kRectangular : kMeasuredPart;
    std::string name = one.value;
    std::replace(name.begin(), name.end(), '_', ' ');
    budget.lines.push_back({name, std::abs(one.change_m) * 100 * part,
                            stand_in
                                ? fmt::format("stand-in: within {:g} %", 100 * kStandInHalfWidth)
                                : std::string("5 % of it")});
  }
  if (split->values.empty())
    budget.missing.emplace_back("fabric values: the base has no first-order answer");
  if (split->scene.empty() && !input.scene->obstacles.empty())
    budget.missing.emplace_back("place and size of the objects, friction");
  for (const SceneEffect& one : split->scene) {
    const auto u = scene_uncertainty(*input.scene, one.value);
    if (!u) continue;
    std::string name = one.value;
    std::replace(name.begin(), name.end(), '_', ' ');
    budget.lines.push_back({name, std::abs(one.change_m_per_unit) * u->first, u->second});
  }
}

}  // namespace

double Budget::expanded_m() const {
  double squares = 0;
  for (const BudgetLine& line : lines) squares += line.u_m * line.u_m;
  return kCoverage * std::sqrt(squares);
}

Budget budget_of(const DrapeInput& input, const Report& report,
                 const std::optional<ErrorSplitFile>& split, const FabricFacts& fabric) {
  Budget budget;
  if (!report.headline) return budget;
  add_measurement(input, report, budget);
  if (!input.simulations[headline_of(report).simulation].other_simulator) {
    add_neighbour(input, report, true, budget);
    add_neighbour(input, report, false, budget);
    add_sensitivities(input, split, fabric, budget);
  }
  std::stable_sort(budget.lines.begin(), budget.lines.end(),
                   [](const BudgetLine& a, const BudgetLine& b) { return a.u_m > b.u_m; });
  return budget;
}

MatchVerdict match_of(const Report& report) {
  if (!report.headline || !report.budget)
    return {Match::undecided, "nothing was compared mark by mark"};
  if (!report.go()) return {Match::undecided, "the measurement is NO-GO: " + report.no_go.front()};
  const double distance = headline_of(report).statistics.mean_m;
  const double limit = report.budget->expanded_m();
  const char* alone =
      "; repeats of the real drape and other equilibria are not part of the judgement";
  if (distance <= limit)
    return {Match::inside, fmt::format("{:.3f} mm is within the total uncertainty U = {:.3f} mm (k "
                                       "= {:g}){}",
                                       distance / mm, limit / mm, kCoverage, alone)};
  if (!report.budget->missing.empty())
    return {Match::undecided,
            fmt::format("{:.3f} mm is above U = {:.3f} mm, but the budget lacks {}", distance / mm,
                        limit / mm, report.budget->missing.front())};
  return {Match::outside, fmt::format("{:.3f} mm is above the total uncertainty U = {:.3f} mm (k = "
                                      "{:g}){}",
                                      distance / mm, limit / mm, kCoverage, alone)};
}

std::string name_of(Match match) {
  return match == Match::inside ? "inside" : match == Match::outside ? "outside" : "undecided";
}

Table budget_table(const Budget& budget) {
  Table table;
  table.names = {"contribution", "u_mm", "share_percent", "origin"};
  table.heads = {"contribution", "standard uncertainty of the mean (mm)", "part of the square (%)",
                 "from"};
  table.numeric = {false, true, true, false};
  const double total = budget.expanded_m() / kCoverage;
  for (const BudgetLine& line : budget.lines)
    table.add({line.what, fmt::format("{:.4f}", line.u_m / mm),
               total > 0 ? fmt::format("{:.1f}", 100 * std::pow(line.u_m / total, 2)) : "",
               line.origin});
  for (const std::string& what : budget.missing) table.add({what, "", "", "missing"});
  table.add({fmt::format("U, expanded (k = {:g})", kCoverage),
             fmt::format("{:.4f}", budget.expanded_m() / mm), "100", ""});
  return table;
}

std::string budget_sentence(const Budget& budget) {
  std::string text = fmt::format("U = {:.3f} mm (k = {:g})", budget.expanded_m() / mm, kCoverage);
  std::string largest;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, budget.lines.size()); ++i)
    largest += fmt::format("{}{} {:.3f} mm", i == 0 ? "" : ", ", budget.lines[i].what,
                           budget.lines[i].u_m / mm);
  if (!largest.empty()) text += "; largest: " + largest;
  if (!budget.missing.empty())
    text += fmt::format("; at least, because it lacks {}", budget.missing.front());
  return text;
}

std::string distance_sentence(const RealVirtual& row) {
  if (!row.aligned) return {};
  return fmt::format(
      "{:.2f} mm: {:.2f} mm are shape, the others go with a turn of {:.1f} degrees and a shift of "
      "{:.2f} mm of the whole cloth",
      row.statistics.mean_m / mm, row.aligned->after.mean_m / mm,
      row.aligned->turn_rad / units::deg, row.aligned->centroid_shift_m / mm);
}

}  // namespace drape::compare
