// SPDX-License-Identifier: Apache-2.0
#include "core/calibration.hpp"

#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using units::mm;
using units::um;

constexpr double kPerMm2 = 1 / (mm * mm);

/// Requires a row and a column of each named parameter in a covariance.
void check_covariance(Fields& f, std::string_view field, std::string_view names_field,
                      const std::vector<std::string>& names, const Eigen::MatrixXd& matrix) {
  const auto parameters = static_cast<Eigen::Index>(names.size());
  f.rule(matrix.rows() == parameters && matrix.cols() == parameters, field,
         fmt::format("its size is not the number of {}", names_field), make_again);
  if (!f.reads() || matrix.rows() != matrix.cols()) return;
  f.rule(is_covariance(matrix), field, "it is no covariance: not symmetric, or negative",
         make_again);
}

/// Describes an optional matrix.
void matrix_if_any(Fields& f, const Field& field, Eigen::MatrixXd& matrix) {
  std::optional<Eigen::MatrixXd> found;
  if (matrix.size() > 0) found = matrix;
  f.if_any(field, found);
  matrix = found.value_or(Eigen::MatrixXd());
}

/// Describes a covariance matrix with its parameter names; `may_lack`: both may be omitted.
void covariance(Fields& f, const Field& names_field, const Field& field, bool may_lack,
                std::vector<std::string>& names, Eigen::MatrixXd& matrix) {
  const bool walks = !may_lack || f.documents() || !names.empty() || f.reads();
  if (!walks) return;
  if (may_lack) {
    f.if_any(names_field, names);
    matrix_if_any(f, field, matrix);
  } else {
    f(names_field, names);
    f(field, matrix);
  }
  check_covariance(f, field.name, names_field.name, names, matrix);
}

constexpr double kFarthest_m = 100;
constexpr double kMostPixels = 65535;  ///< of a row or a column, as in PNG and JPEG

/// Why a camera can be none of a bench, by its lens, picture and pose; empty if it can.
std::string fault_of(const Camera& camera) {
  const CameraModel& model = camera.model;
  const Eigen::Vector2d size(model.width_px, model.height_px);
  const Eigen::Array2d focal = std::visit(
      [](const auto& lens) -> Eigen::Array2d {
        if constexpr (requires { lens.fx_px; })
          return {lens.fx_px, lens.fy_px};
        else
          return {lens.scale_x * lens.focal_m / lens.pixel_pitch_x_m,
                  lens.focal_m / lens.pixel_pitch_y_m};
      },
      model.lens);
  const Eigen::Array2d centre = std::visit(
      [](const auto& lens) -> Eigen::Array2d {
        return {lens.cx_px, lens.cy_px};
      },
      model.lens);
  const double ratio = focal.x() / focal.y();
  // Half the angle of view is 84 degrees at most, and 1.7 minutes of arc at least; an anamorphic
  // lens halves the pixels along one side.
  if (!(focal.minCoeff() > 0.05 * size.maxCoeff() && focal.maxCoeff() < 1000 * size.maxCoeff()) ||
      !(ratio > 0.25 && ratio < 4))
    return fmt::format("fx is {:g} px and fy {:g} px: no focal length for an image of {} x {} px",
                       focal.x(), focal.y(), model.width_px, model.height_px);
  if (!((centre > -size.array()).all() && (centre < 2 * size.array()).all()))
    return fmt::format("the image centre ({:g}, {:g}) lies far outside the image of {} x {} px",
                       centre.x(), centre.y(), model.width_px, model.height_px);
  if (!unproject(model, size / 4)) return "the lens folds over inside the picture";
  for (const double u : {0.0, size.x()}) {
    for (const double v : {0.0, size.y()}) {
      const Eigen::Array2d corner(u, v);
      const Eigen::Vector2d straight = (corner - centre) / focal;
      const auto px = project(model, {straight.x(), straight.y(), 1});
      if (px && !((px->px - corner.matrix()).norm() < size.norm()))
        return "the distortion moves a corner by more than the picture";
    }
  }
  if (!(centre_in_world(camera).norm() < kFarthest_m))
    return "the camera stands farther away than 100 m";
  return {};
}

}  // namespace

