// SPDX-License-Identifier: Apache-2.0
#include "detect/local_map.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace drape {

std::optional<LocalMap> map_at_centre(const std::array<Eigen::Vector2d, 4>& print_m,
                                      const Eigen::Matrix<double, 2, 4>& corners_px,
                                      const Eigen::Vector2d& centre_m) {
  // Scaled print coordinates keep the 8x8 system well conditioned.
  const double scale_m = (print_m[0] - centre_m).norm();
  Eigen::Matrix<double, 8, 8> a = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d q = (print_m[k] - centre_m) / scale_m;
    const Eigen::Vector2d p = corners_px.col(k);
    a.row(2 * k) << q.x(), q.y(), 1, 0, 0, 0, -p.x() * q.x(), -p.x() * q.y();
    a.row(2 * k + 1) << 0, 0, 0, q.x(), q.y(), 1, -p.y() * q.x(), -p.y() * q.y();
    b.segment<2>(2 * k) = p;
  }
  const Eigen::FullPivLU<Eigen::Matrix<double, 8, 8>> solver(a);
  if (!solver.isInvertible()) return std::nullopt;
  const Eigen::Matrix<double, 8, 1> h = solver.solve(b);
  LocalMap map;
  map.centre_px = {h(2), h(5)};
  map.px_per_m << h(0) - h(2) * h(6), h(1) - h(2) * h(7), h(3) - h(5) * h(6), h(4) - h(5) * h(7);
  map.px_per_m /= scale_m;
  if (!map.px_per_m.allFinite()) return std::nullopt;
  return map;
}

LocalMap map_of_dot(const Eigen::Vector2d& centre_px, const Eigen::Matrix2d& shape_px2,
                    double dot_radius_m, const Eigen::Matrix2d& neighbour_px_per_m) {
  const Eigen::Matrix2d root =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(shape_px2).operatorSqrt() / dot_radius_m;
  // J = root * R * D: D mirrors when the print's frame is seen left-handed; |J - J_neighbour| is
  // least where trace(A^T root R) is largest, A = J_neighbour D.
  Eigen::Matrix2d mirror = Eigen::Matrix2d::Identity();
  if (neighbour_px_per_m.determinant() < 0) mirror(1, 1) = -1;
  const Eigen::Matrix2d b = (neighbour_px_per_m * mirror).transpose() * root;
  const double angle = std::atan2(b(0, 1) - b(1, 0), b(0, 0) + b(1, 1));
  Eigen::Matrix2d rotation;
  rotation << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  return {centre_px, root * rotation * mirror};
}

double step_error(const LocalMap& from, const LocalMap& to, const Eigen::Vector2d& step_m) {
  const Eigen::Vector2d predicted = 0.5 * (from.px_per_m + to.px_per_m) * step_m;
  const Eigen::Vector2d miss = to.centre_px - from.centre_px - predicted;
  // One step in any direction of the print, plus two pixels so that grazing views stay finite.
  const Eigen::Matrix2d unit =
      0.5 * step_m.squaredNorm() *
          (from.px_per_m * from.px_per_m.transpose() + to.px_per_m * to.px_per_m.transpose()) +
      4.0 * Eigen::Matrix2d::Identity();
  return std::sqrt(miss.dot(unit.inverse() * miss));
}

}  // namespace drape
