// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/sight.hpp"

#include <algorithm>
#include <cmath>

#include "triangulate/guards/object_distance.hpp"
#include "triangulate/guards/taut.hpp"
#include "triangulate/lattice_views.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;

constexpr int kPlaces = 9;  ///< on the reachable part of a line, before the search is refined
constexpr int kRefinements = 10;
constexpr int kSightSteps = 12;  ///< of a quarter of the cloth's length, back along the line

double blocked_m(const Obstacle& object, const SightLine& line, double along_m) {
  const Vector3d& near = line.neighbour->point_in_world;
  const Vector3d at = line.camera_in_world + along_m * line.direction;
  double most_m = taut_path_m(object, near, at) - std::max(line.cloth_m, (at - near).norm());
  for (int k = 0; k <= kSightSteps; ++k) {
    const Vector3d seen_through = at - 0.25 * k * line.cloth_m * line.direction;
    most_m = std::max(most_m, -distance_to(object, seen_through).value_or(0));
  }
  return std::max(most_m, 0.0);
}

}  // namespace

std::vector<SightLine> sight_lines_of(const Detections& detections, const Calibration& calibration,
                                      const std::string& set, const Sheet& sheet,
                                      double most_strain) {
  std::vector<SightLine> lines;
  const MarkLattice& lattice = detections.lattice;
  for (const MarkViews& mark : collect_views(detections, calibration, {}, set, 0)) {
    if (mark.views.size() != 1 || sheet.find(mark.mark) != nullptr) continue;
    const Camera& camera = mark.views.front().camera->camera;
    const auto ray = unproject(camera.model, mark.views.front().px);
    if (!ray) continue;
    const Vector3d direction = camera.cam_from_world.rotation.transpose() * ray->normalized();
    for (const MarkId step : {MarkId{1, 0}, MarkId{-1, 0}, MarkId{0, 1}, MarkId{0, -1}}) {
      const SheetMark* near = sheet.find({mark.mark.row + step.row, mark.mark.col + step.col});
      if (near == nullptr) continue;
      lines.push_back({mark.mark, centre_in_world(camera), direction, near,
                       lattice.pitch_m * (1 + most_strain)});
    }
  }
  return lines;
}

double shortfall_m(const Obstacle& object, const SightLine& line) {
  const Vector3d& near = line.neighbour->point_in_world;
  const double far_m = (1 + 0.25 * kSightSteps) * line.cloth_m;
  if (distance_to(object, near).value_or(1) > far_m) return 0;
  // The part of the line inside a ball of cloth around the neighbour; none: nothing is said.
  const Vector3d from = line.camera_in_world - near;
  const double middle_m = -from.dot(line.direction);
  const double half2 = line.cloth_m * line.cloth_m - from.squaredNorm() + middle_m * middle_m;
  if (half2 <= 0) return 0;
  const double half_m = std::sqrt(half2);
  double best_m = 1, best_at = middle_m;
  const auto try_at = [&](double along_m) {
    const double found_m = blocked_m(object, line, along_m);
    if (found_m >= best_m) return;
    best_m = found_m;
    best_at = along_m;
  };
  double step_m = 2 * half_m / (kPlaces - 1);
  for (int i = 0; i < kPlaces && best_m > 0; ++i) try_at(middle_m - half_m + i * step_m);
  for (int i = 0; i < kRefinements && best_m > 0; ++i) {
    step_m *= 0.6;
    const double here = best_at;
    try_at(std::max(here - step_m, middle_m - half_m));
    try_at(std::min(here + step_m, middle_m + half_m));
  }
  return best_m;
}

}  // namespace drape::triangulate
