// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/budget.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/scene_values.hpp"
#include "core/statistics/distributions.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

using Eigen::Index;
using Eigen::MatrixX3d;

/// Repeatability of a measured Kawabata value and of a friction coefficient (one standard
/// deviation), 5 %; assumed, not derived.
constexpr double kMeasuredPart = 0.05;
constexpr double kNormal = 1.96, kRectangular = 1.6454;  // 0.95 sqrt(3); coverage factors for 95 %
constexpr double kBend = 2.4;  // exponent; error 1 % for two rectangular, 3 % for one and a normal
constexpr std::size_t kLeastDrawn = 2;  // with fewer there is no scatter

/// Change of the mean distance due to displacements of the marks.
double mean_change_m(const MatrixX3d& differences_m, const MatrixX3d& moves_m) {
  return ((differences_m + moves_m).rowwise().norm() - differences_m.rowwise().norm()).mean();
}

const RealVirtual& headline_of(const Report& report) {
  return report.real_virtual[*report.headline];
}

MarkId id_of(MarkId mark) {
  return mark;
}
template <class Marked>
MarkId id_of(const Marked& one) {
  return one.mark;
}

/// Positions of the headline's marks in another list; nullopt if it lacks one.
template <class Marks>
std::optional<std::vector<Index>> rows_in(const Marks& marks, const Report& report) {
  std::vector<Index> rows;
  for (const MarkError& mark : headline_of(report).marks.marks) {
    const auto at = std::find_if(marks.begin(), marks.end(),
                                 [&](const auto& one) { return id_of(one) == mark.mark; });
    if (at == marks.end()) return std::nullopt;
    rows.push_back(at - marks.begin());
  }
  return rows;
}

/// Adds the error of the headline's finest mesh from its levels: along each mark's displacement
/// from the next coarser mesh, or along its distance.
void add_mesh(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const auto& levels = input.simulations[headline_of(report).simulation].levels;
  if (!levels || !levels->left_m)
    return inputs.lack("the mesh error, which its sheet does not state");
  const auto rows = rows_in(levels->marks, report);
  if (!rows) return inputs.lack("mesh error: levels.json lacks a mark");
  MatrixX3d way_m = inputs.differences_m.rowwise().normalized();
  double sum_m = 0;
  for (Index k = 0; k < way_m.rows(); ++k) {
    const LevelMark& mark =
        levels->marks[static_cast<std::size_t>((*rows)[static_cast<std::size_t>(k)])];
    if (mark.from_coarser_m && mark.from_coarser_m->norm() > 0)
      way_m.row(k) = mark.from_coarser_m->normalized();
    way_m.row(k) *= mark.left_m;
    sum_m += mark.left_m;
  }
  inputs.effects.push_back(
      {"mesh", "what its finest mesh may leave, along each mark's way from the next coarser one",
       true, -way_m, way_m,
       fmt::format("`--spacing-mm {:g}`", levels->levels.back().spacing_m / mm / 2),
       sum_m / static_cast<double>(way_m.rows())});
}

/// Adds the effects of friction, folds and edges beyond first order, from drapes on the ensemble's
/// mesh with errors in all stated values at once.
void add_beyond_first_order(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const auto list = speaking_list(input);
  if (!list) return;
  if (!list->beyond_first_order)
    return inputs.lack("answers beyond first order: the ensemble's own drape gives none");
  const BeyondFirstOrder& beyond = *list->beyond_first_order;
  const auto rows = rows_in(beyond.marks_at, report);
  if (!rows) return inputs.lack("answers beyond first order: the ensemble lacks a mark");
  for (const ErringRest& rest : beyond.rests)
    if (rest.moves_m)
      inputs.drawn.push_back({one_a_row(*rest.moves_m)(*rows, Eigen::all),
                              one_a_row(*rest.first_order_m)(*rows, Eigen::all)});
  if (inputs.drawn.size() < kLeastDrawn)
    inputs.lack(
        fmt::format("answers beyond first order: {} of {} drapes with all stated values "
                    "wrong at once stay on the branch",
                    inputs.drawn.size(), beyond.rests.size()));
}

