// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>

#include "core/geometry/rigid_motion.hpp"

namespace drape {

/// Pinhole with Brown's distortion from undistorted to distorted normalised coordinates
/// (Brown 1971; coefficient order of OpenCV).
struct BrownLens {
  double fx_px = 0, fy_px = 0;  ///< focal lengths
  double cx_px = 0, cy_px = 0;  ///< principal point
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};

/// Tsai's lens (Tsai 1987): one radial coefficient from DISTORTED to undistorted sensor
/// position, undistorted = distorted * (1 + kappa1 r_d^2). Opposite direction to Brown's k1.
struct TsaiLens {
  double focal_m = 0;           ///< effective focal length f
  double kappa1_per_m2 = 0;     ///< > 0 for barrel distortion
  double cx_px = 0, cy_px = 0;  ///< image centre
  double scale_x = 1;           ///< horizontal scale factor s_x
  double pixel_pitch_x_m = 0;   ///< sensor element spacing dpx
  double pixel_pitch_y_m = 0;   ///< sensor element spacing dpy
};

/// Lens and image size in pixels. Pixel centres are at integers, (0,0) is the top-left pixel.
struct CameraModel {
  std::variant<BrownLens, TsaiLens> lens;
  int width_px = 0;
  int height_px = 0;
};

/// A calibrated camera.
struct Camera {
  std::string name;
  CameraModel model;
  CamFromWorld cam_from_world;
};

/// Image of a point with its derivative.
struct Projection {
  Eigen::Vector2d px;
  Eigen::Matrix<double, 2, 3> d_px_d_point;  ///< px per metre
};

/// Distorted pixel of a point in the camera frame (metres). nullopt for a point behind the
/// camera or beyond the radius up to which the lens model is monotonic. The image border is not
/// a limit.
[[nodiscard]] std::optional<Projection> project(const CameraModel& model,
                                                const Eigen::Vector3d& point_in_camera);

/// Unit ray in the camera frame that projects to the pixel. nullopt outside the model's range.
[[nodiscard]] std::optional<Eigen::Vector3d> unproject(const CameraModel& model,
                                                       const Eigen::Vector2d& px);

/// Camera centre in the world frame (metres).
[[nodiscard]] Eigen::Vector3d centre_in_world(const Camera& camera);

using Matrix2X = Eigen::Matrix<double, 2, Eigen::Dynamic>;

/// Derivative of the projected pixel with respect to the lens parameters, one column for each, in
/// the order and the file units of parameter_names(). nullopt wherever project() returns nullopt.
[[nodiscard]] std::optional<Matrix2X> d_px_d_lens(const CameraModel& model,
                                                  const Eigen::Vector3d& point_in_camera);

/// J with exp(w + dw) = exp(J dw) exp(w) to first order, for a rotation vector w (rad).
[[nodiscard]] Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_vector);

/// Derivative of the pixel of a world point (metres) with respect to all parameters of a camera:
/// the lens, the rotation vector (rad) and the translation (mm), as in parameter_names().
[[nodiscard]] std::optional<Matrix2X> d_px_d_parameters(const Camera& camera,
                                                        const Eigen::Vector3d& point_in_world);

/// Position and surface of a printed round dot in the camera frame (metres).
struct DotInCamera {
  Eigen::Vector3d centre;
  Eigen::Vector3d axis_u, axis_v;  ///< orthogonal unit tangents of the surface
  double radius_m = 0;
  /// Curvature along (u, v) in 1/m: the surface is centre + a u + b v - 1/2 (a,b) S (a,b)' n with
  /// n = u x v. Zero for a plane.
  Eigen::Matrix2d curvature_per_m = Eigen::Matrix2d::Zero();
};

/// Centroid (px) of the image area that a dot covers: the centre of the fitted ellipse. It
/// differs from the image of the dot's centre, shifted by perspective (eccentricity; Heikkila
/// 2000) and by curvature. nullopt if part of the outline does not project or the dot is seen
/// edge-on.
[[nodiscard]] std::optional<Eigen::Vector2d> dot_centroid_px(const CameraModel& model,
                                                             const DotInCamera& dot);

/// Offset (px) of that centroid from the image of the dot's centre. nullopt if there is no
/// centroid.
[[nodiscard]] std::optional<Eigen::Vector2d> eccentricity_px(const CameraModel& model,
                                                             const DotInCamera& dot);

}  // namespace drape
