// SPDX-License-Identifier: Apache-2.0
// How far a camera of bench1 must move after the calibration before its sheets are NO-GO, and how
// often unmoved cameras are.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <random>

#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/trials.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test::bench1_truth;
using units::deg;
using units::mm;

constexpr double kNoise = 0.02;        // noise of a dot's centre, px
constexpr double kImageCentre = 0.03;  // standard deviation, px

struct MoveDraw {
  std::mt19937 random;
  std::normal_distribution<double> standard{0, 1};
  explicit MoveDraw(int seed) : random(static_cast<unsigned>(seed)) {}
  double normal() { return standard(random); }
  Vector3d direction() { return Vector3d(normal(), normal(), normal()).normalized(); }
};

/// Cameras as found by a calibration: image centres off by its stated uncertainty.
Calibration found_cameras(MoveDraw& draw) {
  Calibration calibration;
  calibration.method = "joint";
  calibration.rig = "bench1";
  for (const Camera& camera : bench1_truth().cameras) {
    CalibratedCamera found;
    found.camera = camera;
    found.covariance_parameters = parameter_names(camera.model);
    const auto size = static_cast<Eigen::Index>(found.covariance_parameters.size());
    found.covariance = Eigen::MatrixXd::Zero(size, size);
    found.covariance(2, 2) = found.covariance(3, 3) = kImageCentre * kImageCentre;
    auto& lens = std::get<BrownLens>(found.camera.model.lens);
    lens.cx_px += kImageCentre * draw.normal();
    lens.cy_px += kImageCentre * draw.normal();
    calibration.cameras.push_back(found);
  }
  return calibration;
}

/// A dot of 4 mm in a camera: noisy centroid, and the ellipse of its outline.
Detection seen_dot(const test::TrueDot& dot, int camera, MoveDraw& draw) {
  const Camera& at = bench1_truth().cameras[static_cast<std::size_t>(camera)];
  const Eigen::Matrix<double, 2, 3> map =
      project(at.model, at.cam_from_world * dot.point_in_world)->d_px_d_point *
      at.cam_from_world.rotation * 2 * mm;
  const Eigen::Vector2d shortened = map * dot.normal_in_world;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(map * map.transpose() -
                                                            shortened * shortened.transpose());
  const Eigen::Vector2d major = axes.eigenvectors().col(1);
  Detection seen;
  seen.mark = dot.mark;
  seen.semi_axes_px = axes.eigenvalues().reverse().cwiseMax(0.01).cwiseSqrt();
  seen.axis_angle_rad = std::atan2(major.y(), major.x());
  seen.centre_px = dot.views[static_cast<std::size_t>(camera)].centroid_px +
                   kNoise * Eigen::Vector2d(draw.normal(), draw.normal());
  seen.covariance_px2 = kNoise * kNoise * Eigen::Matrix2d::Identity();
  return seen;
}

Detections seen_drape(const std::string& drape, MoveDraw& draw) {
  Detections detections;
  detections.rig = "bench1";
  detections.lattice = {Surface::cloth,     11, 11, 20 * mm, 4 * mm, {220 * mm, 220 * mm},
                        {10 * mm, 10 * mm}, {}};
  for (int camera = 0; camera < 3; ++camera) {
    FrameDetections frame;
    frame.set = drape;
    frame.camera = bench1_truth().cameras[static_cast<std::size_t>(camera)].name;
    frame.width_px = 1600;
    frame.height_px = 1200;
    for (const test::TrueDot& dot : bench1_truth().drapes.at(drape)) {
      const test::TrueView& view = dot.views[static_cast<std::size_t>(camera)];
      if (view.visible && view.visible_fraction >= 0.99)
        frame.detections.push_back(seen_dot(dot, camera, draw));
    }
    detections.frames.push_back(frame);
  }
  return detections;
}

enum class Move { shift_mm, turn_deg };

/// A camera that has moved since its calibration.
struct Moved {
  MoveDraw draw;
  std::string drape;
  Detections detections;
  Calibration calibration;
  std::size_t camera;
  Vector3d direction;

  explicit Moved(int seed)
      : draw(seed),
        drape(std::array{"A", "C", "E"}.at(static_cast<std::size_t>(seed) % 3)),
        detections(seen_drape(drape, draw)),
        calibration(found_cameras(draw)),
        camera(static_cast<std::size_t>(seed) / 3 % 3),
        direction(draw.direction()) {}

  [[nodiscard]] bool no_go(Move move, double size) const {
    Calibration other = calibration;
    Pose<frame::Camera, frame::World>& pose = other.cameras[camera].camera.cam_from_world;
    if (move == Move::shift_mm) {
      pose.translation_m += size * mm * direction;
    } else {
      const Matrix3d turn = Eigen::AngleAxisd(size * deg, direction).toRotationMatrix();
      pose = {turn * pose.rotation, turn * pose.translation_m};
    }
    return !triangulate(detections, other, drape, {}).report.no_go.empty();
  }

  /// The smallest size of this move that is NO-GO, to five per cent.
  [[nodiscard]] double least(Move move, double none, double surely) const {
    while (surely > 1.05 * none) {
      const double middle = std::sqrt(none * surely);
      (no_go(move, middle) ? surely : none) = middle;
    }
    return surely;
  }
};

/// The 95th percentile of the sizes.
double most_of(std::vector<double> sizes) {
  std::sort(sizes.begin(), sizes.end());
  return sizes[sizes.size() * 95 / 100];
}

TEST(MovedCameras, AreNoGoFromAMillimetreOrATenthOfADegreeOn) {
  // A few cases cannot show 95 %: of 9 draws fewer than 6 are reported once in 1,000.
  const int count = test::trial_count(9, 300);
  const bool whole = count == 300;
  int shifts = 0, turns = 0, alarms = 0;
  std::vector<double> shift_sizes, turn_sizes;
  for (int seed = test::first_trial(); seed < test::first_trial() + count; ++seed) {
    const Moved moved(seed);
    alarms += moved.no_go(Move::shift_mm, 0);
    shifts += moved.no_go(Move::shift_mm, 1);
    turns += moved.no_go(Move::turn_deg, 0.1);
    if (!whole) continue;
    shift_sizes.push_back(moved.least(Move::shift_mm, 1e-3, 20));
    turn_sizes.push_back(moved.least(Move::turn_deg, 1e-4, 3));
  }
  fmt::print("{} and {} of {} moves named, {} of {} good cameras\n", shifts, turns, count, alarms,
             count);
  if (whole)
    fmt::print("95 % are named from {:.2f} mm or {:.3f} degrees on\n", most_of(shift_sizes),
               most_of(turn_sizes));
  EXPECT_GE(shifts, whole ? 285 : 6);
  EXPECT_GE(turns, whole ? 285 : 6);
  // One of 1,000 good pairs exceeds the limit: of 900, more than 4 do once in 400 draws.
  EXPECT_LE(alarms, whole ? 4 : 0);
}

}  // namespace
}  // namespace drape::triangulate
