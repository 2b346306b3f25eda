// SPDX-License-Identifier: Apache-2.0
// Properties that hold for every camera and pose, tested with random ones.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>

#include "core/camera_model.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using units::mm;

/// Gives the same cases in every run. A property with an argument is tried more than once.
const int kSeeded = ::setenv("RC_PARAMS", "seed=1 max_success=1000", 0);

/// A number in the interval, one of a million equally spaced ones.
double between(double low, double high) {
  return low + (high - low) * *rc::gen::inRange(0, 1000001) / 1e6;
}

CameraModel any_brown() {
  const double f = between(600, 4000);
  return {BrownLens{f, f * between(0.98, 1.02), between(700, 900), between(500, 700),
                    between(-0.3, 0.3), between(-0.05, 0.05), between(-1e-3, 1e-3),
                    between(-1e-3, 1e-3), between(-0.01, 0.01)},
          1600, 1200};
}

CameraModel any_tsai() {
  return {TsaiLens{between(5, 30) * mm, between(-1000, 2000), between(700, 900), between(500, 700),
                   between(0.99, 1.01), 3.45e-6, 3.45e-6},
          1600, 1200};
}

Eigen::Vector3d any_point() {
  const double z = between(0.3, 3);
  return {z * between(-0.25, 0.25), z * between(-0.2, 0.2), z};
}

CamFromWorld any_pose() {
  const Eigen::Vector3d axis(between(-1, 1), between(-1, 1), between(-1, 1));
  const Eigen::Matrix3d rotation =
      axis.norm() > 1e-6 ? Eigen::AngleAxisd(between(-3, 3), axis.normalized()).toRotationMatrix()
                         : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  return {rotation, {between(-1, 1), between(-1, 1), between(-1, 1)}};
}

void round_trip(const CameraModel& model) {
  const auto image = project(model, any_point());
  RC_PRE(image.has_value());
  const auto ray = unproject(model, image->px);
  RC_ASSERT(ray.has_value());
  RC_ASSERT(std::abs(ray->norm() - 1) < 1e-12);
  const auto again = project(model, *ray * between(0.1, 10));
  RC_ASSERT(again.has_value());
  RC_ASSERT((again->px - image->px).norm() < 1e-9);
}

RC_GTEST_PROP(CameraProperty, BrownRayLandsOnItsPixelWithin1e9, (int)) {
  round_trip(any_brown());
}

RC_GTEST_PROP(CameraProperty, TsaiRayLandsOnItsPixelWithin1e9, (int)) {
  round_trip(any_tsai());
}

RC_GTEST_PROP(CameraProperty, BrownPointLiesOnItsRay, (int)) {
  const CameraModel model = any_brown();
  const Eigen::Vector3d point = any_point();
  const auto image = project(model, point);
  RC_PRE(image.has_value());
  RC_ASSERT(unproject(model, image->px)->cross(point.normalized()).norm() < 1e-11);
}

RC_GTEST_PROP(CameraProperty, TsaiRefusesWhatLiesBeyondItsMonotonicLimit, (int)) {
  const double kappa = -between(100, 5000), f = between(5, 30) * mm;
  const CameraModel model{TsaiLens{f, kappa, 800, 600, 1, 3.45e-6, 3.45e-6}, 1600, 1200};
  // The undistorted radius r + kappa r^3 is largest at r = sqrt(-1 / (3 kappa)).
  const double limit = 2.0 / 3.0 * std::sqrt(-1 / (3 * kappa));
  const double fraction = between(0.5, 1.5), turn = between(0, 6.28), z = between(0.3, 3);
  RC_PRE(std::abs(fraction - 1) > 1e-9);
  const Eigen::Vector2d undistorted =
      fraction * limit * Eigen::Vector2d(std::cos(turn), std::sin(turn));
  const auto image =
      project(model, Eigen::Vector3d(undistorted.x() / f, undistorted.y() / f, 1) * z);
  RC_ASSERT(image.has_value() == (fraction < 1));
  const double distorted = fraction * std::sqrt(-1 / (3 * kappa));
  const Eigen::Vector2d px(800 + distorted * std::cos(turn) / 3.45e-6,
                           600 + distorted * std::sin(turn) / 3.45e-6);
  RC_ASSERT(unproject(model, px).has_value() == (fraction < 1));
}

RC_GTEST_PROP(CameraProperty, NothingBehindTheCameraHasAnImage, (int)) {
  Eigen::Vector3d point = any_point();
  point.z() = -point.z();
  RC_ASSERT(!project(any_brown(), point).has_value());
  RC_ASSERT(!project(any_tsai(), point).has_value());
}

RC_GTEST_PROP(PoseProperty, InverseUndoesAndCompositionChains, (int)) {
  const CamFromWorld a = any_pose(), b_like = any_pose();
  const WorldFromTarget b{b_like.rotation, b_like.translation_m};
  const Eigen::Vector3d point(between(-1, 1), between(-1, 1), between(-1, 1));
  RC_ASSERT((a.inverse() * (a * point) - point).norm() < 1e-13);
  RC_ASSERT(((a * b) * point - a * (b * point)).norm() < 1e-13);
  const auto both = (a * b).inverse(), one_by_one = b.inverse() * a.inverse();
  RC_ASSERT((both.rotation - one_by_one.rotation).norm() < 1e-13);
  RC_ASSERT((both.translation_m - one_by_one.translation_m).norm() < 1e-13);
  RC_ASSERT(std::abs((a * point - a * Eigen::Vector3d::Zero()).norm() - point.norm()) < 1e-13);
}

}  // namespace
}  // namespace drape::calib