void fields(Fields& f, BrownLens& lens) {
  f({"fx_px", "focal length along u"}, lens.fx_px);
  f({"fy_px", "focal length along v"}, lens.fy_px);
  f({"cx_px", "principal point, u"}, lens.cx_px);
  f({"cy_px", "principal point, v"}, lens.cy_px);
  f({"k1", "radial distortion, r^2"}, lens.k1);
  f({"k2", "radial distortion, r^4"}, lens.k2);
  f({"p1", "tangential distortion"}, lens.p1);
  f({"p2", "tangential distortion"}, lens.p2);
  f({"k3", "radial distortion, r^6"}, lens.k3);
}

void fields(Fields& f, TsaiLens& lens) {
  f({"focal_mm", "effective focal length", mm}, lens.focal_m);
  f({"kappa1_per_mm2", "radial distortion, distorted to undistorted", kPerMm2}, lens.kappa1_per_m2);
  f({"cx_px", "image centre, u"}, lens.cx_px);
  f({"cy_px", "image centre, v"}, lens.cy_px);
  f({"scale_x", "horizontal scale factor"}, lens.scale_x);
  f({"pixel_pitch_x_um", "pitch of the sensor along u", um}, lens.pixel_pitch_x_m);
  f({"pixel_pitch_y_um", "pitch of the sensor along v", um}, lens.pixel_pitch_y_m);
}

void fields(Fields& f, std::variant<BrownLens, TsaiLens>& lens) {
  f.one_of({"model", "model of the lens"}, lens, {"brown", "tsai"});
}

