// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/drapemeter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/statistics/sample.hpp"

namespace drape::compare {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kHarmonics = 24;
constexpr int kRays = 720;           ///< directions at which the hem's radius is sampled
constexpr double kFoldRatio = 0.02;  ///< least prominence of a crest, relative to the mean radius

std::optional<Eigen::Vector2d> projected(const Sheet& sheet, MarkId mark,
                                         const Eigen::Vector2d& centre) {
  const SheetMark* found = sheet.find(mark);
  if (found == nullptr) return std::nullopt;
  return found->point_in_world.head<2>() - centre;
}

double mean_at(const std::vector<double>& values, const std::vector<std::size_t>& places) {
  double sum = 0;
  for (const std::size_t place : places) sum += values[place];
  return sum / static_cast<double>(places.size());
}

}  // namespace

std::vector<std::complex<double>> spectrum_of(const std::vector<double>& radius, int most) {
  const auto n = static_cast<double>(radius.size());
  const auto orders = static_cast<std::size_t>(most) + 1;
  // Separate real and imaginary parts, so that the compiler can vectorise over orders.
  std::vector<double> step_re(orders), step_im(orders), re(orders, 1.0), im(orders, 0.0);
  std::vector<double> sum_re(orders, 0.0), sum_im(orders, 0.0);
  for (std::size_t k = 0; k < orders; ++k) {
    const std::complex<double> step = std::polar(1.0, -kTurn * static_cast<double>(k) / n);
    step_re[k] = step.real();
    step_im[k] = step.imag();
  }
  for (const double r : radius) {
    for (std::size_t k = 0; k < orders; ++k) {
      sum_re[k] += r * re[k];
      sum_im[k] += r * im[k];
      const double turned = re[k] * step_re[k] - im[k] * step_im[k];
      im[k] = re[k] * step_im[k] + im[k] * step_re[k];
      re[k] = turned;
    }
  }
  std::vector<std::complex<double>> result;
  for (std::size_t k = 0; k < orders; ++k) {
    const double part = k == 0 ? 1 / n : 2 / n;
    result.emplace_back(sum_re[k] * part, sum_im[k] * part);
  }
  return result;
}

std::optional<std::vector<double>> closed(const std::vector<std::optional<double>>& outline) {
  std::vector<double> radius;
  for (const auto& r : outline)
    if (r) radius.push_back(*r);
  return radius.size() == outline.size() ? std::optional(radius) : std::nullopt;
}

std::vector<MarkId> border_of(int rows, int cols) {
  std::vector<MarkId> border;
  border.reserve(cols);
  for (int col = 0; col < cols; ++col) border.push_back({0, col});
  for (int row = 1; row < rows; ++row) border.push_back({row, cols - 1});
  for (int col = cols - 2; col >= 0 && rows > 1; --col) border.push_back({rows - 1, col});
  for (int row = rows - 2; row > 0 && cols > 1; --row) border.push_back({row, 0});
  return border;
}

std::string why_no_hem(const Sheet& sheet) {
  const std::vector<MarkId> border = border_of(sheet.rows, sheet.cols);
  const auto missing = std::count_if(border.begin(), border.end(),
                                     [&](MarkId id) { return sheet.find(id) == nullptr; });
  if (missing == 0) return {};
  return fmt::format("the hem was not measured all around: {} of {} outermost marks are missing",
                     missing, border.size());
}

void raise_outline(std::vector<std::optional<double>>& outline, const Eigen::Vector2d& a,
                   const Eigen::Vector2d& b) {
  const auto rays = static_cast<double>(outline.size());
  const double step = kTurn / rays;
  const double from = std::atan2(a.y(), a.x());
  double span = std::atan2(b.y(), b.x()) - from;
  span -= kTurn * std::round(span / kTurn);
  const double low = std::min(from, from + span) / step, high = std::max(from, from + span) / step;
  // A ray within rounding of an end belongs to the segment, so that no vertex is missed.
  const auto last = std::lround(std::floor(high + 1e-9));
  for (auto k = std::lround(std::ceil(low - 1e-9)); k <= last; ++k) {
    const double angle = static_cast<double>(k) * step;
    const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d edge = b - a;
    const double across = ray.x() * edge.y() - ray.y() * edge.x();
    const double moment = a.x() * edge.y() - a.y() * edge.x();
    // An edge along the ray extends to its farther end.
    const double radius = std::abs(across) > 1e-15 * (1e-9 + edge.norm())
                              ? std::clamp(moment / across, 0.0, std::max(a.norm(), b.norm()))
                              : std::max(a.norm(), b.norm());
    const auto count = static_cast<long>(outline.size());
    auto& slot = outline[static_cast<std::size_t>((k % count + count) % count)];
    slot = std::max(slot.value_or(0), radius);
  }
}

