// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <cmath>
#include <random>

#include "calib/joint/fit.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::test {

using namespace calib;

/// Six smooth orthogonal shapes at the points of a frame, each with mean square 1 (n x 6).
inline Eigen::MatrixXd smooth_shapes(const JointFrame& frame) {
  const auto points = static_cast<Eigen::Index>(frame.points.size());
  Eigen::MatrixXd shapes(points, 6);
  double reach_m = 0;
  for (const TargetPoint& point : frame.points)
    reach_m = std::max(reach_m, point.point_in_target.head<2>().cwiseAbs().maxCoeff());
  for (Eigen::Index i = 0; i < points; ++i) {
    const Eigen::Vector2d at =
        frame.points[static_cast<std::size_t>(i)].point_in_target.head<2>() / reach_m;
    shapes.row(i) << 1, at.x(), at.y(), at.x() * at.x(), at.x() * at.y(), at.y() * at.y();
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factor(shapes);
  const Eigen::Index rank = factor.rank();
  const Eigen::MatrixXd first = Eigen::MatrixXd::Identity(points, rank);
  return std::sqrt(static_cast<double>(points)) * (factor.householderQ() * first);
}

/// Adds an error common to all points of a frame: a quadratic function of position, in u and v.
inline void disturb(JointFrame& frame, double sd_px, std::mt19937& random) {
  std::normal_distribution<double> normal(0, sd_px);
  const Eigen::MatrixXd shapes = smooth_shapes(frame);
  for (int axis = 0; axis < 2; ++axis) {
    Eigen::VectorXd error = Eigen::VectorXd::Zero(shapes.rows());
    for (Eigen::Index i = 0; i < shapes.cols(); ++i) error += normal(random) * shapes.col(i);
    for (std::size_t i = 0; i < frame.points.size(); ++i)
      frame.points[i].measured_px[axis] += error[static_cast<Eigen::Index>(i)];
  }
}

/// Fills the model's frames with all 12 x 9 points as its cameras see its placements.
inline void see(JointModel& model, double noise_px, unsigned seed, double common_part = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  model.frames.clear();
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    for (std::size_t c = 0; c < model.cameras.size(); ++c) {
      JointFrame frame{c, p, {}};
      for (int dot = 0; dot < 108; ++dot) {
        const int row = dot / 12, col = dot % 12;
        const Eigen::Vector3d flat((col - 5.5) * 0.02, (row - 4) * 0.02, 0);
        const auto px = pixel_of(model.cameras[c], model.placements[p], model.board, flat);
        if (!px) continue;
        frame.points.push_back({{row, col},
                                flat,
                                *px + Eigen::Vector2d(noise(random), noise(random)),
                                noise_px * noise_px * Eigen::Matrix2d::Identity()});
      }
      if (common_part > 0) disturb(frame, common_part * noise_px, random);
      model.frames.push_back(frame);
    }
  }
}

/// The same views without the values of cameras, free placements and bow.
inline JointModel forgotten(const JointModel& model) {
  JointModel views = model;
  views.board.edge_rise_mm.setZero();
  for (JointCamera& camera : views.cameras) {
    camera.camera.model.lens = BrownLens{};
    camera.camera.cam_from_world = {};
  }
  for (Placement& placement : views.placements) {
    if (!placement.known) placement.world_from_target = {};
  }
  return views;
}

/// An invented bench: three cameras on a cone, and a bent target in its reference pose, raised, and
/// in free poses. Everything follows from the seed.
class SyntheticBench {
 public:
  explicit SyntheticBench(unsigned seed, int free_poses = 8, double noise_px = 0.05,
                          double common_part = 0)
      : random_(seed) {
    model_.board.half_m = {0.11, 0.08};
    model_.board.mean = {0.394, 0.417};  // mean of 12 and of 9 equally spaced points
    model_.board.edge_rise_mm = {number(-0.1, 0.1), number(-0.1, 0.1)};
    for (int i = 0; i < 3; ++i) model_.cameras.push_back(camera(i));
    for (const double z_m : {0.0, 0.06}) {
      Placement stage{"stage" + std::to_string(model_.placements.size()), {}, true};
      stage.world_from_target.translation_m.z() = z_m;
      model_.placements.push_back(stage);
    }
    for (int i = 0; i < free_poses; ++i) model_.placements.push_back(free_pose(i));
    see(model_, noise_px, seed + 1000, common_part);
  }

  [[nodiscard]] const JointModel& true_model() const { return model_; }

  /// Views of the cameras, without the values of cameras and placements.
  [[nodiscard]] JointModel noisy_views() const { return forgotten(model_); }

 private:
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  JointCamera camera(int index) {
    const double turn = (index * 120 + number(-20, 20)) * units::deg;
    const double tilt = number(30, 40) * units::deg, distance = number(0.7, 0.85);
    const Eigen::Vector3d centre =
        distance * Eigen::Vector3d(std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn),
                                   std::cos(tilt));
    const Eigen::Vector3d forward = (Eigen::Vector3d(0, 0, 0.03) - centre).normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    JointCamera result;
    result.camera.name = "cam" + std::to_string(index);
    CamFromWorld& pose = result.camera.cam_from_world;
    pose.rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    pose.translation_m = -(pose.rotation * centre);
    const double f = number(2600, 3000);
    result.camera.model = {
        BrownLens{f, f * number(0.999, 1.001), number(785, 815), number(585, 615),
                  number(-0.2, -0.05), number(-0.05, 0.05), 0, 0, 0},
        1600, 1200};
    return result;
  }

  Placement free_pose(int index) {
    Placement pose{"pose" + std::to_string(index), {}, false};
    const double about = number(0, 2 * 3.14159265);
    const Eigen::Vector3d axis(std::cos(about), std::sin(about), 0);
    pose.world_from_target.rotation = rotation_about(number(15, 35) * units::deg * axis) *
                                      rotation_about(number(-0.5, 0.5) * Eigen::Vector3d::UnitZ());
    pose.world_from_target.translation_m = {number(-0.03, 0.03), number(-0.03, 0.03),
                                            number(0.0, 0.08)};
    return pose;
  }

  std::mt19937 random_;
  JointModel model_;
};

}  // namespace drape::test
