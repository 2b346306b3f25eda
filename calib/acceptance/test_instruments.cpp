// SPDX-License-Identifier: Apache-2.0
// Simulated instruments: joint makes the calibration, other sets test it. If OpenCV's calib3d is
// installed, it computes all images.
#include "calib/acceptance/test_instruments.hpp"

#include <Eigen/Geometry>
#include <optional>
#include <random>

#include "calib/joint/start.hpp"
#include "calib/test_rigs.hpp"
#include "core/units.hpp"

#ifdef DRAPE_HAS_OPENCV_CALIB3D
#include <opencv2/calib3d.hpp>
#endif

namespace drape::calib {
namespace {

using units::mm;

std::optional<Eigen::Vector2d> image_by_another(const JointCamera& seen_by,
                                                const Eigen::Vector3d& in_camera) {
#ifdef DRAPE_HAS_OPENCV_CALIB3D
  const auto& lens = std::get<BrownLens>(seen_by.camera.model.lens);
  const cv::Matx33d k(lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1);
  const cv::Vec<double, 5> distortion(lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
  std::vector<cv::Point2d> px;
  cv::projectPoints(std::vector<cv::Point3d>{{in_camera.x(), in_camera.y(), in_camera.z()}},
                    cv::Vec3d(), cv::Vec3d(), k, distortion, px);
  return Eigen::Vector2d(px[0].x, px[0].y);
#else
  const auto image = project(seen_by.camera.model, in_camera);
  if (!image) return std::nullopt;
  return image->px;
#endif
}

/// Frames of all placements by an independent projection; errors of a view's points are partly
/// common.
void see_by_another(JointModel& model, double noise_px, double common_part, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  model.frames.clear();
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    for (std::size_t c = 0; c < model.cameras.size(); ++c) {
      JointFrame frame{c, p, {}};
      for (int dot = 0; dot < 108; ++dot) {
        const int row = dot / 12, col = dot % 12;
        const Eigen::Vector3d flat((col - 5.5) * 0.02, (row - 4) * 0.02, 0);
        const auto px = image_by_another(
            model.cameras[c], model.cameras[c].camera.cam_from_world *
                                  (model.placements[p].world_from_target * model.board.bent(flat)));
        if (!px) continue;
        frame.points.push_back({{row, col},
                                flat,
                                *px + Eigen::Vector2d(noise(random), noise(random)),
                                noise_px * noise_px * Eigen::Matrix2d::Identity()});
      }
      if (common_part > 0) test::disturb(frame, common_part * noise_px, random);
      model.frames.push_back(frame);
    }
  }
}

Detections detections_of(const JointModel& model) {
  Detections detections;
  const Target target = target_of_tests();
  detections.lattice.surface = Surface::target;
  detections.lattice.rows = target.rows;
  detections.lattice.cols = target.cols;
  detections.lattice.pitch_m = target.pitch_m;
  for (const JointFrame& frame : model.frames) {
    FrameDetections one;
    one.set = model.placements[frame.placement].set;
    one.camera = model.cameras[frame.camera].camera.name;
    one.width_px = model.cameras[frame.camera].camera.model.width_px;
    one.height_px = model.cameras[frame.camera].camera.model.height_px;
    for (const TargetPoint& point : frame.points) {
      Detection d;
      d.mark = point.dot;
      d.centre_px = point.measured_px;
      d.covariance_px2 = point.covariance_px2;
      d.semi_axes_px.setConstant(5);
      one.detections.push_back(d);
    }
    detections.frames.push_back(one);
  }
  return detections;
}

/// Marks on a ball of 80 mm that at least one camera sees at less than 60 degrees.
SphereInput ball_of(const std::vector<JointCamera>& cameras, double noise_px, unsigned seed) {
  SphereInput sphere;
  sphere.diameter_mm = 80;
  sphere.standard_uncertainty_mm = 0.002;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_px);
  const double radius = 40 * mm * (1 + 0.002 / 80 * std::normal_distribution<double>()(random));
  const Eigen::Vector3d middle(0.004, -0.006, 0.02);
  for (const JointCamera& camera : cameras) {
    FrameDetections frame;
    frame.set = "ball";
    frame.camera = camera.camera.name;
    for (int row = 0; row < 13; ++row) {
      for (int col = 0; col < 13; ++col) {
        const Eigen::Vector2d angle = Eigen::Vector2d(row - 6, col - 6) * 0.16;
        const Eigen::Vector3d up =
            Eigen::Vector3d(std::sin(angle.x()), std::cos(angle.x()) * std::sin(angle.y()),
                            std::cos(angle.x()) * std::cos(angle.y()));
        const Eigen::Vector3d at = middle + radius * up;
        if ((centre_in_world(camera.camera) - at).normalized().dot(up) < 0.5) continue;
        const auto px = image_by_another(camera, camera.camera.cam_from_world * at);
        if (!px) continue;
        Detection d;
        d.mark = {row, col};
        d.centre_px = *px + Eigen::Vector2d(noise(random), noise(random));
        d.covariance_px2 = noise_px * noise_px * Eigen::Matrix2d::Identity();
        d.semi_axes_px.setConstant(5);
        frame.detections.push_back(d);
      }
    }
    sphere.marks.frames.push_back(frame);
  }
  return sphere;
}

}  // namespace

Target target_of_tests() {
  Target target;
  target.kind = TargetKind::chessboard;
  target.rows = 9;
  target.cols = 12;
  target.pitch_m = 20 * mm;
  return target;
}

Instrument instrument(unsigned seed) {
  Instrument made;
  made.seed = seed;
  std::mt19937 random(seed + 77);
  made.noise_px = std::uniform_real_distribution<double>(0.02, 0.06)(random);
  made.common_part = seed % 3 == 0 ? 0 : 0.1;
  made.truth = test::SyntheticBench(seed, 10 + static_cast<int>(seed % 7)).true_model();
  if (seed % 4 == 1) made.truth.cameras.pop_back();
  made.truth.board.edge_rise_mm.setZero();
  see_by_another(made.truth, made.noise_px, made.common_part, seed + 1);
  JointModel model = test::forgotten(made.truth);
  start_joint(model);
  JointOptions options;
  options.lens = LensTerms::k1_k2;
  made.calibration = calibrate_joint(model, 0, options).calibration;
  made.rig.name = "drawn";
  made.rig.stages = {{"stage0", 0}, {"stage1", 0.06}};
  return made;
}

AcceptanceInput recorded(const Instrument& of, const std::function<void(JointModel&)>& fault) {
  JointModel later = test::SyntheticBench(of.seed + 5000, 8).true_model();
  later.cameras = of.truth.cameras;
  later.board.edge_rise_mm.setZero();
  Placement rest = later.placements[3];
  for (int i = 0; i < 5; ++i) {
    rest.set = "rest_" + std::to_string(i);
    later.placements.push_back(rest);
  }
  fault(later);
  see_by_another(later, of.noise_px, of.common_part, of.seed + 2);
  AcceptanceInput input;
  input.target = detections_of(later);
  input.calibrated.detections = detections_of(of.truth);
  input.repeats = {"rest_0", "rest_1", "rest_2", "rest_3", "rest_4"};
  input.sphere = ball_of(later.cameras, of.noise_px, of.seed + 3);
  return input;
}

Acceptance accepted(const Instrument& made, const AcceptanceInput& input,
                    const AcceptanceOptions& options) {
  return accept(input, made.calibration, made.rig, target_of_tests(), options);
}

}  // namespace drape::calib
