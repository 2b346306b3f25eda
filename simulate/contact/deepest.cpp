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

constexpr double kNormalStep = 1e-7;  // m; for the curvature of a surface
constexpr double kSamePlane = 1e-12;  // relative to unit normals
constexpr int kDeepestSteps = 60;     // steps of Newton's method for a place
constexpr int kDeepestHalvings = 20;
constexpr double kDeepestSlope = 1e-13;  // m per weight; the place is found
constexpr double kDepthDigits = 1e-17;   // m; a smaller change of the depth is its rounding

Vector3d point_of(const SheetTriangle& triangle, const Vector3d& weights) {
  return weights[0] * triangle[0] + weights[1] * triangle[1] + weights[2] * triangle[2];
}

/// The face of the triangle about a place, by its corners: a border or corner that the place does
/// not leave has fewer than three.
struct Face {
  std::array<int, 3> corner{};
  int corners = 0;

  void add(int k) { corner[corners++] = k; }
  [[nodiscard]] int directions() const { return corners - 1; }
};

/// Terms of the depth of one triangle in one shape.
struct Depth {
  const Surroundings& surroundings;
  int shape;
  const SheetTriangle& triangle;

  [[nodiscard]] static Vector3d off_middle(const Vector3d& weights) {
    return (weights.array() - 1.0 / 3).matrix();
  }
  [[nodiscard]] double at(const Vector3d& weights) const {
    return surroundings.gap_m(shape, point_of(triangle, weights)) +
           0.5 * DeepestPlace::steady_m * off_middle(weights).squaredNorm();
  }
  /// By each weight, as if they were free.
  [[nodiscard]] Vector3d slope(const Vector3d& weights) const {
    const Vector3d normal = surroundings.normal(shape, point_of(triangle, weights));
    return Vector3d(triangle[0].dot(normal), triangle[1].dot(normal), triangle[2].dot(normal)) +
           DeepestPlace::steady_m * off_middle(weights);
  }
  /// Inverse of the second derivative over a face: its directions lead from its first corner to
  /// each other one. Positive definite also where the object is not convex.
  [[nodiscard]] Matrix2d inverse_over(const Face& face, const Vector3d& weights) const {
    const Matrix3d bend = gap_curvature(surroundings, shape, point_of(triangle, weights));
    Matrix2d sum = Matrix2d::Identity();
    for (int i = 0; i < face.directions(); ++i) {
      for (int j = 0; j < face.directions(); ++j) {
        const Vector3d a = triangle[face.corner[i + 1]] - triangle[face.corner[0]];
        const Vector3d b = triangle[face.corner[j + 1]] - triangle[face.corner[0]];
        sum(i, j) = a.dot(bend * b) + DeepestPlace::steady_m * (i == j ? 2 : 1);
      }
    }
    if (face.directions() < 2) {
      sum(0, 0) = std::max(sum(0, 0), DeepestPlace::steady_m);
    } else {
      const double half = 0.5 * (sum(0, 0) + sum(1, 1));
      const double spread =
          std::hypot(0.5 * (sum(0, 0) - sum(1, 1)), 0.5 * (sum(0, 1) + sum(1, 0)));
      const double lift = std::max(0.0, DeepestPlace::steady_m - (half - spread));
      sum += lift * Matrix2d::Identity();
    }
    return sum.inverse();
  }
  /// Newton's step of the weights within a face.
  [[nodiscard]] Vector3d newton_step(const Face& face, const Vector3d& weights,
                                     const Vector3d& slope_here) const {
    Vector3d result = Vector3d::Zero();
    if (face.directions() < 1) return result;
    Vector2d along = Vector2d::Zero();
    for (int i = 0; i < face.directions(); ++i)
      along[i] = slope_here[face.corner[i + 1]] - slope_here[face.corner[0]];
    const Vector2d step = -inverse_over(face, weights) * along;
    for (int i = 0; i < face.directions(); ++i) {
      result[face.corner[i + 1]] += step[i];
      result[face.corner[0]] -= step[i];
    }
    return result;
  }
};

/// The corners that take part, and those that would lower the depth by taking part.
Face open_face(const Vector3d& weights, const Vector3d& slope) {
  const double mean = weights.dot(slope);
  Face face;
  for (int k = 0; k < 3; ++k) {
    if (weights[k] > 0 || slope[k] < mean - kDeepestSlope) face.add(k);
  }
  return face;
}

