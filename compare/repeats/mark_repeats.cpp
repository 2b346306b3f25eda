// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/mark_repeats.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compare/metrics/drapemeter.hpp"
#include "compare/metrics/surface.hpp"
#include "core/error.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr double kLeast_m = 1e-6;  // closer hems are copies
constexpr double kLeastBorder =
    0.75;  // fraction of the outermost marks; with fewer the polygon cuts off folds

using Points = std::vector<Eigen::Vector3d>;

/// Marks of the first repeat that all others have too.
std::vector<const SheetMark*> common_marks(const std::vector<SheetFile>& repeats) {
  std::vector<const SheetMark*> common;
  for (const SheetMark& mark : repeats.front().sheet.marks) {
    bool everywhere = true;
    for (const SheetFile& other : repeats)
      everywhere = everywhere && other.sheet.find(mark.mark) != nullptr;
    if (everywhere) common.push_back(&mark);
  }
  return common;
}

double rms_m(const Points& a, const Points& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += (a[i] - b[i]).squaredNorm();
  return std::sqrt(squares / static_cast<double>(a.size()));
}

double orders_apart_m(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow(a[i] - b[i], 2);
  return std::sqrt(squares);
}

/// Judges the repeats alone by one basis, given the distance of two of them.
template <class Shape, class Apart>
RepeatBasis basis_of(const char* what, const std::vector<Shape>& repeats, const Apart& apart) {
  RepeatBasis basis{what, {}, {}, {}, {}};
  for (const Shape& a : repeats) {
    basis.real_to_real_m.emplace_back();
    for (const Shape& b : repeats)
      basis.real_to_real_m.back().push_back(&a == &b ? 0 : apart(a, b));
  }
  return basis;
}

/// Marks with a position on the virtual sheet.
std::vector<const SheetMark*> with_place(const std::vector<const SheetMark*>& marks,
                                         const Surface& surface) {
  std::vector<const SheetMark*> kept;
  for (const SheetMark* mark : marks)
    if (surface.at(mark->material_m)) kept.push_back(mark);
  return kept;
}

Points places_on(const Sheet& sheet, const std::vector<const SheetMark*>& marks) {
  Points points;
  for (const SheetMark* mark : marks) points.push_back(sheet.find(mark->mark)->point_in_world);
  return points;
}

Points places_on(const Surface& surface, const std::vector<const SheetMark*>& marks) {
  Points points;
  for (const SheetMark* mark : marks)
    points.push_back(surface.at(mark->material_m)->point_in_world);
  return points;
}

Hem hem_of(const Points& border) {
  std::vector<Eigen::Vector2d> outline;
  for (const Eigen::Vector3d& point : border) outline.emplace_back(point.head<2>());
  return hem_of_outline(outline);
}

/// The border marks among `marks`, in cyclic order.
std::vector<const SheetMark*> border_among(const std::vector<const SheetMark*>& marks,
                                           const std::vector<MarkId>& border) {
  std::vector<const SheetMark*> kept;
  for (const MarkId& id : border)
    for (const SheetMark* mark : marks)
      if (mark->mark == id) kept.push_back(mark);
  return kept;
}

/// Judgement where the virtual sheet lies `times` as far from every repeat.
Judgement judged(const RepeatBasis& basis, double times, double significance) {
  Distances distances{basis.real_to_real_m, basis.virtual_to_real_m};
  for (double& d : distances.virtual_to_real) d *= times;
  return basis.what == "hem" ? judge_distance(distances, basis.prior, kLeast_m, significance)
                             : judge_points(distances, basis.prior);
}

/// Radius of the circle with the same area.
double radius_of(const Hem& hem) {
  return std::sqrt(hem.area_m2 / std::numbers::pi);
}

