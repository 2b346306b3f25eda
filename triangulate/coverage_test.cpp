// SPDX-License-Identifier: Apache-2.0
// Tests whether 95 % intervals of triangulated points hold if the cameras are uncertain too.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cstdio>
#include <random>

#include "core/camera_model.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"
#include "triangulate/plate/plate.hpp"
#include "triangulate/point.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using units::deg;
using units::mm;

constexpr int kFree = 12;        // fx fy cx cy k1 k2 and the pose; p1 p2 k3 are held at zero
constexpr double kPixel = 0.03;  // noise of a target's dot and of a mark, px
constexpr double kScale = 1e-4;  // of the target, one standard deviation
constexpr double kBow_m = 2e-5;  // of the target's centre

constexpr std::array<int, kFree> kPlaces = {0, 1, 2, 3, 4, 5, 9, 10, 11, 12, 13, 14};

/// Random numbers from one generator, so that a rig is a function of its index.
class Draw {
 public:
  explicit Draw(int seed) : random_(seed) {}
  double normal() { return normal_(random_); }
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  VectorXd normals(Eigen::Index count) {
    VectorXd values(count);
    for (double& value : values) value = normal();
    return values;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_{0, 1};
};

/// A camera at a random position above the bench, looking at it.
Camera some_camera(Draw& draw, double azimuth, const std::string& name) {
  const double height = draw.between(30, 65) * deg, away = draw.between(0.5, 0.9);
  const Vector3d from = away * Vector3d(std::cos(azimuth) * std::cos(height),
                                        std::sin(azimuth) * std::cos(height), std::sin(height));
  const Vector3d z = -from.normalized();
  const Vector3d x = z.cross(Vector3d::UnitZ()).normalized();
  Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  BrownLens lens{draw.between(2200, 3200), 0, 800, 600, draw.between(-0.2, 0.1), 0.03};
  lens.fy_px = lens.fx_px * draw.between(0.999, 1.001);
  return {name, {lens, 1600, 1200}, {rotation, -rotation * from}};
}

/// The camera with its free parameters changed, in the units of parameter_names().
Camera moved(Camera camera, const VectorXd& by) {
  auto& lens = std::get<BrownLens>(camera.model.lens);
  int at = 0;
  for (double* term : {&lens.fx_px, &lens.fy_px, &lens.cx_px, &lens.cy_px, &lens.k1, &lens.k2})
    *term += by[at++];
  const Eigen::AngleAxisd turn(camera.cam_from_world.rotation);
  const Vector3d vector = turn.angle() * turn.axis() + by.segment<3>(6);
  camera.cam_from_world.rotation =
      Eigen::AngleAxisd(vector.norm(), vector.normalized()).toRotationMatrix();
  camera.cam_from_world.translation_m += by.tail<3>() * mm;
  return camera;
}

/// Errors of a camera due to the noise of its target and to the target's own errors (scale, bow).
struct CameraErrors {
  MatrixXd lower;     ///< Cholesky factor of the covariance from the dots' noise
  MatrixXd by_shape;  ///< effect of one standard deviation of (scale, bow); shared by all cameras
};

CameraErrors camera_errors_of(const Camera& camera) {
  std::vector<Vector3d> dots;
  for (const double z : {0.0, 0.05, 0.1}) {
    for (int i = -4; i <= 4; ++i) {
      for (int j = -3; j <= 3; ++j) dots.emplace_back(0.025 * i, 0.025 * j, z);
    }
  }
  MatrixXd jacobian(2 * dots.size(), kFree), by_shape(2 * dots.size(), 2);
  for (std::size_t i = 0; i < dots.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const Matrix2X all = *d_px_d_parameters(camera, dots[i]);
    for (int k = 0; k < kFree; ++k) jacobian.block<2, 1>(row, k) = all.col(kPlaces.at(k));
    const Eigen::Matrix<double, 2, 3> by_point =
        project(camera.model, camera.cam_from_world * dots[i])->d_px_d_point *
        camera.cam_from_world.rotation;
    const double radius2 = dots[i].head<2>().squaredNorm() / (0.1 * 0.1);
    by_shape.block<2, 1>(row, 0) = by_point * (kScale * dots[i]);
    by_shape.block<2, 1>(row, 1) = by_point * Vector3d(0, 0, kBow_m * (1 - radius2));
  }
  const MatrixXd inverse = MatrixXd(jacobian.transpose() * jacobian).inverse();
  return {MatrixXd((kPixel * kPixel) * inverse).llt().matrixL(),
          inverse * jacobian.transpose() * by_shape};
}

/// Three true cameras, their calibration, and its covariance.
struct SyntheticRig {
  std::vector<Camera> truth;
  Calibration found;
};

SyntheticRig some_rig(Draw& draw) {
  SyntheticRig rig;
  MatrixXd factor = MatrixXd::Zero(3 * kFree, 3 * kFree + 2);
  for (int i = 0; i < 3; ++i) {
    rig.truth.push_back(
        some_camera(draw, 2.1 * i + draw.between(-0.4, 0.4), "cam" + std::to_string(i)));
    const CameraErrors errors = camera_errors_of(rig.truth.back());
    factor.block(kFree * i, kFree * i, kFree, kFree) = errors.lower;
    factor.block(kFree * i, 3 * kFree, kFree, 2) = errors.by_shape;
  }
  const VectorXd error = factor * draw.normals(factor.cols());
  for (int i = 0; i < 3; ++i) {
    CalibratedCamera calibrated;
    calibrated.camera = moved(rig.truth[i], error.segment(kFree * i, kFree));
    const auto names = parameter_names(calibrated.camera.model);
    for (const int place : kPlaces)
      rig.found.joint_covariance_parameters.push_back(rig.truth[i].name + "/" + names[place]);
    rig.found.cameras.push_back(calibrated);
  }
  rig.found.joint_covariance = factor * factor.transpose();
  return rig;
}

/// A point triangulated with the calibrated cameras from noisy pixels of the true ones.
Point measured(const SyntheticRig& rig, const JointPlaces& places, const Vector3d& truth,
               int cameras, Draw& draw) {
  std::vector<View> views;
  for (int i = 0; i < cameras; ++i) {
    View view;
    view.camera = &rig.found.cameras[i];
    view.joint = &places.at(rig.truth[i].name);
    view.px = project(rig.truth[i].model, rig.truth[i].cam_from_world * truth)->px +
              kPixel * Vector2d(draw.normal(), draw.normal());
    view.covariance_px2 = kPixel * kPixel * Eigen::Matrix2d::Identity();
    views.push_back(view);
  }
  return solve_point(views, 2 * deg);
}

TEST(Coverage, IntervalsOfPointsHoldOverSyntheticRigs) {
  // The rigs are cheap, so every run has 200; the long test has more for better statistics.
  const int rigs = test::trial_count(200, 2000);
  constexpr int kPoints = 20;
  for (int cameras = 2; cameras <= 3; ++cameras) {
    double inside = 0, mahalanobis = 0, calibration = 0, total = 0;
    for (int r = 0; r < rigs; ++r) {
      Draw draw(1000 * cameras + r);
      const SyntheticRig rig = some_rig(draw);
      const JointPlaces places = joint_places(rig.found);
      for (int p = 0; p < kPoints; ++p) {
        const Vector3d truth(draw.between(-0.1, 0.1), draw.between(-0.1, 0.1),
                             draw.between(0, 0.12));
        const Point point = measured(rig, places, truth, cameras, draw);
        ASSERT_EQ(point.status, PointStatus::good);
        const Vector3d error = point.in_world - truth;
        const Matrix3d covariance = point.covariance_m2();
        for (int axis = 0; axis < 3; ++axis)
          inside += std::abs(error[axis]) <= 1.959964 * std::sqrt(covariance(axis, axis));
        mahalanobis += error.dot(covariance.llt().solve(error));
        calibration += point.calibration_covariance_m2.trace();
        total += covariance.trace();
      }
    }
    const double count = static_cast<double>(rigs) * kPoints;
    std::printf(
        "%d cameras, %d rigs: %.2f %% inside the 95 %% intervals, Mahalanobis^2 %.3f, "
        "calibration %.0f %% of the variance\n",
        cameras, rigs, 100 * inside / (3 * count), mahalanobis / count, 100 * calibration / total);
    EXPECT_GE(inside / (3 * count), 0.93);
    EXPECT_LE(inside / (3 * count), 0.97);
    EXPECT_NEAR(mahalanobis / count, 3, 0.25);
    EXPECT_GT(calibration / total, 0.2) << "the calibration's part is not tested";
  }
}

TEST(Coverage, ErrorsInCommonAreNotTakenForSeparateOnes) {
  Draw draw(7);
  const SyntheticRig rig = some_rig(draw);
  const JointPlaces places = joint_places(rig.found);
  const Vector3d truth(0.05, 0.03, 0.05);
  const Matrix3d joint = measured(rig, places, truth, 3, draw).calibration_covariance_m2;
  Calibration apart = rig.found;  // the same variances, without correlation between cameras
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      if (i != j) apart.joint_covariance.block<kFree, kFree>(kFree * i, kFree * j).setZero();
  }
  SyntheticRig blind = rig;
  blind.found = apart;
  const JointPlaces blind_places = joint_places(blind.found);
  const Matrix3d separate = measured(blind, blind_places, truth, 3, draw).calibration_covariance_m2;
  EXPECT_GT(std::abs(joint.trace() / separate.trace() - 1), 0.05);
}

