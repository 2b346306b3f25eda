// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>

#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

using Eigen::Index;
using Eigen::MatrixX3d;

/// A measured Kawabata value and a friction coefficient repeat within 5 % (one standard deviation);
/// stated, not derived.
constexpr double kMeasuredPart = 0.05;
constexpr double kLevel_deg = 0.06;  // standard uncertainty of a bench's level
constexpr double kOpposite =
    1e-6;  // share of a push; two that differ by less but in sign are a pair

const RealVirtual& headline_of(const Report& report) {
  return report.real_virtual[*report.headline];
}

/// Virtual places of the headline's marks on another simulation (m, world); nothing where one has
/// no place.
std::optional<MatrixX3d> places_on(const RealVirtual& other, const RealVirtual& headline) {
  MatrixX3d places(headline.marks.marks.size(), 3);
  std::map<MarkId, Eigen::Vector3d> known;
  for (const MarkError& mark : other.marks.marks) known[mark.mark] = mark.virtual_in_world;
  for (std::size_t k = 0; k < headline.marks.marks.size(); ++k) {
    const auto found = known.find(headline.marks.marks[k].mark);
    if (found == known.end()) return std::nullopt;
    places.row(static_cast<Index>(k)) = found->second;
  }
  return places;
}

/// Adds the effect of another number of segments, where the same drape has one.
void add_segments(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const RealVirtual& headline = headline_of(report);
  const Simulation& chosen = input.simulations[headline.simulation];
  const RealVirtual* other = nullptr;
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& one = input.simulations[row.simulation];
    if (!one.other_simulator && !one.branch && one.setup() == chosen.setup() &&
        one.discretisation() == chosen.discretisation() &&
        one.source().segments != chosen.source().segments)
      other = &row;
  }
  const auto places = other != nullptr ? places_on(*other, headline) : std::nullopt;
  if (!places) return inputs.lack("segments per curve: simulate two");
  const MatrixX3d change_m = *places - *places_on(headline, headline);
  inputs.effects.push_back(
      {"segments per curve",
       fmt::format("{} gives {:+.3f} mm; as much may be left, up or down",
                   input.simulations[other->simulation].run_label(),
                   (other->statistics.mean_m - headline.statistics.mean_m) / mm),
       true, -change_m, change_m});
}

MarkId id_of(MarkId mark) {
  return mark;
}
template <class Marked>
MarkId id_of(const Marked& one) {
  return one.mark;
}

/// Places of the headline's marks in another list; nothing where it lacks one.
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

/// Adds what the headline's finest mesh may leave, as its levels say.
void add_mesh(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const auto& levels = input.simulations[headline_of(report).simulation].levels;
  if (!levels || !levels->left_m)
    return inputs.lack("the mesh error, which its sheet does not state");
  const auto rows = rows_in(levels->marks, report);
  if (!rows) return inputs.lack("mesh error: levels.json lacks a mark");
  MatrixX3d away_m = inputs.differences_m.rowwise().normalized();
  for (Index k = 0; k < away_m.rows(); ++k)
    away_m.row(k) *=
        levels->marks[static_cast<std::size_t>((*rows)[static_cast<std::size_t>(k)])].left_m;
  inputs.effects.push_back({"mesh",
                            "what its finest mesh may leave, as if every mark moved along its "
                            "distance",
                            true, -away_m, away_m});
}

/// Friction holds the cloth somewhere between what pushes from two sides leave.
void add_friction_band(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const auto list = speaking_list(input);
  if (!list || !list->friction_band) return;
  const FrictionBand* band = &*list->friction_band;
  const auto rows = rows_in(band->marks, report);
  if (!rows) return inputs.lack("friction's interval: the ensemble lacks a mark");
  const auto moves_of = [&](const OtherRest& push) -> MatrixX3d {
    if (push.moves_m) return push.moves()(*rows, Eigen::all);
    return MatrixX3d::Zero(static_cast<Index>(rows->size()), 3);
  };
  for (std::size_t k = 0; k < band->pushes.size(); ++k) {
    for (std::size_t j = 0; j < k; ++j) {
      const OtherRest &down = band->pushes[j], &up = band->pushes[k];
      const Eigen::Vector3d p = *up.push_per_weight;
      if ((p + *down.push_per_weight).norm() > kOpposite * p.norm()) continue;
      if (!down.moves_m && !up.moves_m) {
        inputs.lack("friction's interval: two pushes end elsewhere");
        continue;
      }
      inputs.effects.push_back(
          {fmt::format("friction's interval, push {}", k / 2 + 1),
           fmt::format("where pushes of ({:+.2f}, {:+.2f}, {:+.2f}) and its opposite, per weight, "
                       "leave the ensemble's drape{}",
                       p.x(), p.y(), p.z(),
                       down.moves_m && up.moves_m ? "" : "; one ends elsewhere"),
           true, moves_of(down), moves_of(up)});
    }
  }
}