/// Adds hem, spectrum and area, or the reason why there are none.
void add_hems(const std::vector<SheetFile>& repeats, const Surface& surface,
              const std::vector<const SheetMark*>& marks, double significance,
              std::vector<RepeatBasis>& bases) {
  const Sheet& first = repeats.front().sheet;
  const std::vector<MarkId> border = border_of(first.rows, first.cols);
  const auto outermost = border_among(marks, border);
  std::string reason;
  std::vector<Hem> hems;
  std::optional<Hem> own;
  if (static_cast<double>(outermost.size()) < kLeastBorder * static_cast<double>(border.size())) {
    reason =
        fmt::format("{} of {} outermost marks are on every sheet", outermost.size(), border.size());
  } else {
    try {
      for (const SheetFile& repeat : repeats)
        hems.push_back(hem_of(places_on(repeat.sheet, outermost)));
      own = hem_of(places_on(surface, outermost));
    } catch (const Error& error) {
      reason = error.what_failed();
    }
  }
  if (!own) {
    for (const char* what : {"hem", "spectrum", "area"})
      bases.push_back({what, {}, {}, {}, reason});
    return;
  }
  RepeatBasis hem = basis_of("hem", hems, hem_distance_m);
  hem.prior = published_priors().hem_score;
  RepeatBasis area = basis_of("area", hems, [](const Hem& a, const Hem& b) {
    return std::abs(radius_of(a) - radius_of(b));
  });
  Points flat;
  for (const SheetMark* mark : outermost)
    flat.emplace_back(mark->material_m.x(), mark->material_m.y(), 0);
  area.prior = published_priors().covered_radius;
  area.prior.variance *= std::pow(radius_of(hem_of(flat)), 2);
  std::vector<std::vector<double>> orders;
  orders.reserve(hems.size());
  for (const Hem& one : hems) orders.push_back(order_amplitudes_m(one, kHemOrders));
  const std::vector<double> own_orders = order_amplitudes_m(*own, kHemOrders);
  RepeatBasis spectrum = basis_of("spectrum", orders, orders_apart_m);
  for (std::size_t i = 0; i < hems.size(); ++i) {
    hem.virtual_to_real_m.push_back(hem_distance_m(hems[i], *own));
    spectrum.virtual_to_real_m.push_back(orders_apart_m(orders[i], own_orders));
    area.virtual_to_real_m.push_back(std::abs(radius_of(hems[i]) - radius_of(*own)));
  }
  hem.judgement = judged(hem, 1, significance);
  spectrum.judgement = judged(spectrum, 1, significance);
  area.judgement = judged(area, 1, significance);
  bases.push_back(std::move(hem));
  bases.push_back(std::move(spectrum));
  bases.push_back(std::move(area));
}

MarkRepeats::SheetMatch match_of(const std::vector<SheetFile>& repeats, const SheetFile& candidate,
                                 const std::vector<const SheetMark*>& common, double significance) {
  const Surface surface(candidate.sheet, candidate.file.string());
  const auto marks = with_place(common, surface);
  if (marks.empty())
    throw bad_input("the virtual sheet has none of the repeats' marks",
                    {.file = candidate.file.string()}, "give a sheet of the same patch");
  MarkRepeats::SheetMatch match{
      candidate.file.string(), static_cast<int>(marks.size()), {}, {}, Match::undecided, {}};
  std::vector<Points> points;
  points.reserve(repeats.size());
  for (const SheetFile& repeat : repeats) points.push_back(places_on(repeat.sheet, marks));
  RepeatBasis basis = basis_of("marks", points, rms_m);
  const Points own = places_on(surface, marks);
  for (const Points& one : points) basis.virtual_to_real_m.push_back(rms_m(one, own));
  if (static_cast<int>(repeats.size()) < kLeastRepeats) {
    match.reason = fmt::format("{} real drape{}: nothing says how far repeats lie apart",
                               repeats.size(), repeats.size() == 1 ? "" : "s");
    match.bases.push_back(std::move(basis));
    return match;
  }
  basis.judgement = judged(basis, 1, significance);
  match.bases.push_back(std::move(basis));
  add_hems(repeats, surface, marks, significance, match.bases);
  std::vector<Judgement> judgements;
  for (RepeatBasis& one : match.bases) {
    judgements.push_back(one.judgement);
    if (!one.judgement.p && one.reason.empty()) one.reason = "the repeats are copies of each other";
  }
  // The marks of copies have no scatter; judging them would judge rounding.
  if (judgements.front().p) match.p = combined_p(judgements);
  if (match.p)
    match.verdict = *match.p < significance ? Match::outside : Match::inside;
  else
    match.reason = match.bases.front().reason;
  return match;
}

}  // namespace

