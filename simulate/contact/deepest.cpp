// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/deepest.hpp"

#include <algorithm>
#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Tangents = Eigen::Matrix<double, 3, 2>;

constexpr double kNormalStep = 1e-7;  // m; for the curvature of a surface
constexpr double kSamePlane = 1e-12;  // of unit normals
constexpr int kDeepestSteps = 40;     // of Newton's method for a place
constexpr int kDeepestHalvings = 20;
constexpr double kDeepestSlope = 1e-13;  // m per piece; the place is found
constexpr int kFirstPlaces = 3;          // per direction, from which the search starts

std::array<double, 4> weights_at(const SheetPiece& piece, const Vector2d& s) {
  if (piece.corners == 2) return {1 - s[0], s[0], 0, 0};
  return {(1 - s[0]) * (1 - s[1]), (1 - s[0]) * s[1], s[0] * (1 - s[1]), s[0] * s[1]};
}

/// Derivatives of the weights by the place.
Eigen::Matrix<double, 4, 2> weight_slopes(const SheetPiece& piece, const Vector2d& s) {
  Eigen::Matrix<double, 4, 2> slopes = Eigen::Matrix<double, 4, 2>::Zero();
  if (piece.corners == 2) {
    slopes(0, 0) = -1;
    slopes(1, 0) = 1;
    return slopes;
  }
  slopes << -(1 - s[1]), -(1 - s[0]), -s[1], 1 - s[0], 1 - s[1], -s[0], s[1], s[0];
  return slopes;
}

Vector3d point_of(const SheetPiece& piece, const std::array<double, 4>& weight) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < piece.corners; ++k) sum += weight[k] * piece.at[k];
  return sum;
}

Tangents tangents_of(const SheetPiece& piece, const Vector2d& s) {
  const Eigen::Matrix<double, 4, 2> slopes = weight_slopes(piece, s);
  Tangents sum = Tangents::Zero();
  for (int k = 0; k < piece.corners; ++k) sum += piece.at[k] * slopes.row(k);
  return sum;
}

/// What makes up the depth of one piece in one shape.
struct Depth {
  const Surroundings& surroundings;
  int shape;
  const SheetPiece& piece;

  [[nodiscard]] double at(const Vector2d& s) const {
    const double off = (s - Vector2d(0.5, 0.5)).squaredNorm();
    return surroundings.gap_m(shape, point_of(piece, weights_at(piece, s))) +
           0.5 * DeepestPlace::steady_m * off;
  }
  [[nodiscard]] Vector2d slope(const Vector2d& s) const {
    const Vector3d normal = surroundings.normal(shape, point_of(piece, weights_at(piece, s)));
    return tangents_of(piece, s).transpose() * normal +
           DeepestPlace::steady_m * (s - Vector2d(0.5, 0.5));
  }
  [[nodiscard]] Matrix2d curvature(const Vector2d& s) const {
    const Vector3d p = point_of(piece, weights_at(piece, s));
    const Tangents along = tangents_of(piece, s);
    Matrix2d sum = along.transpose() * gap_curvature(surroundings, shape, p) * along +
                   DeepestPlace::steady_m * Matrix2d::Identity();
    if (piece.corners == 4) {
      const double twist =
          surroundings.normal(shape, p).dot(piece.at[0] - piece.at[1] - piece.at[2] + piece.at[3]);
      sum(0, 1) += twist;
      sum(1, 0) += twist;
    }
    return sum;
  }
};

/// Directions in which the place can move: not across a border that it is pressed to.
std::array<bool, 2> free_directions(const SheetPiece& piece, const Vector2d& s,
                                    const Vector2d& slope) {
  std::array<bool, 2> is_free{};
  for (int k = 0; k < piece.corners / 2; ++k)
    is_free[k] = !(s[k] <= 0 && slope[k] > 0) && !(s[k] >= 1 && slope[k] < 0);
  return is_free;
}

/// Inverse of the positive definite part of `matrix` over the free directions, zero elsewhere.
Matrix2d inverse_over(const std::array<bool, 2>& is_free, const Matrix2d& matrix) {
  Matrix2d inverse = Matrix2d::Zero();
  if (is_free[0] && is_free[1]) {
    const double half = 0.5 * (matrix(0, 0) + matrix(1, 1));
    const double spread =
        std::hypot(0.5 * (matrix(0, 0) - matrix(1, 1)), 0.5 * (matrix(0, 1) + matrix(1, 0)));
    const double lift = std::max(0.0, DeepestPlace::steady_m - (half - spread));
    return (matrix + lift * Matrix2d::Identity()).inverse();
  }
  for (int k = 0; k < 2; ++k) {
    if (is_free[k]) inverse(k, k) = 1 / std::max(matrix(k, k), DeepestPlace::steady_m);
  }
  return inverse;
}