/// A target printed too large makes a world that is too large by the same part about its origin, so
/// the target's share of a point's covariance is the square of that part times its place.
TEST(Coverage, ATargetsScaleMovesAPointInProportionToItsPlace) {
  Draw draw(11);
  SyntheticRig rig = some_rig(draw);
  VectorXd growth = VectorXd::Zero(3 * kFree);
  for (int i = 0; i < 3; ++i)
    growth.segment<3>(kFree * i + 9) =
        rig.found.cameras[i].camera.cam_from_world.translation_m / mm;
  rig.found.target_covariance = kScale * kScale * growth * growth.transpose();
  const Vector3d truth(0.06, -0.04, 0.09);
  const Point point = measured(rig, joint_places(rig.found), truth, 3, draw);
  const Matrix3d expected = kScale * kScale * point.in_world * point.in_world.transpose();
  EXPECT_LT((point.target_covariance_m2 - expected).norm(), 1e-3 * expected.norm());
}

/// A plate of 5 x 5 dots, 80 mm wide, somewhere on the bench, with noisy centroids of its dots.
struct SomePlate {
  MarkLattice lattice;
  WorldFromObject truth;
  std::vector<MarkViews> marks;
};

SomePlate some_plate(const SyntheticRig& rig, const JointPlaces& places, Draw& draw) {
  SomePlate plate;
  plate.lattice.surface = Surface::target;
  plate.lattice.rows = plate.lattice.cols = 5;
  plate.lattice.pitch_m = 16 * mm;
  plate.lattice.dot_diameter_m = 5 * mm;
  const Vector3d axis(draw.normal(), draw.normal(), 20 * draw.normal());
  plate.truth.rotation =
      Eigen::AngleAxisd(draw.between(0, 0.5), axis.normalized()).toRotationMatrix();
  plate.truth.translation_m = {draw.between(-0.05, 0.05), draw.between(-0.05, 0.05),
                               draw.between(0, 0.12)};
  const Matrix3d& turn = plate.truth.rotation;
  for (int row = 0; row < 5; ++row) {
    for (int col = 0; col < 5; ++col) {
      MarkViews mark{{row, col}, {}, {}};
      const Vector3d at = plate.truth * Vector3d(16 * mm * (col - 2), 16 * mm * (row - 2), 0);
      for (std::size_t i = 0; i < rig.truth.size(); ++i) {
        const Pose<frame::Camera, frame::World>& pose = rig.truth[i].cam_from_world;
        View view;
        view.camera = &rig.found.cameras[i];
        view.joint = &places.at(rig.truth[i].name);
        view.px = *dot_centroid_px(rig.truth[i].model, {pose * at, pose.rotation * turn.col(0),
                                                        pose.rotation * turn.col(1), 2.5 * mm}) +
                  kPixel * Vector2d(draw.normal(), draw.normal());
        view.covariance_px2 = kPixel * kPixel * Eigen::Matrix2d::Identity();
        mark.views.push_back(view);
      }
      plate.marks.push_back(mark);
    }
  }
  return plate;
}