double steepest_over(const Face& face, const Vector3d& slope) {
  double most = 0;
  for (int k = 1; k < face.corners; ++k)
    most = std::max(most, std::abs(slope[face.corner[k]] - slope[face.corner[0]]));
  return most;
}

/// Without corners that have no weight and would get a negative one.
Face without_blocked(const Face& face, const Vector3d& weights, const Vector3d& move) {
  Face left;
  for (int k = 0; k < face.corners; ++k) {
    if (weights[face.corner[k]] > 0 || move[face.corner[k]] > 0) left.add(face.corner[k]);
  }
  return left;
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

bool is_seen_flat(const Surroundings& surroundings, int shape, std::span<const Vector3d> corners) {
  if (!surroundings.is_convex(shape)) return false;
  const Vector3d first = surroundings.normal(shape, corners.front());
  return std::all_of(corners.begin() + 1, corners.end(), [&](const Vector3d& corner) {
    return (surroundings.normal(shape, corner) - first).norm() <= kSamePlane;
  });
}

/// Newton's method within the triangle, by steps that lower the depth.
DeepestPlace deepest_place(const Surroundings& surroundings, int shape,
                           const SheetTriangle& triangle) {
  const Depth depth{surroundings, shape, triangle};
  DeepestPlace found;
  Vector3d& weights = found.weights;
  double here = depth.at(weights);
  for (int step = 0; step < kDeepestSteps; ++step) {
    const Vector3d slope = depth.slope(weights);
    const Face face = open_face(weights, slope);
    const double steepest = steepest_over(face, slope);
    if (steepest < kDeepestSlope) break;
    Vector3d move = depth.newton_step(face, weights, slope);
    const Face left = without_blocked(face, weights, move);
    if (left.corners < face.corners) move = depth.newton_step(left, weights, slope);
    if (move.isZero(0)) break;
    double most = 1;
    for (int k = 0; k < 3; ++k) {
      if (move[k] < 0) most = std::min(most, -weights[k] / move[k]);
    }
    bool lower = false;
    double part = most;
    for (int halving = 0; halving < kDeepestHalvings && !lower; ++halving, part *= 0.5) {
      Vector3d to = weights + part * move;
      for (int k = 0; k < 3; ++k) {
        // Exactly at the border where the step ends there.
        if (halving == 0 && move[k] < 0 && weights[k] + most * move[k] < 1e-15) to[k] = 0;
      }
      to = to.cwiseMax(0.0);
      to /= to.sum();
      const double there = depth.at(to);
      // The last digits of a depth cannot judge a step near the end.
      lower = there < here ||
              (there <= here + kDepthDigits && steepest_over(face, depth.slope(to)) < steepest);
      if (!lower) continue;
      weights = to;
      here = there;
    }
    if (!lower) break;
  }
  const Vector3d p = point_of(triangle, weights);
  found.depth_m = here;
  found.gap_m = surroundings.gap_m(shape, p);
  found.normal = surroundings.normal(shape, p);
  return found;
}

DepthCurvature depth_curvature(const Surroundings& surroundings, int shape,
                               const SheetTriangle& triangle, const DeepestPlace& deepest) {
  const Depth depth{surroundings, shape, triangle};
  const Matrix3d bend = gap_curvature(surroundings, shape, point_of(triangle, deepest.weights));
  const Face face = open_face(deepest.weights, depth.slope(deepest.weights));
  DepthCurvature sum;
  Eigen::Matrix<double, 9, 2> mixed = Eigen::Matrix<double, 9, 2>::Zero();
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < face.directions(); ++i) {
      const int to = face.corner[i + 1], from = face.corner[0];
      mixed.block<3, 1>(3 * k, i) = ((k == to) - (k == from)) * deepest.normal +
                                    deepest.weights[k] * bend * (triangle[to] - triangle[from]);
    }
    for (int l = 0; l < 3; ++l)
      sum.bends.block<3, 3>(3 * k, 3 * l) = -deepest.weights[k] * deepest.weights[l] * bend;
  }
  if (face.directions() > 0)
    sum.slides = mixed * depth.inverse_over(face, deepest.weights) * mixed.transpose();
  return sum;
}

}  // namespace drape::simulate
