// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/alignment.hpp"

#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"

namespace drape::compare {

std::optional<RigidAlignment> align(const std::vector<MarkError>& marks) {
  const auto n = static_cast<Eigen::Index>(marks.size());
  Eigen::Matrix3Xd real(3, n), simulated(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    real.col(i) = marks[static_cast<std::size_t>(i)].real_in_world;
    simulated.col(i) = marks[static_cast<std::size_t>(i)].virtual_in_world;
  }
  const auto motion = rigid_motion(real, simulated);
  if (!motion) return std::nullopt;
  RigidAlignment result;
  result.rotation = motion->rotation;
  result.shift_m = motion->translation_m;
  result.turn_rad = rotation_vector(motion->rotation).norm();
  result.centroid_shift_m = (simulated.rowwise().mean() - real.rowwise().mean()).norm();
  std::vector<MarkError> moved = marks;
  for (MarkError& mark : moved) {
    mark.real_in_world = result.rotation * mark.real_in_world + result.shift_m;
    mark.distance_m = (mark.real_in_world - mark.virtual_in_world).norm();
    mark.sigma_distance_m.reset();  // the covariances would need to be rotated and reduced too
  }
  result.after = statistics_of(moved);
  return result;
}

}  // namespace drape::compare