/// Adds the range in which internal friction can hold the cloth, from the rests after two loading
/// histories; a drape without it lies near the middle of the range of one with it.
void add_memory(const DrapeInput& input, const Report& report,
                const std::optional<SensitivityFile>& split, BudgetInputs& inputs) {
  std::vector<MarkId> marks;
  InputEffect effect{"internal friction's interval", {}, true, {}, {}};
  if (const auto list = speaking_list(input); list && list->memory_band) {
    const MemoryBand* band = &*list->memory_band;
    for (const MarkInterval& one : band->marks) marks.push_back(one.mark);
    effect.down_m = band->lowest_m();
    effect.up_m = band->highest_m();
    effect.origin =
        "between the lowest and the highest end of the ensemble's drape after other pasts";
  } else if (split) {
    const auto one = std::find_if(split->scene.begin(), split->scene.end(), [](const auto& value) {
      return value.value == "internal_friction";
    });
    if (one == split->scene.end() || !one->moves) return;
    marks = split->marks_at;
    effect.down_m = one->moves->down_m;
    effect.up_m = one->moves->up_m;
    effect.origin =
        fmt::format("both branches of the loops give {:+.3f} mm; as much may be left, up or down",
                    one->change_m_per_unit.value_or(0) / mm);
  } else {
    return;
  }
  const auto rows = rows_in(marks, report);
  if (!rows) return inputs.lack("internal friction's interval: it lacks a mark");
  effect.down_m = MatrixX3d(effect.down_m(*rows, Eigen::all));
  effect.up_m = MatrixX3d(effect.up_m(*rows, Eigen::all));
  inputs.effects.push_back(std::move(effect));
}

void add_measurement(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const RealVirtual& headline = headline_of(report);
  const std::vector<MarkError>& marks = headline.marks.marks;
  inputs.differences_m.resize(static_cast<Index>(marks.size()), 3);
  for (std::size_t k = 0; k < marks.size(); ++k)
    inputs.differences_m.row(static_cast<Index>(k)) =
        marks[k].virtual_in_world - marks[k].real_in_world;
  if (headline.statistics.sigma_mean_m)
    inputs.marks_m = *headline.statistics.sigma_mean_m;
  else
    inputs.lack("marks: they carry no covariance");
  const auto& own = input.measured.sheet.error_budget;
  if (!own || !own->calibration_m) {
    return inputs.lack("calibration: its file gives no covariance");
  }
  const auto add_common = [&](const char* what, double rms_m) {
    const MatrixX3d away_m = rms_m / std::sqrt(3.0) * inputs.differences_m.rowwise().normalized();
    inputs.effects.push_back(
        {what,
         fmt::format("{:.4f} mm RMS in space, as if every mark moved along its distance",
                     rms_m / mm),
         false, -away_m, away_m});
  };
  const double target_m = own->target_m.value_or(0);
  add_common("calibration, common to all marks",
             std::sqrt(std::max(0.0, std::pow(*own->calibration_m, 2) - target_m * target_m)));
  if (own->target_m) add_common("the calibration target's own error", target_m);
}

/// Adds the effect of one value, or what is missing to compute it.
void add_moves(const std::string& value, const std::optional<MarkMoves>& moves,
               const std::string& absent, const ValueWidth& width, const std::vector<Index>& rows,
               BudgetInputs& inputs) {
  std::string name = value;
  std::replace(name.begin(), name.end(), '_', ' ');
  if (!moves)
    return inputs.lack(
        name + ": " +
        (absent.empty() ? "sensitivity.json does not say where the marks go" : absent));
  // Evaluates the parabola through the displacements at the width instead of the step.
  const MatrixX3d down_m = moves->down_m(rows, Eigen::all), up_m = moves->up_m(rows, Eigen::all);
  const auto at = [&](double steps) -> MatrixX3d {
    return 0.5 * steps * (up_m - down_m) + 0.5 * steps * steps * (up_m + down_m);
  };
  inputs.effects.push_back({name,
                            width.origin,
                            width.rectangular,
                            at(-width.down / moves->step),
                            at(width.up / moves->step),
                            width.remedy,
                            {}});
}