/// Internal friction holds the cloth somewhere between where two pasts leave it; a drape without it
/// lies about the middle of what a cloth with it leaves open.
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
  const MatrixX3d away_m =
      *own->calibration_m / std::sqrt(3.0) * inputs.differences_m.rowwise().normalized();
  inputs.effects.push_back(
      {"calibration, common to all marks",
       fmt::format("{:.4f} mm RMS in space, as if every mark moved along its distance",
                   *own->calibration_m / mm),
       false, -away_m, away_m});
}

/// The values of a scene that err, by the names of drape simulate sensitivity.
std::vector<std::string> values_of(const Scene& scene) {
  std::vector<std::string> values = {"level_x_deg", "level_y_deg"};
  const auto add_place = [&](const char* what, std::size_t i) {
    for (const char* axis : {"x", "y", "z"})
      values.push_back(fmt::format("{}_{}_{}_mm", what, i + 1, axis));
  };
  for (std::size_t i = 0; i < scene.pins.size(); ++i) add_place("pin", i);
  for (std::size_t i = 0; i < scene.clamps.size(); ++i) add_place("clamp", i);
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    add_place("object", i);
    if (!std::holds_alternative<Plane>(scene.obstacles[i]) &&
        !std::holds_alternative<MeshObject>(scene.obstacles[i]))
      values.push_back(fmt::format("object_{}_size_mm", i + 1));
  }
  if (scene.friction > 0) values.emplace_back("friction");
  return values;
}

/// Standard uncertainty of such a value, in its unit, and its origin.
std::pair<double, std::string> scene_uncertainty(const Scene& scene, const std::string& value) {
  const auto from = [](double u, const char* unit, bool stated) {
    return std::pair(
        u, fmt::format("{:g}{} {}", u, unit, stated ? "as stated" : "assumed, nothing is stated"));
  };
  if (value.starts_with("level"))
    return {kLevel_deg, fmt::format("{:g} degrees, of a bench by its level", kLevel_deg)};
  if (!value.starts_with("object") && value != "friction")
    return {ObjectUncertainty::ruler_m / mm,
            fmt::format("{:g} mm, by a ruler", ObjectUncertainty::ruler_m / mm)};
  if (value == "friction") {
    if (scene.friction_uncertainty) return from(*scene.friction_uncertainty, "", true);
    return {kMeasuredPart * scene.friction, fmt::format("{:g} % of it", 100 * kMeasuredPart)};
  }
  const std::size_t index = std::stoul(value.substr(std::string("object_").size())) - 1;
  const ObjectUncertainty own = scene.uncertainty_of(index);
  return value.find("size") != std::string::npos
             ? from(own.size_m() / mm, " mm", own.stated_size_m.has_value())
             : from(own.place_m() / mm, " mm", own.stated_place_m.has_value());
}

/// The parabola through the moves, taken to `width` instead of the step.
InputEffect effect_of(const MarkMoves& moves, double width, const std::vector<Index>& rows) {
  const double to = width / moves.step;
  const MatrixX3d down_m = moves.down_m(rows, Eigen::all), up_m = moves.up_m(rows, Eigen::all);
  const MatrixX3d slope_m = 0.5 * to * (up_m - down_m), curve_m = 0.5 * to * to * (up_m + down_m);
  return {{}, {}, false, curve_m - slope_m, curve_m + slope_m};
}

/// Adds one value's effect, or what is missing of it.
void add_moves(const std::string& value, const std::optional<MarkMoves>& moves,
               const std::string& absent, std::pair<double, std::string> standard,
               const std::vector<Index>& rows, BudgetInputs& inputs) {
  std::string name = value;
  std::replace(name.begin(), name.end(), '_', ' ');
  if (!moves) {
    return inputs.lack(
        name + ": " +
        (absent.empty() ? "drape simulate sensitivity does not say where the marks go" : absent));
  }
  if (moves->half_width)
    standard = {*moves->half_width, fmt::format("stand-in: within {:g}{}", *moves->half_width,
                                                value == "friction" ? "" : " %")};
  InputEffect effect = effect_of(*moves, standard.first, rows);
  effect.what = name;
  effect.origin = standard.second;
  effect.rectangular = moves->half_width.has_value();
  inputs.effects.push_back(std::move(effect));
}

void add_sensitivities(const DrapeInput& input, const Report& report,
                       const std::optional<SensitivityFile>& split, BudgetInputs& inputs) {
  if (!split || !input.scene) {
    return inputs.lack(
        "place of objects and pins, level, friction and fabric values, which drape run "
        "--uncertainty adds");
  }
  const auto rows = rows_in(split->marks_at, report);
  if (!rows)
    return inputs.lack("scene and fabric values, which drape run --uncertainty finds again");
  for (const ValueEffect& one : split->values)
    add_moves(one.value, one.moves, "",
              {100 * kMeasuredPart, fmt::format("{:g} % of it", 100 * kMeasuredPart)}, *rows,
              inputs);
  if (split->values.empty()) inputs.lack("fabric values: the base has no first-order answer");
  for (const std::string& value : values_of(*input.scene)) {
    const auto one = std::find_if(split->scene.begin(), split->scene.end(),
                                  [&](const SceneEffect& e) { return e.value == value; });
    const bool known = one != split->scene.end();
    add_moves(value, known ? one->moves : std::nullopt, known ? one->absent : "",
              scene_uncertainty(*input.scene, value), *rows, inputs);
  }
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
  add_segments(input, report, inputs);
  add_friction_band(input, report, inputs);
  add_memory(input, report, split, inputs);
  add_sensitivities(input, report, split, inputs);
  return inputs;
}