MarkRepeats mark_repeats(const std::vector<SheetFile>& repeats,
                         const std::vector<SheetFile>& virtual_sheets, double significance) {
  if (repeats.empty()) throw usage_error("no repeat is named", "give measured sheets");
  const auto marks = common_marks(repeats);
  if (marks.empty())
    throw bad_input("the repeats have no mark in common", {.file = repeats.front().file.string()},
                    "give sheets of one print");
  MarkRepeats result;
  result.marks = static_cast<int>(marks.size());
  std::vector<Points> points;
  points.reserve(repeats.size());
  for (const SheetFile& repeat : repeats) points.push_back(places_on(repeat.sheet, marks));
  result.real_to_real_m = basis_of("marks", points, rms_m).real_to_real_m;
  for (const SheetFile& candidate : virtual_sheets)
    result.matches.push_back(match_of(repeats, candidate, marks, significance));
  return result;
}

std::optional<double> limit_m(const MarkRepeats::SheetMatch& match, double significance) {
  if (!match.p) return std::nullopt;
  const auto p_at = [&](double times) {
    std::vector<Judgement> judgements;
    for (const RepeatBasis& basis : match.bases)
      if (basis.judgement.p) judgements.push_back(judged(basis, times, significance));
    return combined_p(judgements).value_or(1);
  };
  double low = 0, high = 1;
  while (p_at(high) >= significance && high < 1e9) high *= 2;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (p_at(middle) >= significance ? low : high) = middle;
  }
  return low * mean_of(match.bases.front().virtual_to_real_m);
}

void fields(Fields& f, RepeatBasis& basis) {
  f({"what", "marks, hem, spectrum or area"}, basis.what);
  f({"real_to_real_mm", "distances between repeats", mm}, basis.real_to_real_m);
  f({"virtual_to_real_mm", "distances of the virtual sheet from the repeats", mm},
    basis.virtual_to_real_m);
  f({"p", "probability that a repeat deviates as far; null if not judged"}, basis.judgement.p);
  text_or_null(f, {"reason", "reason if it cannot be judged"}, basis.reason);
}

void fields(Fields& f, MarkRepeats::SheetMatch& match) {
  f({"sheet", "virtual sheet"}, match.name);
  f({"marks", "number of marks compared"}, match.marks);
  std::vector<double> rms_m;
  if (!match.bases.empty()) rms_m = match.bases.front().virtual_to_real_m;
  f({"rms_mm", "RMS distance of the marks from each repeat", mm}, rms_m);
  f({"bases", "kinds of distance"}, match.bases);
  f({"verdict", "verdict of the comparison with the repeats"}, match.verdict);
  text_or_null(f, {"reason", "reason if undecided"}, match.reason);
  f({"p", "probability combined from all tests that could be made"}, match.p);
}

namespace {
struct RepeatRow {
  std::string sheet;
  std::vector<double> rms_m;
};
void fields(Fields& f, RepeatRow& row) {
  f({"sheet", "file"}, row.sheet);
  f({"rms_mm", "RMS distance of the marks from each repeat", mm}, row.rms_m);
}
}  // namespace

void fields(Fields& f, RepeatsFile& file) {
  f({"significance", "probability that a real repeat counts as outside"}, file.significance);
  f({"marks", "number of marks present in every repeat"}, file.found.marks);
  std::vector<RepeatRow> rows;
  for (std::size_t i = 0; i < file.repeats.size(); ++i)
    rows.push_back({file.repeats[i].file.string(), file.found.real_to_real_m[i]});
  f({"repeats", "measured sheets"}, rows);
  f({"matches", "virtual sheets"}, file.found.matches);
}

}  // namespace drape::compare
