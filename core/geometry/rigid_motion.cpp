// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/rigid_motion.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace drape {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

using Svd = Eigen::JacobiSVD<Matrix3d>;

/// Rotation of an SVD. A reflection is avoided by flipping the axis of the smallest singular value.
Matrix3d rotation_of(const Svd& svd) {
  const bool mirrors = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0;
  return svd.matrixU() * Vector3d(1, 1, mirrors ? -1 : 1).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

Matrix3d nearest_rotation(const Matrix3d& matrix) {
  return rotation_of(Svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV));
}

std::optional<Pose<void, void>> rigid_motion(const Eigen::Matrix3Xd& from,
                                             const Eigen::Matrix3Xd& to) {
  if (from.cols() < 3) return std::nullopt;
  const Vector3d middle_from = from.rowwise().mean(), middle_to = to.rowwise().mean();
  const Matrix3d products = (to.colwise() - middle_to) * (from.colwise() - middle_from).transpose();
  const Svd svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()(1) > 1e-9 * svd.singularValues()(0))) return std::nullopt;
  const Matrix3d rotation = rotation_of(svd);
  return Pose<void, void>{rotation, middle_to - rotation * middle_from};
}

}  // namespace drape