Budget budget_of(const BudgetInputs& inputs, int draws) {
  Budget budget;
  budget.missing = inputs.missing;
  budget.lines.push_back({"marks, each by itself", inputs.marks_m, "covariance of each mark"});
  for (const InputEffect& effect : inputs.effects)
    budget.lines.push_back({effect.what, alone_m(inputs.differences_m, effect), effect.origin});
  std::stable_sort(budget.lines.begin(), budget.lines.end(),
                   [](const BudgetLine& a, const BudgetLine& b) { return a.u_m > b.u_m; });
  budget.expanded_m = half_width_m(inputs.differences_m, inputs.effects, inputs.marks_m, draws);
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
  table.add({"U: at least 95 of 100 draws of all together lie within",
             fmt::format("{:.4f}", budget.expanded_m / mm), "", ""});
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

namespace {

double mean_norm(const MatrixX3d& rows) {
  return rows.rowwise().norm().mean();
}

/// Uniform in (0, 1) and standard normal, the same on every platform.
class StandardDraws {
 public:
  double uniform() { return (static_cast<double>(words_()) + 0.5) / 4294967296.0; }
  double normal() {  // Box and Muller 1958
    return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * std::numbers::pi * uniform());
  }
  double of(bool rectangular) { return rectangular ? 2 * uniform() - 1 : normal(); }

 private:
  std::mt19937 words_{101};
};

/// The parabola's slope and curvature.
struct Parabola {
  explicit Parabola(const InputEffect& effect)
      : slope(0.5 * (effect.up_m - effect.down_m)),
        curve(0.5 * (effect.up_m + effect.down_m)),
        node(std::sqrt(effect.rectangular ? 0.6 : 3.0)),
        weight(effect.rectangular ? 5.0 / 18 : 1.0 / 6) {}
  MatrixX3d slope, curve;
  double node, weight;  ///< outer nodes of Gauss quadrature of order five, and their weight
};

/// Variance of the mean norm where one input alone errs about `z`, at which the rows are `at_m`.
double variance_alone(const MatrixX3d& at_m, double mean, const Parabola& path, double z) {
  double squares = 0;
  for (const double step : {-path.node, path.node}) {
    const double bend = (2 * z + step) * step;
    double sum = 0;
    for (Eigen::Index k = 0; k < at_m.rows(); ++k)
      sum += (at_m.row(k) + step * path.slope.row(k) + bend * path.curve.row(k)).norm();
    squares += path.weight * std::pow(sum / static_cast<double>(at_m.rows()) - mean, 2);
  }
  return squares;
}

}  // namespace

double alone_m(const MatrixX3d& differences_m, const InputEffect& effect) {
  return std::sqrt(variance_alone(differences_m, mean_norm(differences_m), Parabola(effect), 0));
}

double half_width_m(const MatrixX3d& differences_m, const std::vector<InputEffect>& effects,
                    double added_m, int draws) {
  const std::vector<Parabola> paths(effects.begin(), effects.end());
  StandardDraws random;
  const double mean = mean_norm(differences_m);
  std::vector<double> z(effects.size(), 0.0);
  const auto deviation = [&](const MatrixX3d& at_m, double at_mean) {
    double variance = added_m * added_m;
    for (std::size_t i = 0; i < paths.size(); ++i)
      variance += variance_alone(at_m, at_mean, paths[i], z[i]);
    return std::sqrt(variance);
  };
  const double here = deviation(differences_m, mean);
  if (!(here > 0)) return 0;
  const auto count = static_cast<std::size_t>(draws);
  std::vector<double> off_m(count), by_deviation(count);
  MatrixX3d drawn;
  for (std::size_t k = 0; k < count; ++k) {
    drawn = differences_m;
    for (std::size_t i = 0; i < effects.size(); ++i) {
      z[i] = random.of(effects[i].rectangular);
      drawn += z[i] * paths[i].slope + z[i] * z[i] * paths[i].curve;
    }
    const double there = mean_norm(drawn);
    off_m[k] = std::abs(there + added_m * random.normal() - mean);
    by_deviation[k] = off_m[k] / deviation(drawn, there);
  }
  const auto rank = static_cast<std::size_t>(0.95 * draws);
  return std::max(order_statistic(std::move(off_m), rank),
                  here * order_statistic(std::move(by_deviation), rank));
}

}  // namespace drape::compare