Extremes extremes_of(const std::vector<double>& radius, double least) {
  Extremes found;
  // Starting at the lowest point, the first significant extreme is a crest.
  const auto start =
      static_cast<std::size_t>(std::min_element(radius.begin(), radius.end()) - radius.begin());
  bool climbing = true;
  std::size_t extreme = start;
  for (std::size_t i = 1; i <= radius.size(); ++i) {
    const std::size_t here = (start + i) % radius.size();
    if (climbing ? radius[here] > radius[extreme] : radius[here] < radius[extreme]) extreme = here;
    if (std::abs(radius[extreme] - radius[here]) < least) continue;
    (climbing ? found.crests : found.valleys).push_back(extreme);
    climbing = !climbing;
    extreme = here;
  }
  // The walk ends in the valley where it started.
  if (!climbing) found.valleys.push_back(extreme);
  return found;
}

std::optional<Eigen::Vector2d> centre_of(const Obstacle& obstacle) {
  if (const auto* sphere = std::get_if<Sphere>(&obstacle)) return sphere->centre_in_world.head<2>();
  if (const auto* box = std::get_if<Box>(&obstacle))
    return box->world_from_box.translation_m.head<2>();
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle))
    return cylinder->world_from_cylinder.translation_m.head<2>();
  return std::nullopt;
}

std::vector<std::optional<double>> shadow_outline(const Sheet& sheet,
                                                  const Eigen::Vector2d& centre_m, int rays) {
  std::vector<std::optional<double>> outline(static_cast<std::size_t>(rays));
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col) {
      const auto here = projected(sheet, {row, col}, centre_m);
      if (!here) continue;
      for (const MarkId next : {MarkId{row + 1, col}, MarkId{row, col + 1}}) {
        if (const auto there = projected(sheet, next, centre_m))
          raise_outline(outline, *here, *there);
      }
    }
  }
  return outline;
}

Drapemeter drapemeter_of(const std::vector<double>& radius_m, double flat_area_m2,
                         std::optional<double> support_area_m2) {
  Drapemeter result;
  const std::size_t n = radius_m.size();
  const double wedge = 0.5 * std::sin(kTurn / static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    result.covered_area_m2 += wedge * radius_m[i] * radius_m[(i + 1) % n];
  result.flat_area_m2 = flat_area_m2;
  if (support_area_m2 && *support_area_m2 < flat_area_m2)
    result.drape_coefficient =
        (result.covered_area_m2 - *support_area_m2) / (flat_area_m2 - *support_area_m2);
  result.mean_radius_m = mean_of(radius_m);
  const Extremes extremes = extremes_of(radius_m, kFoldRatio * result.mean_radius_m);
  result.folds = static_cast<int>(extremes.crests.size());
  if (!extremes.crests.empty() && !extremes.valleys.empty())
    result.fold_depth_m = mean_at(radius_m, extremes.crests) - mean_at(radius_m, extremes.valleys);
  const auto spectrum = spectrum_of(radius_m, kHarmonics);
  for (int order = 1; order <= kHarmonics; ++order) {
    const std::complex<double> one = std::conj(spectrum[static_cast<std::size_t>(order)]);
    result.spectrum.push_back({order, std::abs(one), one == 0.0 ? 0 : std::arg(one)});
  }
  return result;
}

std::optional<double> support_area_m2(const Obstacle& obstacle) {
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle)) {
    if (std::abs(cylinder->world_from_cylinder.rotation(2, 2)) < 1 - 1e-9) return std::nullopt;
    return std::numbers::pi * cylinder->radius_m * cylinder->radius_m;
  }
  const auto* box = std::get_if<Box>(&obstacle);
  if (box == nullptr) return std::nullopt;
  const Eigen::Vector3d up = box->world_from_box * Eigen::Vector3d(0, 0, 1) -
                             box->world_from_box * Eigen::Vector3d(0, 0, 0);
  if (std::abs(up.z()) < 1 - 1e-9) return std::nullopt;
  return box->size_m.x() * box->size_m.y();
}

DrapemeterResult drapemeter(const Sheet& sheet, const Scene& scene) {
  if (scene.obstacles.size() != 1) return {{}, "it needs exactly one object under the cloth"};
  if (std::string reason = why_no_hem(sheet); !reason.empty()) return {{}, std::move(reason)};
  const Obstacle& obstacle = scene.obstacles.front();
  const std::optional<Eigen::Vector2d> centre_m = centre_of(obstacle);
  if (!centre_m) return {{}, "a plane or a mesh has no centre for it"};
  const auto radius = closed(shadow_outline(sheet, *centre_m, kRays));
  if (!radius) return {{}, "the cloth does not lie all around the object's centre"};
  Drapemeter value = drapemeter_of(*radius, sheet.patch_m.prod(), support_area_m2(obstacle));
  value.centre_in_world = *centre_m;
  return {value, {}};
}

}  // namespace drape::compare
