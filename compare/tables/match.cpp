// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/match.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

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
constexpr double kConfidence = 0.95;
constexpr double kRounding = 1e-9;  // relative, so that a bound holds what it equals

/// Change of the mean distance due to displacements of the marks.
double mean_change_m(const MatrixX3d& differences_m, const MatrixX3d& moves_m) {
  return ((differences_m + moves_m).rowwise().norm() - differences_m.rowwise().norm()).mean();
}

/// Displacements of the marks by independent errors, on each side in proportion to z.
class Displacements {
 public:
  explicit Displacements(Index marks) : squares_m2_(Eigen::VectorXd::Zero(marks)) {}

  void add(const InputEffect& effect) {
    // Root mean square displacements of both halves of the distribution of z.
    const double root = std::sqrt(effect.rectangular ? 1.0 / 6 : 1.0 / 2);
    errors_.push_back({{root * effect.down_m, root * effect.up_m}, effect.rectangular ? 1.8 : 3});
    for (const MatrixX3d& side_m : errors_.back().sides_m)
      squares_m2_ += side_m.rowwise().squaredNorm();
  }
  /// Errors of each mark by itself.
  void add_independent(double length_m) {
    squares_m2_.array() += length_m * length_m;
    independent_m2_ += length_m * length_m;
  }

  /// Bound of the mean displacement that 95 of 100 drapes keep: the mean of norms is at most
  /// (mean s mean(|e|^2 / s))^(1/2), s the root mean square of each mark's displacement e
  /// (Cauchy-Schwarz), a quadratic form of the errors, whose quantile is that of a chi square
  /// distribution with its mean and variance (Satterthwaite 1946).
  [[nodiscard]] double bound_m() const {
    const Eigen::ArrayXd sizes_m = squares_m2_.array().sqrt();
    const double mean_m = sizes_m.size() > 0 ? sizes_m.mean() : 0;
    if (!(mean_m > 0)) return 0;
    const Eigen::ArrayXd weights =
        (sizes_m > 0).select(mean_m / (static_cast<double>(sizes_m.size()) * sizes_m), 0);
    const auto product_m2 = [&](const MatrixX3d& one, const MatrixX3d& other) {
      return (weights * one.cwiseProduct(other).rowwise().sum().array()).sum();
    };
    // An error of each mark by itself is three errors that displace this mark alone.
    double half_variance_m4 = weights.square().sum() * independent_m2_ * independent_m2_ / 3;
    for (std::size_t i = 0; i < errors_.size(); ++i) {
      double mean_m2 = 0;
      for (const MatrixX3d& side_m : errors_[i].sides_m) {
        const double square_m2 = product_m2(side_m, side_m);
        mean_m2 += square_m2;
        half_variance_m4 += errors_[i].kurtosis * square_m2 * square_m2 +
                            2 * independent_m2_ / 3 *
                                (weights.square() * side_m.rowwise().squaredNorm().array()).sum();
        for (std::size_t k = 0; k < i; ++k)
          for (const MatrixX3d& other_m : errors_[k].sides_m)
            half_variance_m4 += 2 * std::pow(product_m2(side_m, other_m), 2);
      }
      half_variance_m4 -= 0.5 * mean_m2 * mean_m2;
    }
    const double dof =
        std::pow(mean_m, 4) / std::max(half_variance_m4, std::pow(mean_m, 4) / kManyDof);
    return mean_m * std::sqrt(chi_square_beyond(1 - kConfidence, dof) / dof);
  }

 private:
  static constexpr double kManyDof = 1e4;  // the bound is then 1 % above the root mean square

  struct Sides {
    std::array<MatrixX3d, 2> sides_m;
    double kurtosis;  ///< mean of z^4 over the square of that of z^2
  };

  Eigen::VectorXd squares_m2_;
  double independent_m2_ = 0;
  std::vector<Sides> errors_;
};

/// Positions of the headline's marks in another list; nullopt if it lacks one.
template <class List, class MarkOf = std::identity>
std::optional<std::vector<Index>> rows_in(const List& list, const Report& report,
                                          MarkOf mark_of = {}) {
  std::vector<Index> rows;
  for (const MarkError& mark : report.speaks().marks.marks) {
    const auto at = std::ranges::find(list, mark.mark, mark_of);
    if (at == list.end()) return std::nullopt;
    rows.push_back(at - list.begin());
  }
  return rows;
}

