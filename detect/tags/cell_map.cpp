// SPDX-License-Identifier: Apache-2.0
#include "detect/tags/cell_map.hpp"

#include <Eigen/LU>
#include <cmath>

#include "detect/dots/local_map.hpp"

namespace drape::detect {
namespace {

constexpr double least_depth = 0.1;  // of a corner, against the first one's

/// Cubic from a to b whose ends run along the given tangents.
Eigen::Vector2d hermite(const Eigen::Vector2d& a, const Eigen::Vector2d& tangent_a,
                        const Eigen::Vector2d& b, const Eigen::Vector2d& tangent_b, double t) {
  const double s = 1 - t;
  return s * s * (1 + 2 * t) * a + t * t * (1 + 2 * s) * b + t * s * s * tangent_a -
         t * t * s * tangent_b;
}

}  // namespace

std::optional<CellMap> CellMap::flat(const std::array<Eigen::Vector2d, 4>& corners_px) {
  const auto& c = corners_px;
  const Eigen::Vector2d sum = c[0] - c[1] + c[2] - c[3];
  Eigen::Matrix2d sides;
  sides << c[1] - c[2], c[3] - c[2];
  if (std::abs(sides.determinant()) < 1e-9) return std::nullopt;
  CellMap map;
  const Eigen::Vector2d gh = sides.inverse() * sum;
  if (1 + gh.x() <= least_depth || 1 + gh.y() <= least_depth || 1 + gh.sum() <= least_depth) {
    return std::nullopt;
  }
  map.h_ << c[1] - c[0] + gh.x() * c[1], c[3] - c[0] + gh.y() * c[3], c[0];
  map.gh_ = gh;
  return map;
}

std::optional<CellMap> CellMap::bent(const std::array<Eigen::Vector2d, 4>& corners_px,
                                     const std::array<Eigen::Matrix2d, 4>& roots_px) {
  CellMap map;
  map.bent_ = true;
  map.corners_ = corners_px;
  const auto& c = corners_px;
  const std::array<Eigen::Vector2d, 2> along = {c[1] - c[0], c[2] - c[3]};   // upper, lower side
  const std::array<Eigen::Vector2d, 2> across = {c[3] - c[0], c[2] - c[1]};  // left, right side
  for (int k = 0; k < 4; ++k) {
    Eigen::Matrix2d rough;
    rough << along[k < 2 ? 0 : 1], across[k == 0 || k == 3 ? 0 : 1];
    if (!(std::abs(rough.determinant()) > 1e-9)) return std::nullopt;
    map.maps_[k] = turned_root(roots_px[k], rough);
  }
  return map;
}

Eigen::Vector2d CellMap::bent_at(double x, double y) const {
  const auto& c = corners_;
  const auto& m = maps_;
  const Eigen::Vector2d upper = hermite(c[0], m[0].col(0), c[1], m[1].col(0), x);
  const Eigen::Vector2d lower = hermite(c[3], m[3].col(0), c[2], m[2].col(0), x);
  const Eigen::Vector2d left = hermite(c[0], m[0].col(1), c[3], m[3].col(1), y);
  const Eigen::Vector2d right = hermite(c[1], m[1].col(1), c[2], m[2].col(1), y);
  return (1 - y) * upper + y * lower + (1 - x) * left + x * right - (1 - x) * (1 - y) * c[0] -
         x * (1 - y) * c[1] - x * y * c[2] - (1 - x) * y * c[3];
}

Eigen::Vector2d CellMap::operator()(const Eigen::Vector2d& at) const {
  if (bent_) return bent_at(at.x(), at.y());
  return h_ * Eigen::Vector3d(at.x(), at.y(), 1) / (gh_.dot(at) + 1);
}

}  // namespace drape::detect
