// SPDX-License-Identifier: Apache-2.0
#include "triangulate/agreement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace drape::triangulate {
namespace {

std::string why_not(PointStatus status) {
  switch (status) {
    case PointStatus::not_observable:
      return "not observable: the rays of its views are nearly parallel";
    case PointStatus::behind_a_camera:
      return "views disagree: the rays meet behind a camera or outside its lens model";
    default:
      return "not converged";
  }
}

std::string names_of(const std::vector<View>& views) {
  std::string names;
  for (const View& view : views) names += (names.empty() ? "" : ", ") + view.camera->camera.name;
  return names;
}

std::vector<View> without(const std::vector<View>& views, std::size_t index) {
  std::vector<View> rest = views;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(index));
  return rest;
}

/// Best of the solutions with one view left out.
struct LeftOut {
  Point point;
  std::size_t index = 0;
  bool unique = true;  ///< true if no other single omission makes the views agree
};

std::optional<LeftOut> leave_one_out(const std::vector<View>& views,
                                     const AgreementLimits& limits) {
  std::optional<LeftOut> best;
  int agreeing = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    Point point = solve_point(without(views, i), limits.min_angle_rad);
    if (point.status != PointStatus::good) continue;
    agreeing += point.disagreement_sigmas() <= limits.max_sigmas;
    if (!best || point.disagreement_sigmas() < best->point.disagreement_sigmas())
      best = LeftOut{std::move(point), i, true};
  }
  if (!best || best->point.disagreement_sigmas() > limits.max_sigmas) return std::nullopt;
  best->unique = agreeing == 1;
  return best;
}

/// Widens the covariance to the views' scatter (Birge 1932), as an error of the dot's shape.
void widen(Point& point) {
  const double surplus = std::max(0.0, point.chi2 / point.degrees_of_freedom - 1);
  point.shape_covariance_m2 +=
      surplus * (point.detection_covariance_m2 + point.shape_covariance_m2);
}

}  // namespace

Agreed solve_with_agreement(const std::vector<View>& views, const AgreementLimits& limits) {
  Agreed result;
  Point all = solve_point(views, limits.min_angle_rad);
  result.disagreement_sigmas = all.disagreement_sigmas();
  const bool within = result.disagreement_sigmas <= limits.max_sigmas;
  const bool bent = !within && views.size() >= 3 && all.rms_px() <= limits.shape_px;
  if (all.status == PointStatus::good && (within || bent)) {
    if (bent) widen(all);
    result.point = std::move(all);
    result.used.resize(views.size());
    std::iota(result.used.begin(), result.used.end(), std::size_t{0});
    return result;
  }
  if (views.size() >= 3) {
    if (auto rest = leave_one_out(views, limits); rest && rest->unique) {
      result.point = std::move(rest->point);
      result.dropped = rest->index;
      for (std::size_t i = 0; i < views.size(); ++i)
        if (i != rest->index) result.used.push_back(i);
      return result;
    }
  }
  result.gap_reason =
      all.status == PointStatus::good
          ? fmt::format(
                "views disagree: {} miss each other by {:.1f} sigma ({:.2f} px), limit {:g}",
                names_of(views), result.disagreement_sigmas, all.rms_px(), limits.max_sigmas)
          : why_not(all.status);
  return result;
}

}  // namespace drape::triangulate