/// Adds the error of the headline's finest mesh from its levels: along each mark's displacement
/// from the next coarser mesh, or along its distance.
void add_mesh(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const auto& levels = input.simulations[report.speaks().simulation].levels;
  if (!levels || !levels->left_m)
    return inputs.lack("the mesh error, which its sheet does not state");
  const auto rows = rows_in(levels->marks, report, &LevelMark::mark);
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
       fmt::format("simulate with `--spacing-mm {:g}`", levels->levels.back().spacing_m / mm / 2),
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

/// Null if the file has no such value of the scene.
const SceneEffect* effect_of(const SensitivityFile& split, const std::string& value) {
  const auto one = std::ranges::find(split.scene, value, &SceneEffect::value);
  return one == split.scene.end() ? nullptr : &*one;
}

/// Adds the range in which internal friction can hold the cloth, from the rests after two loading
/// histories; a drape without it lies near the middle of the range of one with it.
void add_memory(const DrapeInput& input, const Report& report,
                const std::optional<SensitivityFile>& split, BudgetInputs& inputs) {
  InputEffect effect{"internal friction's interval", {}, true, {}, {}};
  std::optional<std::vector<Index>> rows;
  if (const auto list = speaking_list(input); list && list->memory_band) {
    const MemoryBand& band = *list->memory_band;
    rows = rows_in(band.marks, report, &MarkInterval::mark);
    effect.down_m = band.lowest_m();
    effect.up_m = band.highest_m();
    effect.origin =
        "between the lowest and the highest end of the ensemble's drape after other pasts";
  } else {
    const SceneEffect* one = split ? effect_of(*split, "internal_friction") : nullptr;
    if (one == nullptr || !one->moves) return;
    rows = rows_in(split->marks_at, report);
    effect.down_m = one->moves->down_m;
    effect.up_m = one->moves->up_m;
    effect.origin =
        fmt::format("both branches of the loops give {:+.3f} mm; as much may be left, up or down",
                    one->change_m_per_unit.value_or(0) / mm);
  }
  if (!rows) return inputs.lack("internal friction's interval: it lacks a mark");
  effect.down_m = MatrixX3d(effect.down_m(*rows, Eigen::all));
  effect.up_m = MatrixX3d(effect.up_m(*rows, Eigen::all));
  inputs.effects.push_back(std::move(effect));
}

void add_measurement(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const RealVirtual& headline = report.speaks();
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
  if (!own || !own->calibration_m) return inputs.lack("calibration: its file gives no covariance");
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

/// Adds the difference of the mean over all marks of the print from that over the compared ones, as
/// if these were chosen at random: variance s^2 / n (1 - n / N) of a mean from a finite population.
/// It adds as a whole, so that fewer marks make no match.
void add_unmeasured(const DrapeInput& input, const Report& report, BudgetInputs& inputs) {
  const MarkComparison& compared = report.speaks().marks;
  const std::size_t count = compared.marks.size(),
                    lacking = input.measured.sheet.gaps.size() + compared.excluded.size();
  if (lacking == 0 || count < 2) return;
  std::vector<double> distances_m;
  for (const MarkError& mark : compared.marks) distances_m.push_back(mark.distance_m);
  const double n = static_cast<double>(count), all = n + static_cast<double>(lacking);
  const double u_m = std::sqrt(squares_about_mean(distances_m) / (n - 1) / n * (1 - n / all));
  inputs.unmeasured = {
      .what = "marks without a distance",
      .u_m = u_m,
      .origin = fmt::format("{} of {}, as if they lacked at random", lacking, count + lacking),
      .own_m = kNormal * u_m};
}

/// Adds the effect of one value, or what is missing to compute it.
void add_moves(const std::string& value, const std::optional<MarkMoves>& moves,
               const std::string& absent, const ValueWidth& width, const std::vector<Index>& rows,
               BudgetInputs& inputs) {
  const std::string name = in_words(value);
  if (!moves)
    return inputs.lack(
        name + ": " +
        (absent.empty() ? "sensitivity.json does not say where the marks go" : absent));
  inputs.effects.push_back({.what = name,
                            .origin = width.origin,
                            .rectangular = width.rectangular,
                            .down_m = width.down / moves->step * moves->down_m(rows, Eigen::all),
                            .up_m = width.up / moves->step * moves->up_m(rows, Eigen::all),
                            .remedy = width.remedy});
}

/// Adds the effect of another friction on the ensemble's drape from the scene's own start; if one
/// end of its range leads to another branch, the effect of the other end counts on both sides.
void add_friction_ends(const FrictionBand& band, const ValueWidth& width, const Report& report,
                       BudgetInputs& inputs) {
  const auto rows = rows_in(band.marks, report, &MarkInterval::mark);
  if (!rows) return inputs.lack("friction: the ensemble lacks a mark");
  std::string lost;
  std::vector<MatrixX3d> moves_m;
  for (const OtherRest& end : band.ends)
    if (end.moves_m)
      moves_m.emplace_back(end.moves()(*rows, Eigen::all));
    else
      lost += fmt::format("{}{}: {}", lost.empty() ? "" : "; ", end.what, end.ending);
  if (band.ends.size() != 2 || moves_m.empty())
    return inputs.lack(fmt::format("friction ({})", lost));
  const bool lower_is_lost = moves_m.size() == 1 && !band.ends.front().moves_m;
  inputs.effects.push_back(
      {.what = "friction",
       .origin = lost.empty() ? width.origin : width.origin + "; " + lost,
       .rectangular = width.rectangular,
       .down_m = lower_is_lost ? MatrixX3d(-moves_m.back()) : moves_m.front(),
       .up_m = moves_m.size() == 2 || lower_is_lost ? moves_m.back() : MatrixX3d(-moves_m.front()),
       .remedy = width.remedy});
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
    const double width = stand_in ? *one.moves->half_width : 100 * kMeasuredPart;
    add_moves(
        one.value, one.moves, "",
        {width, width, stand_in,
         fmt::format(fmt::runtime(stand_in ? "stand-in: within {:g} %" : "{:g} % of it"), width),
         stand_in ? "measure " + in_words(one.value) : ""},
        *rows, inputs);
  }
  if (split->values.empty()) inputs.lack("fabric values: the base has no first-order answer");
  const auto add = [&](const std::string& value, const ValueWidth& width) {
    const SceneEffect* one = effect_of(*split, value);
    add_moves(value, one ? one->moves : std::nullopt, one ? one->absent : "", width, *rows, inputs);
  };
  const auto pin_m = [&](const Pin& pin) {
    const SheetMark* mark = input.measured.sheet.find(pin.mark);
    return mark ? worst_sigma_m(*mark).value_or(0) : 0;
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

constexpr double kBand = 0.95;  // least fraction of marks within their 95 % bands of a drape

std::string face_text(const std::string& face) {
  return face.empty() ? "not stated" : "`" + face + "`";
}

/// RMS distance of the common marks.
std::optional<double> apart_m(const Sheet& a, const Sheet& b) {
  std::vector<double> squares;
  for (const SheetMark& mark : a.marks)
    if (const SheetMark* other = b.find(mark.mark))
      squares.push_back((mark.point_in_world - other->point_in_world).squaredNorm());
  return squares.empty() ? std::nullopt : std::optional(std::sqrt(mean_of(squares)));
}

/// Reason why a laying is not a repeat of the drape's own; empty if it is.
std::string left_out(const SheetFile& own_file, const SheetFile& other_file) {
  const Sheet &own = own_file.sheet, &other = other_file.sheet;
  const std::string face = own_file.face(), its_face = other_file.face();
  if (other.no_go) return "its measurement is NO-GO: " + *other.no_go;
  if (face != its_face)
    return fmt::format("its upper face is {}, the drape's is {}", face_text(its_face),
                       face_text(face));
  if (own_file.measured().calibration_sha256 != other_file.measured().calibration_sha256)
    return "it was measured with another calibration";
  if (own.rows != other.rows || own.cols != other.cols ||
      (own.patch_m - other.patch_m).norm() > 0.01 * mm)
    return "it is another patch or print";
  if (own_file.asked && other_file.asked)
    if (const auto why = difference_of(own_file.asked->surroundings, other_file.asked->surroundings,
                                       "in its scene"))
      return "its object is not where the drape's own was: " + *why;
  return apart_m(own, other) ? "" : "it has no mark in common with the drape's own";
}

/// Mean distance between different repeats.
double mean_apart_m(const RepeatBasis& basis) {
  std::vector<double> values;
  for (std::size_t i = 0; i < basis.real_to_real_m.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) values.push_back(basis.real_to_real_m[i][j]);
  return values.empty() ? 0 : mean_of(values);
}

const MarkRepeats::SheetMatch* among(const Report& report) {
  return report.among_repeats ? &report.among_repeats->matches.front() : nullptr;
}

void add_repeats(const Report& report, std::vector<MatchBasis>& bases) {
  const MarkRepeats::SheetMatch* match = among(report);
  if (match == nullptr) return;
  for (const RepeatBasis& one : match->bases) {
    MatchBasis basis{"repeats: " + one.what, Match::undecided, {}, {}, "mm", one.judgement.p, {}};
    if (one.virtual_to_real_m.empty()) {
      basis.reason = one.reason;
    } else {
      basis.value = mean_of(one.virtual_to_real_m) / mm;
      basis.reason = fmt::format("{:.3f} mm from the repeats, which lie {:.3f} mm apart",
                                 *basis.value, mean_apart_m(one) / mm);
      if (!one.reason.empty()) basis.reason += "; " + one.reason;
    }
    if (basis.p) basis.verdict = *basis.p < report.significance ? Match::outside : Match::inside;
    bases.push_back(std::move(basis));
  }
}

void add_ensemble(const std::optional<PlacedDrape>& ensemble, std::vector<MatchBasis>& bases) {
  if (!ensemble || !ensemble->nearest || !ensemble->distance_m || !ensemble->reach_m) return;
  bases.push_back(
      {"branch",
       ensemble->branch ? Match::inside : Match::outside,
       *ensemble->distance_m / mm,
       *ensemble->reach_m / mm,
       "mm",
       {},
       ensemble->branch
           ? fmt::format("the real drape is on branch {} of the ensemble", *ensemble->branch)
           : fmt::format("the real drape is on no branch of the ensemble, {} is nearest",
                         *ensemble->nearest)});
  if (!ensemble->inside_fraction) return;
  const double in = *ensemble->inside_fraction;
  bases.push_back({"band",
                   in >= kBand ? Match::inside : Match::outside,
                   100 * (1 - in),
                   100 * (1 - kBand),
                   "%",
                   {},
                   fmt::format("{:.0f} % of its marks are in their 95 % bands", 100 * in)});
}

/// Sets the limit and the value compared with it: by the repeats if there are enough, else by the
/// tolerance.
void set_limit(const Options& options, const Report& report, MatchVerdict& verdict) {
  const MarkRepeats::SheetMatch* match = among(report);
  verdict.limit_m = match ? limit_m(*match, report.significance) : std::nullopt;
  if (verdict.limit_m) {
    verdict.value_m = mean_of(match->bases.front().virtual_to_real_m);
    verdict.rests_on = fmt::format(
        "{} repeats", std::ranges::count(report.repeats, std::string(), &RepeatLine::left_out));
  } else if (options.tolerance_m) {
    verdict.limit_m = options.tolerance_m;
    verdict.value_m = report.speaks().statistics.mean_m;
    verdict.rests_on = "tolerance";
  }
}

/// Lines of the inputs: those without a bound.
std::vector<BudgetLine> inputs_of(const std::vector<BudgetLine>& lines) {
  std::vector<BudgetLine> of_inputs;
  std::ranges::copy_if(lines, std::back_inserter(of_inputs),
                       [](const BudgetLine& line) { return !line.own_m; });
  return of_inputs;
}

/// Sets the half width of the inputs alone and the sum of the bounds.
void add_open(Budget& budget) {
  budget.own_m = 0;
  for (const BudgetLine& line : budget.lines) budget.own_m += line.own_m.value_or(0);
  budget.inputs_m = half_width_m(inputs_of(budget.lines));
}

/// Standard uncertainty of a normal contribution that widens these lines to a half width.
double widening_m(const std::vector<BudgetLine>& lines, double to_m) {
  const double own_m = half_width_m(lines);
  if (own_m >= to_m) return 0;
  if (!(own_m > 0)) return to_m * (1 + kRounding) / kNormal;
  double squares_m2 = 0;
  for (const BudgetLine& line : lines) squares_m2 += line.u_m * line.u_m;
  return std::sqrt(squares_m2 * (std::pow(to_m * (1 + kRounding) / own_m, 2) - 1));
}

/// Bound of the mean displacement beyond first order that 95 of 100 drapes keep: prediction bound
/// of the next one's excess (displaced^2 - first order^2)^(1/2) after those that were drawn.
double beyond_bound_m(const std::vector<DrawnTogether>& drawn) {
  if (drawn.size() < kLeastDrawn) return 0;
  const auto square_m2 = [](const MatrixX3d& moves_m) {
    return std::pow(moves_m.rowwise().norm().mean(), 2);
  };
  std::vector<double> sizes_m;
  for (const DrawnTogether& one : drawn)
    sizes_m.push_back(
        std::sqrt(std::max(0.0, square_m2(one.moves_m) - square_m2(one.first_order_m))));
  const auto count = static_cast<double>(drawn.size());
  return mean_of(sizes_m) +
         student_quantile(kConfidence, count - 1) *
             std::sqrt(squares_about_mean(sizes_m) / (count - 1) * (1 + 1 / count));
}

/// Adds what errors lengthen the distances by beyond the lines: none of them alone shows it where
/// the sheets are close. A line for the inputs, and one for what the bounds add to it.
void add_lengthening(const BudgetInputs& inputs, Budget& budget) {
  const double mean_m = inputs.differences_m.rowwise().norm().mean(),
               beyond_m = beyond_bound_m(inputs.drawn);
  Displacements errors(inputs.differences_m.rows());
  errors.add_independent(std::sqrt(3.0 * static_cast<double>(inputs.differences_m.rows())) *
                         inputs.marks_m);
  for (const bool bounds : {false, true}) {
    for (const InputEffect& effect : inputs.effects)
      if (effect.own_m.has_value() == bounds) errors.add(effect);
    if (bounds && inputs.unmeasured) {
      const MatrixX3d away_m = inputs.unmeasured->u_m * inputs.differences_m.rowwise().normalized();
      errors.add({"", "", false, -away_m, away_m});
    }
    const double bound_m = std::hypot(errors.bound_m(), beyond_m),
                 to_m = lengthened_m(mean_m, bound_m);
    add_open(budget);
    const double u_m = widening_m(bounds ? budget.lines : inputs_of(budget.lines), to_m);
    if (!(u_m > 0)) continue;
    BudgetLine line{
        .what = fmt::format("{} that lengthen every distance", bounds ? "bounds" : "errors"),
        .u_m = u_m,
        .origin = fmt::format("all together displace the marks by up to {:.3f} mm", bound_m / mm)};
    if (bounds) line.own_m = std::max(0.0, to_m - budget.inputs_m - budget.own_m);
    budget.lines.push_back(std::move(line));
  }
}

/// Size of a contribution: a bound as it is, else two standard deviations.
double size_m(const BudgetLine& line) {
  return line.own_m.value_or(2 * line.u_m);
}

/// Remedies that together could reduce the open contributions below `room_m`, largest first; empty
/// if even all of them cannot. Halving a mesh spacing halves its contribution, every other remedy
/// removes one.
std::vector<std::string> remedies_of(Budget budget, double room_m) {
  const auto open_m = [&] {
    add_open(budget);
    return budget.inputs_m + budget.own_m;
  };
  std::vector<BudgetLine*> open;
  for (BudgetLine& line : budget.lines)
    if (!line.remedy.empty()) open.push_back(&line);
  std::ranges::stable_sort(open, std::greater(), [](const auto* line) { return size_m(*line); });
  std::vector<std::string> remedies;
  for (BudgetLine* line : open) {
    if (open_m() < room_m) break;
    if (size_m(*line) > 0 && std::ranges::find(remedies, line->remedy) == remedies.end())
      remedies.push_back(line->remedy);
    if (line->own_m) line->own_m = 0.5 * *line->own_m;
    line->u_m = 0;
  }
  return open_m() < room_m ? remedies : std::vector<std::string>();
}

/// A branch from another start that is within the limit while the headline is not; null if branches
/// cannot be distinguished at the headline's distance.
const BranchComparison* branch_within(const DrapeInput& input, const Report& report,
                                      const MatchVerdict& verdict) {
  const auto list = speaking_list(input);
  if (!list || !(list->linked_m < *verdict.value_m)) return nullptr;
  for (const BranchSet& set : report.branch_sets) {
    if (set.sha256 != list->document.sha256()) continue;
    for (const BranchComparison& one : set.branches)
      if (one.as_placed.statistics.mean_m <= *verdict.limit_m &&
          input.simulations[one.as_placed.simulation].branch->starts.size() > 0)
        return &one;
  }
  return nullptr;
}

/// Mean distance of the marks of two simulations, on a round object after the best rotation.
std::optional<double> apart_m(const DrapeInput& input, const RealVirtual& one,
                              const RealVirtual& other, bool round) {
  Sheet places = input.measured.sheet;
  places.marks.clear();
  for (const MarkError& mark : one.marks.marks) {
    SheetMark moved = *input.measured.sheet.find(mark.mark);
    moved.point_in_world = mark.virtual_in_world;
    places.marks.push_back(moved);
  }
  const SheetFile& sheet = input.simulations[other.simulation].sheet;
  const Surface surface(sheet.sheet, sheet.file.string());
  const auto axis = round && input.scene ? axis_of(*input.scene) : std::nullopt;
  if (axis)
    if (const auto turned = best_turn(places, surface, *axis)) return turned->mean_m;
  const MarkComparison compared = compare_marks(places, surface);
  return compared.marks.empty() ? std::nullopt
                                : std::optional(statistics_of(compared.marks).mean_m);
}

/// The drape of the headline's cloth from the measured shape, on the same mesh.
const RealVirtual* from_measured(const DrapeInput& input, const Report& report) {
  const Simulation& own = input.simulations[report.speaks().simulation];
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& one = input.simulations[row.simulation];
    if (!one.other_simulator && !one.branch && one.source().from_measured &&
        one.source().status == "at rest" && one.is_of_cloth_of(own) &&
        one.discretisation() == own.discretisation() && one.segments() == own.segments())
      return &row;
  }
  return nullptr;
}

std::optional<ModelRest> model_of(const DrapeInput& input, const Report& report) {
  const RealVirtual* row = from_measured(input, report);
  const auto& placed = input.placed;
  if (row == nullptr && !(placed && placed->started_there_m)) return std::nullopt;
  ModelRest model;
  model.distance_m = row != nullptr ? row->statistics.mean_m : *placed->started_there_m;
  model.least_m = model.largest_m = model.distance_m;
  const auto range = input.scene ? input.scene->friction_range() : std::nullopt;
  if (range && placed) {
    const auto widen = [&](double at_m) {
      model.least_m = std::min(model.least_m, at_m);
      model.largest_m = std::max(model.largest_m, at_m);
    };
    model.range = fmt::format("friction {:g} to {:g}", range->front(), range->back());
    if (placed->started_there_m) widen(*placed->started_there_m);
    for (const OtherFriction& other : placed->other_frictions)
      if (other.distance_m)
        widen(*other.distance_m);
      else
        model.lost.push_back(fmt::format("friction {:g}: {}", other.friction, other.ending));
  }
  if (const auto list = speaking_list(input); list && row != nullptr) {
    model.apart_m = apart_m(input, report.speaks(), *row, list->round);
    if (model.apart_m) model.other_branch = *model.apart_m > list->linked_m;
  }
  return model;
}

/// Text: ". From the measured shape it rests 13.2 mm away (8 to 13 mm by
/// friction 0.2 to 0.8, not measured), in another equilibrium (branch) than from the scene's
/// start".
std::string model_sentence(const ModelRest& model, const std::optional<double>& u_mm) {
  std::string text = fmt::format(". From the measured shape it rests {} mm away",
                                 figure(model.distance_m / mm, u_mm));
  if (!model.range.empty())
    text += fmt::format(" ({} to {} mm by {}, not measured)", figure(model.least_m / mm, u_mm),
                        figure(model.largest_m / mm, u_mm), model.range);
  if (model.other_branch)
    text += *model.other_branch ? ", in another equilibrium (branch) than from the scene's start"
                                : ", in the same equilibrium (branch) as from the scene's start";
  return text;
}

/// Decides by the limit and says why; if undecided, states the cause and what could lead to a
/// decision.
void judge_by_limit(const DrapeInput& input, const Report& report,
                    const std::optional<double>& u_mm, MatchVerdict& verdict) {
  const Budget& budget = *report.budget;
  const double value_m = *verdict.value_m, limit_m = *verdict.limit_m;
  const double open_m = budget.inputs_m + budget.own_m;
  const std::string open = figure(open_m / mm, u_mm);
  const bool is_u = open == figure(budget.expanded_m / mm, u_mm);
  const std::string margin =
      fmt::format("U{} ({} mm)", is_u ? "" : " with its bounds added in full", open);
  std::string but = "by more than " + margin;
  verdict.match = decide(value_m, open_m, limit_m);
  if (!budget.missing.empty()) {
    verdict.match = Match::undecided;
    but = "but undecided, since U lacks " + budget.missing.front();
    if (budget.missing.size() > 1) but += fmt::format(" and {} more", budget.missing.size() - 1);
  } else if (verdict.match == Match::undecided) {
    but = "but by less than " + margin;
    verdict.remedies = remedies_of(budget, std::abs(value_m - limit_m));
    if (verdict.remedies.empty() && verdict.rests_on == "tolerance")
      verdict.remedies.push_back("lay the cloth three times: their scatter is then the limit");
  } else if (verdict.match == Match::outside) {
    if (const BranchComparison* other = branch_within(input, report, verdict)) {
      verdict.match = Match::undecided;
      but = fmt::format("but another start gives another equilibrium (branch {}), {} mm away",
                        input.simulations[other->as_placed.simulation].branch->number,
                        figure(other->as_placed.statistics.mean_m / mm, u_mm));
    }
  }
  verdict.reason = fmt::format("{} the limit of {} mm ({}){} {}",
                               value_m > limit_m ? "beyond" : "within", figure(limit_m / mm, u_mm),
                               verdict.rests_on, but.starts_with("but") ? "," : "", but);
  const bool by_repeats = verdict.rests_on != "tolerance";
  MatchBasis basis{by_repeats ? "repeats" : "tolerance",
                   verdict.match,
                   value_m / mm,
                   limit_m / mm,
                   "mm",
                   by_repeats ? among(report)->p : std::nullopt,
                   fmt::format("{:.3f} mm are open by the inputs (95 %) and {:.3f} mm by the "
                               "mesh, segments and marks without a distance",
                               budget.inputs_m / mm, budget.own_m / mm)};
  if (!budget.missing.empty())
    basis.reason += fmt::format("; U lacks {}", fmt::join(budget.missing, "; "));
  verdict.bases.insert(verdict.bases.begin(), std::move(basis));
}

}  // namespace

std::string mesh_sentence(const DrapeInput& input, const Report& report) {
  const Simulation& own = input.simulations[report.speaks().simulation];
  if (own.other_simulator) return {};
  if (own.levels)
    return mesh_error_sentence(*own.levels) +
           (own.levels->left_m ? "; U takes what of it lies along the distances" : "");
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
  add_unmeasured(input, report, inputs);
  if (input.simulations[report.speaks().simulation].other_simulator) {
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
  if (inputs.unmeasured) budget.lines.push_back(*inputs.unmeasured);
  if (inputs.drawn.size() >= kLeastDrawn)
    budget.lines.push_back(
        {"answers beyond first order", beyond_m(inputs.differences_m, inputs.drawn),
         fmt::format("{} drapes with all stated values wrong at once", inputs.drawn.size())});
  for (const InputEffect& effect : inputs.effects)
    budget.lines.push_back({effect.what, alone_m(inputs.differences_m, effect), effect.origin,
                            effect.rectangular, effect.remedy, effect.own_m});
  add_lengthening(inputs, budget);
  std::ranges::stable_sort(budget.lines, std::greater(), &BudgetLine::u_m);
  budget.expanded_m = half_width_m(budget.lines);
  add_open(budget);
  return budget;
}

std::string lowers_most(const Budget& budget) {
  const auto most = std::ranges::max_element(budget.lines, {}, [](const BudgetLine& line) {
    return line.remedy.empty() ? -1 : size_m(line);
  });
  if (most == budget.lines.end() || most->remedy.empty()) return {};
  return fmt::format("{}{}: it lowers U most", most->remedy,
                     most->own_m ? "" : " (" + most->origin + ")");
}

std::string budget_sentence(const Budget& budget) {
  std::string text = fmt::format("U = {:.3f} mm (95 %){}", budget.expanded_m / mm,
                                 budget.missing.empty() ? "" : " at least");
  std::string largest;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, budget.lines.size()); ++i)
    largest += fmt::format("{}{} {:.3f} mm", i == 0 ? "" : ", ", budget.lines[i].what,
                           budget.lines[i].u_m / mm);
  if (!largest.empty()) text += "; largest standard deviations: " + largest;
  if (!budget.missing.empty())
    text += fmt::format("; it lacks {}", fmt::join(budget.missing, "; "));
  return text;
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
  const double farthest_m = std::max(std::abs(mean_change_m(differences_m, reach * effect.down_m)),
                                     std::abs(mean_change_m(differences_m, reach * effect.up_m)));
  return farthest_m / (effect.rectangular ? std::sqrt(3.0) : kNormal);
}

