// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/camera_model.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// A target point and its image in one camera.
struct Correspondence {
  Eigen::Vector3d point_in_world;  ///< metres
  Eigen::Vector2d px;              ///< measured position
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  std::string set = {};
  MarkId dot = {};
};

/// W with W'W the inverse of the covariance.
[[nodiscard]] Eigen::Matrix2d whitener(const Eigen::Matrix2d& covariance_px2);

/// Throws Error(bad_input) if the detections are of a cloth or of another target.
void check_lattice(const Detections& detections, const Rig& rig, const Target& target);

/// Frame of a set and camera; null if there is none.
[[nodiscard]] const FrameDetections* find_frame(const Detections& detections,
                                                const std::string& set, const std::string& camera);

/// Throws Error(bad_input) with camera and set if the image size differs from the rig's, or a
/// position or covariance is not finite or not positive.
void check_frame(const FrameDetections& frame, const RigCamera& camera);

void check_detection(const Detection& detection, const FrameDetections& frame);

/// Negligible error at the target: of a point, of a z stage (at the edge of the highest one), or of
/// a camera that moved; also the accuracy required of camera positions.
inline constexpr double harmless_m = 0.03e-3;

/// Distances of image points from projections (px, distorted) and of target points from
/// back-projected rays (mm). `points` excludes points that do not project.
[[nodiscard]] CalibrationResiduals residuals_of(const Camera& camera,
                                                const std::vector<Correspondence>& points);

/// Distance in the distorted image (px); infinite if the point does not project.
[[nodiscard]] double distance_px(const Camera& camera, const Correspondence& point);

/// Distance of the world point from the ray through its pixel, metres; nullopt without a ray.
[[nodiscard]] std::optional<double> miss_m(const Camera& camera, const Correspondence& point);

/// Weng's normalised calibration error: mean ratio of the ray's distance from the point, at the
/// point's depth, to that caused by rounding to whole pixels (Weng, Cohen, Herniou 1992).
[[nodiscard]] double normalised_error(const Camera& camera,
                                      const std::vector<Correspondence>& points);

/// Mean and maximum of one error measure.
struct ErrorMeasure {
  double mean = 0, max = 0;
};

/// The four classical measures of calibration error (Tsai 1987; Weng, Cohen, Herniou 1992):
/// distance in the distorted image, in the undistorted image, of the target point from its ray
/// (mm), and Weng's ratio (1 corresponds to rounding to pixels). Points that do not project or have
/// no ray are excluded.
struct ClassicalErrors {
  ErrorMeasure distorted_px, undistorted_px, object_mm;
  double normalised = 0;
};

[[nodiscard]] ClassicalErrors classical_errors(const Camera& camera,
                                               const std::vector<Correspondence>& points);

/// Assembles a camera calibrated by these points: residuals, the rectangle that they cover, a
/// worked point from their middle, and its covariance, which may be empty.
[[nodiscard]] CalibratedCamera calibrated_of(const Camera& camera,
                                             const std::vector<Correspondence>& points,
                                             const Eigen::MatrixXd& covariance);

/// Rectangle (u_min, v_min, u_max, v_max) covered by the points, px.
[[nodiscard]] Eigen::Vector4d covered_region_px(const std::vector<Correspondence>& points);

/// Sets of free parameters of a refinement.
enum class TsaiFree {
  focal_depth_kappa,  ///< f, Tz, kappa1: the nonlinear part of stage 2
  all_but_scale_x,    ///< stage 3 with s_x fixed
  all,                ///< stage 3 with s_x free
};

struct Refinement {
  Camera camera;
  bool converged = false;
  int iterations = 0;
  double chi2 = 0;  ///< weighted sum of squares at the end
};

/// Least squares of the signed distorted residuals in x and y, weighted by the points' covariances
/// (Levenberg-Marquardt). The camera must have a Tsai lens.
[[nodiscard]] Refinement refine_tsai(const Camera& start, const std::vector<Correspondence>& points,
                                     TsaiFree free, int max_iterations);

/// Covariance of all parameters, in the order and units of parameter_names(), from the marks'
/// covariances; rows and columns of fixed parameters are zero. Empty if singular.
[[nodiscard]] Eigen::MatrixXd tsai_covariance(const Camera& camera,
                                              const std::vector<Correspondence>& points,
                                              TsaiFree free);

/// Number of free parameters.
[[nodiscard]] int free_parameters(TsaiFree free);

/// Fixed inputs of Tsai's stage 1: sensor pitch (m) and image centre (px).
struct TsaiSensor {
  double pixel_pitch_x_m = 0, pixel_pitch_y_m = 0;
  double cx_px = 0, cy_px = 0;
};

/// Result of the radial alignment constraint: all parameters except f, Tz and kappa1.
struct RadialAlignment {
  Eigen::Matrix3d rotation;  ///< camera from world
  double tx_m = 0, ty_m = 0;
  double scale_x = 1;
  bool origin_shifted = false;  ///< solved with a shifted origin because Ty was near 0
};

/// Stage 1 for points at several heights: 7 unknowns, at least 7 points (Tsai 1987, section IV).
/// nullopt if the points do not determine them.
[[nodiscard]] std::optional<RadialAlignment> align_non_coplanar(
    const std::vector<Correspondence>& points, const TsaiSensor& sensor);

/// Stage 1 for points on the plane z = 0: 5 unknowns, at least 5 points, s_x stays 1 (Tsai 1987,
/// section III). nullopt if the points do not determine them.
[[nodiscard]] std::optional<RadialAlignment> align_coplanar(
    const std::vector<Correspondence>& points, const TsaiSensor& sensor);

/// Linear part of stage 2: f and Tz with kappa1 = 0, from the image y (Tsai 1987, eq. 15).
struct FocalAndDepth {
  double focal_m = 0;  ///< negative if the points are mirrored (left-handed)
  double tz_m = 0;
};

[[nodiscard]] std::optional<FocalAndDepth> solve_focal_and_depth(
    const std::vector<Correspondence>& points, const TsaiSensor& sensor,
    const RadialAlignment& alignment);

/// The same alignment with the other sign of x and y in the third row: a single plane determines
/// the rotation only up to this reflection; the sign of the focal length resolves it.
[[nodiscard]] RadialAlignment mirrored(const RadialAlignment& alignment);

/// Camera with kappa1 = 0 from stage 1 and the linear part of stage 2.
[[nodiscard]] Camera start_camera(const TsaiSensor& sensor, const RadialAlignment& alignment,
                                  const FocalAndDepth& depth);

}  // namespace drape::calib
