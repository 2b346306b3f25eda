// SPDX-License-Identifier: Apache-2.0
#include "calib/tsai/eccentricity.hpp"

#include <algorithm>

#include "core/dot_image.hpp"

namespace drape::calib {

std::vector<Correspondence> without_eccentricity(const std::vector<Correspondence>& points,
                                                 const Camera& camera, double dot_diameter_m) {
  std::vector<Correspondence> corrected = points;
  const Eigen::Matrix3d& rotation = camera.cam_from_world.rotation;
  for (Correspondence& point : corrected) {
    if (const auto off =
            eccentricity_px(camera.model, {camera.cam_from_world * point.point_in_world,
                                           rotation.col(0), rotation.col(1), dot_diameter_m / 2}))
      point.px -= *off;
  }
  return corrected;
}

double largest_shift_px(const std::vector<Correspondence>& a,
                        const std::vector<Correspondence>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, (a[i].px - b[i].px).norm());
  return largest;
}

}  // namespace drape::calib