/// Adds the effect of another friction on the ensemble's drape from the scene's own start; if one
/// end of its range leads to another branch, the effect of the other end counts on both sides.
void add_friction_ends(const FrictionBand& band, const ValueWidth& width, const Report& report,
                       BudgetInputs& inputs) {
  const auto rows = rows_in(band.marks, report);
  if (!rows) return inputs.lack("friction: the ensemble lacks a mark");
  std::vector<std::string> lost;
  std::vector<std::optional<MatrixX3d>> moves_m;
  for (const OtherRest& end : band.ends) {
    moves_m.emplace_back();
    if (end.moves_m)
      moves_m.back() = end.moves()(*rows, Eigen::all);
    else
      lost.push_back(fmt::format("{}: {}", end.what, end.ending));
  }
  if (moves_m.size() != 2 || (!moves_m[0] && !moves_m[1]))
    return inputs.lack(fmt::format("friction ({})", fmt::join(lost, "; ")));
  for (std::size_t k = 0; k < 2; ++k)
    if (!moves_m[k]) moves_m[k] = -*moves_m[1 - k];
  inputs.effects.push_back({"friction",
                            lost.empty() ? width.origin : width.origin + "; " + lost.front(),
                            width.rectangular,
                            *moves_m[0],
                            *moves_m[1],
                            width.remedy,
                            {}});
}

void add_sensitivities(const DrapeInput& input, const Report& report,
                       const std::optional<SensitivityFile>& split, BudgetInputs& inputs) {
  if (!split || !input.scene)
    return inputs.lack(
        "place of objects and pins, level, friction, segments and fabric values: `drape run` "
        "without --single adds them");
  const auto rows = rows_in(split->marks_at, report);
  if (!rows) return inputs.lack("scene and fabric values: `drape run` finds them again");
  for (const ValueEffect& one : split->values) {
    const bool stand_in = one.moves && one.moves->half_width.has_value();
    std::string name = one.value;
    std::replace(name.begin(), name.end(), '_', ' ');
    const double width = stand_in ? *one.moves->half_width : 100 * kMeasuredPart;
    add_moves(
        one.value, one.moves, "",
        {width, width, stand_in,
         fmt::format(fmt::runtime(stand_in ? "stand-in: within {:g} %" : "{:g} % of it"), width),
         stand_in ? "measure " + name : ""},
        *rows, inputs);
  }
  if (split->values.empty()) inputs.lack("fabric values: the base has no first-order answer");
  const auto find = [&](const std::string& value) {
    return std::find_if(split->scene.begin(), split->scene.end(),
                        [&](const SceneEffect& e) { return e.value == value; });
  };
  const auto add = [&](const std::string& value, const ValueWidth& width) {
    const auto one = find(value);
    const bool known = one != split->scene.end();
    add_moves(value, known ? one->moves : std::nullopt, known ? one->absent : "", width, *rows,
              inputs);
  };
  const auto pin_m = [&](const Pin& pin) {
    const SheetMark* mark = input.measured.sheet.find(pin.mark);
    return mark != nullptr && mark->covariance_m2 ? worst_sigma_m(*mark->covariance_m2) : 0.0;
  };
  const auto list = speaking_list(input);
  for (const auto& [value, width] : values_of(*input.scene, pin_m))
    if (value == "friction" && list && list->friction_band && !list->friction_band->ends.empty())
      add_friction_ends(*list->friction_band, width, report, inputs);
    else
      add(value, width);
  add("curve_segments", {1, 1, true, "beside twenty segments; as much may be left, up or down",
                         "more segments in the rig"});
  if (InputEffect& last = inputs.effects.back(); last.what == "curve segments")
    last.own_m = std::abs(mean_change_m(inputs.differences_m, last.up_m));
}

}  // namespace

std::string mesh_sentence(const DrapeInput& input, const Report& report) {
  const Simulation& own = input.simulations[headline_of(report).simulation];
  if (own.other_simulator) return {};
  if (own.levels) return mesh_error_sentence(*own.levels);
  return own.is_grid()
             ? "mesh error not known: a grid of particles does not state it; simulate the "
               "cloth without --paper"
             : "mesh error not known: no levels.json lies beside the sheet";
}

std::optional<BranchList> speaking_list(const DrapeInput& input) {
  const Simulation* one = input.speaking_branch();
  return one ? list_above(one->sheet.file, one->branch->set_sha256) : std::nullopt;
}

BudgetInputs budget_inputs_of(const DrapeInput& input, const Report& report,
                              const std::optional<SensitivityFile>& split) {
  BudgetInputs inputs;
  add_measurement(input, report, inputs);
  if (input.simulations[headline_of(report).simulation].other_simulator) {
    inputs.lack(
        "mesh error, scene and fabric values of another simulator: compare a sheet of drape "
        "simulate");
    return inputs;
  }
  add_mesh(input, report, inputs);
  add_beyond_first_order(input, report, inputs);
  add_memory(input, report, split, inputs);
  add_sensitivities(input, report, split, inputs);
  return inputs;
}