double lengthened_m(double mean_m, double bound_m) {
  return mean_m - std::sqrt(std::max(0.0, mean_m * mean_m - bound_m * bound_m));
}

void judge_repeats(const DrapeInput& input, const Options& options, Report& report) {
  report.significance = options.significance;
  if (input.repeats.empty()) return;
  const SheetFile& own = input.measured;
  const auto line_of = [](const SheetFile& file) {
    const RepeatId id = file.repeat.value_or(RepeatId{"", file.measured().set, ""});
    return RepeatLine{{}, file.measured().set, id.name, id.face, {}, {}};
  };
  report.repeats.push_back(line_of(own));
  std::vector<SheetFile> repeats = {own};
  for (std::size_t i = 0; i < input.repeats.size(); ++i) {
    const SheetFile& other = input.repeats[i];
    RepeatLine line = line_of(other);
    line.input = i;
    line.left_out = left_out(own, other);
    line.from_own_m = apart_m(own.sheet, other.sheet);
    if (line.left_out.empty()) repeats.push_back(other);
    report.repeats.push_back(std::move(line));
  }
  if (!report.headline || repeats.size() < 2) return;
  const SheetFile& chosen = input.simulations[report.speaks().simulation].sheet;
  try {
    report.among_repeats = mark_repeats(repeats, {chosen}, options.significance);
  } catch (const Error& error) {
    report.warnings.push_back("the repeats cannot be judged: " + error.what_failed());
  }
}

