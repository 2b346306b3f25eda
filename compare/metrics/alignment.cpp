// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/alignment.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

namespace drape::compare {

std::optional<RigidAlignment> align(const std::vector<MarkError>& marks) {
  if (marks.size() < 3) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(marks.size());
  Eigen::Matrix3Xd real(3, n), simulated(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    real.col(i) = marks[static_cast<std::size_t>(i)].real_in_world;
    simulated.col(i) = marks[static_cast<std::size_t>(i)].virtual_in_world;
  }
  const Eigen::Vector3d from = real.rowwise().mean(), to = simulated.rowwise().mean();
  const Eigen::Matrix3d covariance =
      (simulated.colwise() - to) * (real.colwise() - from).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()(1) > 1e-9 * svd.singularValues()(0))) return std::nullopt;
  // A mirror image is no rigid move: the smallest axis is turned back.
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs.z() = -1;
  RigidAlignment result;
  result.rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  result.shift_m = to - result.rotation * from;
  result.turn_rad = Eigen::AngleAxisd(result.rotation).angle();
  result.centroid_shift_m = (to - from).norm();
  std::vector<MarkError> moved = marks;
  for (MarkError& mark : moved) {
    mark.real_in_world = result.rotation * mark.real_in_world + result.shift_m;
    mark.distance_m = (mark.real_in_world - mark.virtual_in_world).norm();
    mark.sigma_distance_m.reset();  // the marks' covariances would have to turn and to shrink too
  }
  result.after = statistics_of(moved);
  return result;
}

}  // namespace drape::compare
