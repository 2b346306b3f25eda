// SPDX-License-Identifier: Apache-2.0
#include "core/calibration.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "core/error.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using units::mm;
using units::um;

constexpr int kCalibrationVersion = 1;
constexpr double kPerMm2 = 1 / (mm * mm);

Json json_of(const BrownLens& lens) {
  return {{"model", "brown"},    {"fx_px", lens.fx_px}, {"fy_px", lens.fy_px},
          {"cx_px", lens.cx_px}, {"cy_px", lens.cy_px}, {"k1", lens.k1},
          {"k2", lens.k2},       {"p1", lens.p1},       {"p2", lens.p2},
          {"k3", lens.k3}};
}

Json json_of(const TsaiLens& lens) {
  return {{"model", "tsai"},
          {"focal_mm", lens.focal_m / mm},
          {"kappa1_per_mm2", lens.kappa1_per_m2 / kPerMm2},
          {"cx_px", lens.cx_px},
          {"cy_px", lens.cy_px},
          {"scale_x", lens.scale_x},
          {"pixel_pitch_x_um", lens.pixel_pitch_x_m / um},
          {"pixel_pitch_y_um", lens.pixel_pitch_y_m / um}};
}

std::variant<BrownLens, TsaiLens> read_lens(const JsonNode& node) {
  const std::string model = node.text("model");
  if (model == "brown") {
    return BrownLens{node.number("fx_px"), node.number("fy_px"), node.number("cx_px"),
                     node.number("cy_px"), node.number("k1"),    node.number("k2"),
                     node.number("p1"),    node.number("p2"),    node.number("k3")};
  }
  if (model != "tsai") node.reject("model", fmt::format("the lens model `{}` is not known", model));
  return TsaiLens{node.number("focal_mm") * mm,
                  node.number("kappa1_per_mm2") * kPerMm2,
                  node.number("cx_px"),
                  node.number("cy_px"),
                  node.number("scale_x"),
                  node.number("pixel_pitch_x_um") * um,
                  node.number("pixel_pitch_y_um") * um};
}

Json json_of(const CalibratedCamera& calibrated) {
  const Camera& camera = calibrated.camera;
  Json json;
  json["name"] = camera.name;
  json["width_px"] = camera.model.width_px;
  json["height_px"] = camera.model.height_px;
  json["lens"] = std::visit([](const auto& lens) { return json_of(lens); }, camera.model.lens);
  json["cam_from_world"]["rotation"] = to_json(camera.cam_from_world.rotation);
  json["cam_from_world"]["translation_mm"] =
      to_json_vector(camera.cam_from_world.translation_m / mm);
  json["centre_in_world_mm"] = to_json_vector(centre_in_world(camera) / mm);
  json["residuals"]["points"] = calibrated.residuals.points;
  json["residuals"]["rms_px"] = calibrated.residuals.rms_px;
  json["residuals"]["max_px"] = calibrated.residuals.max_px;
  json["residuals"]["object_rms_mm"] = calibrated.residuals.object_rms_mm;
  json["covariance_parameters"] = calibrated.covariance_parameters;
  json["covariance"] = to_json(calibrated.covariance);
  json["valid_region_px"] = to_json_vector(calibrated.valid_region_px);
  json["worked_point"]["point_in_world_mm"] =
      to_json_vector(calibrated.worked_point.point_in_world / mm);
  json["worked_point"]["px"] = to_json_vector(calibrated.worked_point.px);
  return json;
}

CamFromWorld read_pose(const JsonNode& node) {
  CamFromWorld pose{node.matrix3("rotation"), node.vector3("translation_mm") * mm};
  const double error =
      (pose.rotation * pose.rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error > 1e-6 || pose.rotation.determinant() < 0)
    node.reject("rotation", "the matrix is not a rotation");
  return pose;
}

/// Names and a matrix of that size under `prefix`_parameters and `prefix`.
void read_covariance(const JsonNode& node, const std::string& prefix,
                     std::vector<std::string>& names, Eigen::MatrixXd& covariance) {
  const std::string key = prefix + "_parameters";
  names = node.texts(key);
  covariance = node.matrix(prefix);
  const auto parameters = static_cast<Eigen::Index>(names.size());
  if (covariance.rows() != parameters || covariance.cols() != parameters)
    node.reject(prefix, fmt::format("its size is not the number of {}", key));
}

CalibratedCamera read_camera(const JsonNode& node) {
  CalibratedCamera result;
  result.camera.name = node.name("name");
  result.camera.model = {read_lens(node.at("lens")), node.integer("width_px"),
                         node.integer("height_px")};
  result.camera.cam_from_world = read_pose(node.at("cam_from_world"));
  const JsonNode residuals = node.at("residuals");
  result.residuals = {residuals.integer("points"), residuals.number("rms_px"),
                      residuals.number("max_px"), residuals.number("object_rms_mm")};
  read_covariance(node, "covariance", result.covariance_parameters, result.covariance);
  result.valid_region_px = node.vector("valid_region_px", 4);
  const JsonNode worked = node.at("worked_point");
  result.worked_point = {worked.vector3("point_in_world_mm") * mm, worked.vector2("px")};
  const std::optional<Projection> px = project(
      result.camera.model, result.camera.cam_from_world * result.worked_point.point_in_world);
  if (!px || (px->px - result.worked_point.px).norm() > 1e-6)
    worked.reject("px", "the worked point does not land on its pixel: the file was altered");
  return result;
}

}  // namespace

const CalibratedCamera& Calibration::camera(const std::string& name) const {
  for (const CalibratedCamera& candidate : cameras)
    if (candidate.camera.name == name) return candidate;
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
  const JsonNode root = JsonNode::open(file, "calibration", kCalibrationVersion);
  Calibration calibration;
  calibration.method = root.text("method");
  calibration.rig = root.text("rig");
  calibration.sets = root.texts("sets");
  calibration.warnings = root.texts("warnings");
  calibration.no_go = root.optional_text("no_go");
  for (const JsonNode& node : root.items("cameras"))
    calibration.cameras.push_back(read_camera(node));
  if (root.has("joint_covariance")) {
    read_covariance(root, "joint_covariance", calibration.joint_covariance_parameters,
                    calibration.joint_covariance);
  }
  return calibration;
}

void write_calibration(const std::filesystem::path& file, const Calibration& calibration) {
  Json json;
  json["schema"] = fmt::format("drapebench/calibration/{}", kCalibrationVersion);
  json["method"] = calibration.method;
  json["rig"] = calibration.rig;
  json["sets"] = calibration.sets;
  json["no_go"] = calibration.no_go ? Json(*calibration.no_go) : Json();
  json["warnings"] = calibration.warnings;
  json["cameras"] = Json::array();
  for (const CalibratedCamera& camera : calibration.cameras)
    json["cameras"].push_back(json_of(camera));
  if (!calibration.joint_covariance_parameters.empty()) {
    json["joint_covariance_parameters"] = calibration.joint_covariance_parameters;
    json["joint_covariance"] = to_json(calibration.joint_covariance);
  }
  write_json(file, json);
}

}  // namespace drape
