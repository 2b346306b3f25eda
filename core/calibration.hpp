// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_model.hpp"
#include "core/fields/records.hpp"

namespace drape {

struct CalibrationResiduals {
  int points = 0;
  double rms_px = 0;  ///< RMS distance of measured from projected points, in the distorted image
  double max_px = 0;
  double object_rms_mm = 0;  ///< distance of the target point from the back-projected ray
};

/// A world point and its projected pixel, with which an importer can check itself.
struct WorkedPoint {
  Eigen::Vector3d point_in_world;  ///< metres
  Eigen::Vector2d px;
};

struct CalibratedCamera {
  Camera camera;
  CalibrationResiduals residuals;
  /// Covariance of `parameters` in their file units; empty if the method gives none.
  std::vector<std::string> covariance_parameters;
  Eigen::MatrixXd covariance;
  /// Image rectangle (u_min, v_min, u_max, v_max) in px that the calibration points covered.
  Eigen::Vector4d valid_region_px = Eigen::Vector4d::Zero();
  WorkedPoint worked_point;
};

/// calibration.json: calib -> triangulate, compare, exporters.
struct Calibration {
  std::string method;  ///< "tsai" or "joint"
  std::string rig;
  std::vector<std::string> sets;  ///< frame sets used
  std::vector<CalibratedCamera> cameras;
  /// Covariance of ALL cameras' parameters together, named "cam0/fx_px" and so on, in file units:
  /// cameras that saw one target share errors. Empty if the method gives none ("tsai").
  std::vector<std::string> joint_covariance_parameters;
  Eigen::MatrixXd joint_covariance;
  /// Part of joint_covariance due to the target's shape and print, as far as the views do not
  /// determine them. Empty if the method, or an older file, gives none.
  Eigen::MatrixXd target_covariance;
  std::vector<std::string> warnings;
  std::optional<std::string> no_go;  ///< why no measurement with this calibration can be trusted
  Document document = {};            ///< the file as it was read

  [[nodiscard]] const CalibratedCamera& camera(const std::string& name) const;
  [[nodiscard]] const CalibratedCamera* find(const std::string& name) const;  ///< null if unknown
};

template <>
inline constexpr Format format_of<Calibration>{
    "calibration", Syntax::json, 1, "calibration.json: lenses and places of the cameras"};
void fields(Fields& f, Calibration& calibration);
[[nodiscard]] Calibration read_calibration(const std::filesystem::path& file);
void write_calibration(const std::filesystem::path& file, const Calibration& calibration);

/// Names with units of a camera's parameters, in the order used for covariances: the lens, then
/// the pose as rotation vector (world to camera, rad) and translation (mm).
[[nodiscard]] std::vector<std::string> parameter_names(const CameraModel& model);

}  // namespace drape
