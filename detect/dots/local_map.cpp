// SPDX-License-Identifier: Apache-2.0
#include "detect/dots/local_map.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace drape::detect {

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

Eigen::Matrix2d symmetric_root(const Eigen::Matrix2d& square) {
  // Cayley and Hamilton: root = (A + sqrt(det A) I) / sqrt(tr A + 2 sqrt(det A)).
  const double det = std::sqrt(std::max(0.0, square.determinant()));
  const double trace = std::sqrt(std::max(1e-300, square.trace() + 2 * det));
  return (square + det * Eigen::Matrix2d::Identity()) / trace;
}

Eigen::Matrix2d turned_root(const Eigen::Matrix2d& root_px_per_m,
                            const Eigen::Matrix2d& neighbour_px_per_m) {
  // J = root * R * D: D mirrors when the print's frame is seen left-handed; |J - J_neighbour| is
  // least where trace(A^T root R) is largest, A = J_neighbour D.
  Eigen::Matrix2d mirror = Eigen::Matrix2d::Identity();
  if (neighbour_px_per_m.determinant() < 0) mirror(1, 1) = -1;
  const Eigen::Matrix2d b = (neighbour_px_per_m * mirror).transpose() * root_px_per_m;
  const double sine = b(0, 1) - b(1, 0), cosine = b(0, 0) + b(1, 1);
  const double length = std::sqrt(sine * sine + cosine * cosine);
  if (length <= 0) return root_px_per_m * mirror;
  Eigen::Matrix2d rotation;
  rotation << cosine, -sine, sine, cosine;
  return root_px_per_m * (rotation / length) * mirror;
}

namespace {

/// Miss in units of one step in any direction of the print, plus two pixels so that grazing views
/// stay finite.
double in_steps(const Eigen::Vector2d& miss, const LocalMap& from, const LocalMap& to,
                const Eigen::Vector2d& step_m) {
  const Eigen::Matrix2d unit =
      0.5 * step_m.squaredNorm() *
          (from.px_per_m * from.px_per_m.transpose() + to.px_per_m * to.px_per_m.transpose()) +
      4.0 * Eigen::Matrix2d::Identity();
  return std::sqrt(miss.dot(unit.inverse() * miss));
}

}  // namespace

double step_error(const LocalMap& from, const LocalMap& to, const Eigen::Vector2d& step_m) {
  const Eigen::Vector2d predicted = 0.5 * (from.px_per_m + to.px_per_m) * step_m;
  return in_steps(to.centre_px - from.centre_px - predicted, from, to, step_m);
}

}  // namespace drape::detect