void fields(Fields& f, CamFromWorld& pose) {
  f({"rotation", "rows of the matrix"}, pose.rotation);
  f({"translation_mm", "world origin in camera coordinates", mm}, pose.translation_m);
  if (!f.reads()) return;
  constexpr double kRounded = 1e-4;  // tolerance for elements with five digits
  const double fault =
      (pose.rotation * pose.rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  f.rule(fault <= kRounded && pose.rotation.determinant() >= 0, "rotation",
         "the matrix is not a rotation", make_again);
  if (fault > 1e-12 && fault <= kRounded) pose.rotation = nearest_rotation(pose.rotation);
}

void fields(Fields& f, CalibrationResiduals& residuals) {
  f({"points", "number of target points"}, residuals.points);
  f({"rms_px", "RMS distance in the distorted image"}, residuals.rms_px);
  f({"max_px", "largest distance in the distorted image"}, residuals.max_px);
  f({"object_rms_mm", "RMS distance of the target points from the rays"}, residuals.object_rms_mm);
}

void fields(Fields& f, WorkedPoint& point) {
  f({"point_in_world_mm", "a point in the world", mm}, point.point_in_world);
  f({"px", "pixel to which the point must project"}, point.px);
}

void fields(Fields& f, CalibratedCamera& calibrated) {
  Camera& camera = calibrated.camera;
  f(Field{"name", "name of the camera"}.plain_name(), camera.name);
  f({"width_px", "columns of its pictures", 1, 1, kMostPixels}, camera.model.width_px);
  f({"height_px", "rows of its pictures", 1, 1, kMostPixels}, camera.model.height_px);
  f({"lens", "lens of the camera"}, camera.model.lens);
  f({"cam_from_world", "pose of the camera"}, camera.cam_from_world);
  Eigen::Vector3d centre_m = centre_in_world(camera);
  f.otherwise({"centre_in_world_mm", "position of the camera, from its pose", mm}, centre_m);
  f({"residuals", "residuals of the fit"}, calibrated.residuals);
  covariance(f, {"covariance_parameters", "names and units of the covariance's parameters"},
             {"covariance", "rows of the matrix, in the units of the file"}, false,
             calibrated.covariance_parameters, calibrated.covariance);
  f({"valid_region_px", "u_min, v_min, u_max, v_max of the region covered by calibration points"},
    calibrated.valid_region_px);
  f({"worked_point", "worked example that lets an importer check its projection"},
    calibrated.worked_point);
  if (!f.reads()) return;
  // A rotation of five digits is made orthogonal when it is read.
  f.rule((centre_m - centre_in_world(camera)).norm() <=
             2e-4 * camera.cam_from_world.translation_m.norm() + 1e-9,
         "centre_in_world_mm", "it is not the centre of the pose", make_again);
  f.rule(calibrated.covariance_parameters.empty() ||
             calibrated.covariance_parameters == parameter_names(camera.model),
         "covariance_parameters", "they are not those of the lens and the pose, in their order",
         make_again);
  const std::optional<Projection> px =
      project(camera.model, camera.cam_from_world * calibrated.worked_point.point_in_world);
  f.rule(px && (px->px - calibrated.worked_point.px).norm() <= 1e-6, "worked_point.px",
         "the worked point does not land on its pixel: the file was altered", make_again);
}

void fields(Fields& f, Calibration& calibration) {
  f({"method", "tsai or joint"}, calibration.method);
  f({"rig", "name of the bench"}, calibration.rig);
  f({"sets", "frame sets that were used"}, calibration.sets);
  f({"no_go", "reason why measurements with it cannot be trusted; null if they can"},
    calibration.no_go);
  f({"warnings", "warnings"}, calibration.warnings);
  f({"cameras", "each camera"}, calibration.cameras);
  covariance(f, {"joint_covariance_parameters", "cam0/fx_px and so on: parameters of all cameras"},
             {"joint_covariance", "rows of the matrix of all cameras together"}, true,
             calibration.joint_covariance_parameters, calibration.joint_covariance);
  matrix_if_any(f, {"target_covariance", "share of the target's own error in joint_covariance"},
                calibration.target_covariance);
  if (calibration.target_covariance.size() > 0)
    check_covariance(f, "target_covariance", "joint_covariance_parameters",
                     calibration.joint_covariance_parameters, calibration.target_covariance);
  if (!f.reads()) return;
  std::set<std::string> names, parameters;
  std::size_t number = 0;
  for (const CalibratedCamera& calibrated : calibration.cameras) {
    const Camera& camera = calibrated.camera;
    // A calibration that went astray is kept for its NO-GO; nothing measures with it.
    const std::string fault = calibration.no_go ? std::string() : fault_of(camera);
    f.rule(fault.empty(), fmt::format("cameras.{}.lens", number++), fault, make_again);
    f.rule(names.insert(camera.name).second, "cameras", "two cameras have one name", make_again);
    for (const std::string& name : parameter_names(camera.model))
      parameters.insert(camera.name + "/" + name);
  }
  const auto& joint = calibration.joint_covariance_parameters;
  f.rule(std::all_of(joint.begin(), joint.end(),
                     [&](const std::string& name) { return parameters.erase(name) == 1; }),
         "joint_covariance_parameters", "one is twice, or none of a camera", make_again);
}

const CalibratedCamera* Calibration::find(const std::string& name) const {
  for (const CalibratedCamera& candidate : cameras)
    if (candidate.camera.name == name) return &candidate;
  return nullptr;
}

const CalibratedCamera& Calibration::camera(const std::string& name) const {
  if (const CalibratedCamera* found = find(name)) return *found;
  throw bad_input("the calibration has no such camera", {.camera = name},
                  "calibrate the rig with this camera");
}

std::vector<std::string> parameter_names(const CameraModel& model) {
  std::vector<std::string> names =
      std::holds_alternative<TsaiLens>(model.lens)
          ? std::vector<std::string>{"focal_mm", "kappa1_per_mm2", "cx_px", "cy_px", "scale_x"}
          : std::vector<std::string>{"fx_px", "fy_px", "cx_px", "cy_px", "k1",
                                     "k2",    "p1",    "p2",    "k3"};
  for (const char* name : {"rotation_x_rad", "rotation_y_rad", "rotation_z_rad", "translation_x_mm",
                           "translation_y_mm", "translation_z_mm"}) {
    names.emplace_back(name);
  }
  return names;
}

Calibration read_calibration(const std::filesystem::path& file) {
  return read_record<Calibration>(file);
}

void write_calibration(const std::filesystem::path& file, const Calibration& calibration) {
  write_record(file, calibration);
}

}  // namespace drape