double half_width_m(const std::vector<BudgetLine>& lines) {
  double squares = 0, rectangular = 0;
  for (const BudgetLine& line : lines) {
    squares += line.u_m * line.u_m;
    if (line.rectangular) rectangular += std::pow(line.u_m, 4);
  }
  if (!(squares > 0)) return 0;
  const double part = rectangular / (squares * squares);  // over a rectangular one's kurtosis
  return (kNormal - (kNormal - kRectangular) * std::pow(part, kBend)) * std::sqrt(squares);
}

Budget budget_of(const BudgetInputs& inputs) {
  Budget budget;
  budget.missing = inputs.missing;
  budget.lines.push_back({"marks, each by itself", inputs.marks_m, "covariance of each mark"});
  if (inputs.drawn.size() >= kLeastDrawn)
    budget.lines.push_back(
        {"answers beyond first order", beyond_m(inputs.differences_m, inputs.drawn),
         fmt::format("{} drapes with all stated values wrong at once", inputs.drawn.size())});
  for (const InputEffect& effect : inputs.effects)
    budget.lines.push_back({effect.what, alone_m(inputs.differences_m, effect), effect.origin,
                            effect.rectangular, effect.remedy, effect.own_m});
  std::stable_sort(budget.lines.begin(), budget.lines.end(),
                   [](const BudgetLine& a, const BudgetLine& b) { return a.u_m > b.u_m; });
  budget.expanded_m = half_width_m(budget.lines);
  std::vector<BudgetLine> of_inputs;
  for (const BudgetLine& line : budget.lines) {
    budget.own_m += line.own_m.value_or(0);
    if (!line.own_m) of_inputs.push_back(line);
  }
  budget.inputs_m = half_width_m(of_inputs);
  return budget;
}

Table budget_table(const Budget& budget) {
  Table table({"contribution", "u_mm", "share_percent", "origin"}, {1, 2});
  table.headings = {"contribution", "standard uncertainty of the mean, alone (mm)",
                    "part of the squares (%)", "from"};
  double squares = 0;
  for (const BudgetLine& line : budget.lines) squares += line.u_m * line.u_m;
  for (const BudgetLine& line : budget.lines)
    table.add({line.what, fmt::format("{:.4f}", line.u_m / mm),
               squares > 0 ? fmt::format("{:.1f}", 100 * line.u_m * line.u_m / squares) : "",
               line.origin});
  for (const std::string& what : budget.missing) table.add({what, "", "", "missing"});
  table.add({"U, which holds 95 of 100", fmt::format("{:.4f}", budget.expanded_m / mm), "", ""});
  return table;
}

std::string budget_sentence(const Budget& budget) {
  std::string text = fmt::format("U = {:.3f} mm (95 %){}", budget.expanded_m / mm,
                                 budget.missing.empty() ? "" : " at least");
  std::string largest;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, budget.lines.size()); ++i)
    largest += fmt::format("{}{} {:.3f} mm", i == 0 ? "" : ", ", budget.lines[i].what,
                           budget.lines[i].u_m / mm);
  if (!largest.empty()) text += "; largest: " + largest;
  if (!budget.missing.empty())
    text += fmt::format("; it lacks {}", fmt::join(budget.missing, "; "));
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

double beyond_m(const MatrixX3d& differences_m, const std::vector<DrawnTogether>& drawn) {
  double excess = 0;
  for (const DrawnTogether& one : drawn)
    excess += std::pow(mean_change_m(differences_m, one.moves_m), 2) -
              std::pow(mean_change_m(differences_m, one.first_order_m), 2);
  const auto count = static_cast<double>(drawn.size());
  return student_quantile(0.975, count) / kNormal * std::sqrt(std::max(0.0, excess / count));
}

double alone_m(const MatrixX3d& differences_m, const InputEffect& effect) {
  const double reach = effect.rectangular ? 1 : kNormal;
  const MatrixX3d slope_m = 0.5 * reach * (effect.up_m - effect.down_m),
                  curve_m = 0.5 * reach * reach * (effect.up_m + effect.down_m);
  const double farthest_m = std::max(std::abs(mean_change_m(differences_m, curve_m - slope_m)),
                                     std::abs(mean_change_m(differences_m, curve_m + slope_m)));
  return farthest_m / (effect.rectangular ? std::sqrt(3.0) : kNormal);
}

}  // namespace drape::compare
