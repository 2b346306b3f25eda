// SPDX-License-Identifier: Apache-2.0
// Coverage of stated 95 % intervals on real boards: two halves of the views are calibrated
// separately, and their difference is compared with the two stated covariances.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <string>
#include <vector>

#include "calib/joint.hpp"
#include "calib/test_real_boards.hpp"
#include "core/camera_model.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"

namespace drape {
namespace {

using namespace calib;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

/// Differences in stated standard deviations.
struct Coverage {
  int inside = 0, all = 0;
  double squares = 0;
  void add(double difference, double variance) {
    const double z = difference / std::sqrt(variance);
    inside += std::abs(z) <= 1.959964;
    squares += z * z;
    ++all;
  }
  [[nodiscard]] double percent() const { return all > 0 ? 100.0 * inside / all : 0; }
  [[nodiscard]] double rms() const { return all > 0 ? std::sqrt(squares / all) : 0; }
};

/// Pose of the second camera relative to the first, with covariance of rotation (rad), shift (mm).
struct RelativePose {
  Matrix3d rotation;
  Vector3d shift_mm;
  MatrixXd covariance;
};

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

RelativePose relative_pose(const Calibration& calibration) {
  const CamFromWorld &a = calibration.cameras[0].camera.cam_from_world,
                     &b = calibration.cameras[1].camera.cam_from_world;
  RelativePose out;
  out.rotation = b.rotation * a.rotation.transpose();
  const Vector3d moved = out.rotation * a.translation_m / units::mm;
  out.shift_mm = b.translation_m / units::mm - moved;
  const auto turn_by_vector = [](const Matrix3d& rotation) {
    const Eigen::AngleAxisd turn(rotation);
    return left_jacobian(turn.angle() * turn.axis());
  };
  // The rotation is that of b minus the rotated one of a; the shift depends on both.
  MatrixXd d = MatrixXd::Zero(6, 30);
  d.block<3, 3>(0, 9) = -out.rotation * turn_by_vector(a.rotation);
  d.block<3, 3>(0, 24) = turn_by_vector(b.rotation);
  d.bottomRows<3>() = cross(moved) * d.topRows<3>();
  d.block<3, 3>(3, 12) = -out.rotation;
  d.block<3, 3>(3, 27) += Matrix3d::Identity();
  out.covariance = d * calibration.joint_covariance * d.transpose();
  return out;
}

void compare(const Calibration& one, const Calibration& other, Coverage& inner, Coverage& pose) {
  for (std::size_t c = 0; c < one.cameras.size(); ++c) {
    const auto &a = std::get<BrownLens>(one.cameras[c].camera.model.lens),
               &b = std::get<BrownLens>(other.cameras[c].camera.model.lens);
    const double differences[] = {a.fx_px - b.fx_px, a.fy_px - b.fy_px, a.cx_px - b.cx_px,
                                  a.cy_px - b.cy_px};
    for (int i = 0; i < 4; ++i)
      inner.add(differences[i],
                one.cameras[c].covariance(i, i) + other.cameras[c].covariance(i, i));
  }
  if (one.cameras.size() < 2) return;
  const RelativePose a = relative_pose(one), b = relative_pose(other);
  const Eigen::AngleAxisd turn(a.rotation * b.rotation.transpose());
  Eigen::Matrix<double, 6, 1> difference;
  difference << turn.angle() * turn.axis(), a.shift_mm - b.shift_mm;
  for (int i = 0; i < 6; ++i) pose.add(difference[i], a.covariance(i, i) + b.covariance(i, i));
}

TEST(HalfSplit, StatedIntervalsHoldOnEveryRealBoard) {
  const int splits = test::trial_count(4, 16);
  int inside = 0, all = 0;
  std::vector<std::string> names(std::begin(test::real_boards), std::end(test::real_boards));
  names.emplace_back("sourishg-2");
  for (const std::string& name : names) {
    const test::RealBoard board = test::real_board(name);
    ASSERT_EQ(board.halves.size(), 16u);
    Coverage inner, pose;
    int flips = 0;
    for (int i = 0; i < splits; ++i) {
      const auto& [one, other] = board.halves[static_cast<std::size_t>(i)];
      JointResult results[2];
      for (int half = 0; half < 2; ++half) {
        Rig rig = board.rig;
        rig.free_poses = half == 0 ? one : other;
        results[half] = calibrate_joint(board.detections, rig, board.target, {});
        ASSERT_GT(results[half].calibration.joint_covariance.size(), 0) << name << " " << i;
      }
      flips += results[0].report.lens != results[1].report.lens;
      compare(results[0].calibration, results[1].calibration, inner, pose);
    }
    const double percent = 100.0 * (inner.inside + pose.inside) / (inner.all + pose.all);
    std::printf(
        "%-15s inside 95 %%: %5.1f %% of all; inner %5.1f %%, rms z %.2f; pose %5.1f %%, "
        "rms z %.2f; another lens in %d of %d\n",
        name.c_str(), percent, inner.percent(), inner.rms(), pose.percent(), pose.rms(), flips,
        splits);
    std::fflush(stdout);
    EXPECT_GE(percent, 88) << name;
    inside += inner.inside + pose.inside;
    all += inner.all + pose.all;
  }
  std::printf("all sets: %.1f %% of %d\n", 100.0 * inside / all, all);
  EXPECT_GE(100.0 * inside / all, 92);
}

}  // namespace
}  // namespace drape