Vector2d first_place(const Depth& depth) {
  const int across = depth.piece.corners == 2 ? 1 : kFirstPlaces;
  Vector2d best(0.5, 0.5);
  double least = depth.at(best);
  for (int k = 0; k < kFirstPlaces; ++k) {
    for (int l = 0; l < across; ++l) {
      const Vector2d s((k + 0.5) / kFirstPlaces, (l + 0.5) / across);
      const double here = depth.at(s);
      if (!(here < least)) continue;
      least = here;
      best = s;
    }
  }
  return best;
}

}  // namespace

Matrix3d gap_curvature(const Surroundings& surroundings, int shape, const Vector3d& p) {
  Matrix3d sum;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kNormalStep * Vector3d::Unit(axis);
    sum.col(axis) = (surroundings.normal(shape, p + step) - surroundings.normal(shape, p - step)) /
                    (2 * kNormalStep);
  }
  return 0.5 * (sum + sum.transpose());
}

bool is_seen_flat(const Surroundings& surroundings, int shape, const SheetPiece& piece) {
  if (!surroundings.is_convex(shape)) return false;
  const Vector3d first = surroundings.normal(shape, piece.at[0]);
  for (int k = 1; k < piece.corners; ++k) {
    if ((surroundings.normal(shape, piece.at[k]) - first).norm() > kSamePlane) return false;
  }
  return true;
}

/// Newton's method within the borders, by steps that lower the depth.
DeepestPlace deepest_place(const Surroundings& surroundings, int shape, const SheetPiece& piece) {
  const Depth depth{surroundings, shape, piece};
  Vector2d s = first_place(depth);
  double here = depth.at(s);
  for (int step = 0; step < kDeepestSteps; ++step) {
    const Vector2d slope = depth.slope(s);
    const std::array<bool, 2> is_free = free_directions(piece, s, slope);
    const Vector2d active(is_free[0] ? slope[0] : 0, is_free[1] ? slope[1] : 0);
    if (active.norm() < kDeepestSlope) break;
    const Vector2d way = -inverse_over(is_free, depth.curvature(s)) * active;
    double share = 1;
    bool lower = false;
    for (int halving = 0; halving < kDeepestHalvings && !lower; ++halving, share *= 0.5) {
      const Vector2d to = (s + share * way).cwiseMax(0.0).cwiseMin(1.0);
      const double there = depth.at(to);
      // The last digits of a gap cannot judge a step near the end.
      lower = there < here || (there <= here + 1e-17 && depth.slope(to).norm() < active.norm());
      if (!lower) continue;
      s = to;
      here = there;
    }
    if (!lower) break;
  }
  DeepestPlace found;

  found.place = s;
  found.weight = weights_at(piece, s);
  const Vector3d p = point_of(piece, found.weight);
  found.depth_m = here;
  found.gap_m = surroundings.gap_m(shape, p);
  found.normal = surroundings.normal(shape, p);
  return found;
}

DepthCurvature depth_curvature(const Surroundings& surroundings, int shape, const SheetPiece& piece,
                               const DeepestPlace& deepest) {
  const Depth depth{surroundings, shape, piece};
  const Vector2d& s = deepest.place;
  const Matrix3d bend = gap_curvature(surroundings, shape, point_of(piece, deepest.weight));
  const Tangents along = tangents_of(piece, s);
  const Eigen::Matrix<double, 4, 2> slopes = weight_slopes(piece, s);
  Eigen::Matrix<double, 12, 2> mixed = Eigen::Matrix<double, 12, 2>::Zero();
  DepthCurvature sum;
  for (int k = 0; k < piece.corners; ++k) {
    mixed.block<3, 2>(3 * k, 0) = deepest.normal * slopes.row(k) + deepest.weight[k] * bend * along;
    for (int l = 0; l < piece.corners; ++l)
      sum.bends.block<3, 3>(3 * k, 3 * l) = -deepest.weight[k] * deepest.weight[l] * bend;
  }
  const std::array<bool, 2> is_free = free_directions(piece, s, depth.slope(s));
  sum.slides = mixed * inverse_over(is_free, depth.curvature(s)) * mixed.transpose();
  return sum;
}

}  // namespace drape::simulate