void judge_resolution(const Options& options, Report& report) {
  MatchVerdict to_decide;
  if (report.headline) set_limit(options, report, to_decide);
  const std::optional<double>& sigma_m = report.measurement.sigma_median_m;
  if (to_decide.limit_m && sigma_m &&
      *sigma_m > options.max_sigma_ratio * std::max(*to_decide.limit_m, *to_decide.value_m))
    report.no_go.push_back(fmt::format(
        "the uncertainty of a mark (median {:.3f} mm) is above {:g} % of the limit ({:.3f} mm)",
        *sigma_m / mm, options.max_sigma_ratio * 100, *to_decide.limit_m / mm));
}

Match decide(double value_m, double open_m, double limit_m) {
  return value_m + open_m <= limit_m  ? Match::inside
         : value_m - open_m > limit_m ? Match::outside
                                      : Match::undecided;
}

MatchVerdict match_of(const DrapeInput& input, const Options& options, const Report& report) {
  MatchVerdict verdict;
  if (!report.headline || !report.budget) {
    verdict.reason = report.go() ? "nothing was compared mark by mark" : report.no_go.front();
    return verdict;
  }
  if (report.budget->expanded_m > 0)
    verdict.error_number = report.speaks().statistics.mean_m / report.budget->expanded_m;
  add_repeats(report, verdict.bases);
  add_ensemble(input.placed, verdict.bases);
  verdict.model = model_of(input, report);
  if (!report.go()) {
    verdict.match = Match::undecided;
    verdict.reason = report.no_go.front();
    return verdict;
  }
  std::optional<double> u_mm;  // rounds the figures; a lower bound rounds nothing
  if (report.budget->missing.empty()) u_mm = report.budget->expanded_m / mm;
  set_limit(options, report, verdict);
  if (verdict.limit_m) {
    judge_by_limit(input, report, u_mm, verdict);
  } else {
    verdict.remedies = {"lay the cloth three times", "state tolerance_mm in the rig"};
    const std::string lower = lowers_most(*report.budget);
    if (!lower.empty() && report.speaks().statistics.mean_m < 2 * report.budget->expanded_m)
      verdict.remedies.insert(verdict.remedies.begin(), lower);
    verdict.reason = "no limit is stated, and fewer than three layings";
  }
  if (verdict.model && verdict.match != Match::inside)
    verdict.reason += model_sentence(*verdict.model, u_mm);
  return verdict;
}

}  // namespace drape::compare
