// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/vectors.hpp"

#include <Eigen/Geometry>

namespace drape {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double signed_area(const std::vector<Eigen::Vector2d>& polygon) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    sum += cross(polygon[i], polygon[(i + 1) % polygon.size()]) / 2;
  return sum;
}

Matrix3d cross_matrix(const Vector3d& v) {
  return (Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

Matrix3d rotation_about(const Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix()
                   : Matrix3d::Identity();
}

Vector3d rotation_vector(const Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

}  // namespace drape