/// Translation (m) and rotation (rad, world axes) from the pose to the truth.
Eigen::Matrix<double, 6, 1> error_of(const PlatePose& found, const WorldFromObject& truth) {
  const Eigen::AngleAxisd turn(
      Matrix3d(truth.rotation * found.world_from_plate.rotation.transpose()));
  Eigen::Matrix<double, 6, 1> error;
  error << truth.translation_m - found.world_from_plate.translation_m, turn.angle() * turn.axis();
  return error;
}

TEST(Coverage, IntervalsOfAPlatesPoseHoldOverSyntheticRigs) {
  const int rigs = test::trial_count(300, 3000);
  double inside = 0, blind = 0, worst_mm = 0, worst_deg = 0;
  for (int r = 0; r < rigs; ++r) {
    Draw draw(5000 + r);
    const SyntheticRig rig = some_rig(draw);
    const JointPlaces places = joint_places(rig.found);
    SomePlate plate = some_plate(rig, places, draw);
    const PlatePose found = plate_pose(plate.marks, plate.lattice);
    const auto error = error_of(found, plate.truth);
    // The control assumes perfect cameras, and must fail.
    for (MarkViews& mark : plate.marks)
      for (View& view : mark.views) view.joint = nullptr;
    const PlatePose alone = plate_pose(plate.marks, plate.lattice);
    for (int k = 0; k < 6; ++k) {
      inside += std::abs(error[k]) <= 1.959964 * std::sqrt(found.covariance(k, k));
      blind += std::abs(error[k]) <= 1.959964 * std::sqrt(alone.covariance(k, k));
    }
    worst_mm = std::max(worst_mm, error.head<3>().norm() / mm);
    worst_deg = std::max(worst_deg, error.tail<3>().norm() / deg);
  }
  std::printf(
      "%d plates: %.2f %% inside the 95 %% intervals, %.2f %% with perfect cameras; largest "
      "error %.4f mm, %.4f degrees\n",
      rigs, 100 * inside / (6 * rigs), 100 * blind / (6 * rigs), worst_mm, worst_deg);
  EXPECT_GE(inside / (6 * rigs), 0.93);
  EXPECT_LE(inside / (6 * rigs), 0.97);
  EXPECT_LT(blind / (6 * rigs), 0.93) << "the cameras' part is not tested";
  EXPECT_LT(worst_mm, 0.1);
  EXPECT_LT(worst_deg, 0.1);
}

}  // namespace
}  // namespace drape::triangulate
