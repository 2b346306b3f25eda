// SPDX-License-Identifier: Apache-2.0
#include "calib/exchange/exchange.hpp"

#include <fmt/args.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <ranges>
#include <set>

#include "calib/exchange/formats.hpp"
#include "core/camera_model.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d, Eigen::VectorXd;

namespace {

enum class BrownTerms { k1_k2_p1_p2, k1_k2_p1_p2_k3 };

constexpr int kColumns = 41, kRows = 31;  // grid of compared pixels, corners included
constexpr int kSteps = 30;

struct Ray {
  Vector3d direction;
  Vector2d px;
};

std::vector<Ray> rays_of(const CameraModel& model) {
  std::vector<Ray> rays;
  for (int row = 0; row < kRows; ++row) {
    for (int col = 0; col < kColumns; ++col) {
      const Vector2d px((model.width_px - 1) * col / (kColumns - 1.0),
                        (model.height_px - 1) * row / (kRows - 1.0));
      if (const auto ray = unproject(model, px)) rays.push_back({*ray, px});
    }
  }
  return rays;
}

BrownLens start_of(const CameraModel& model) {
  if (const auto* brown = std::get_if<BrownLens>(&model.lens)) return *brown;
  const auto& tsai = std::get<TsaiLens>(model.lens);
  BrownLens lens;
  lens.fx_px = tsai.scale_x * tsai.focal_m / tsai.pixel_pitch_x_m;
  lens.fy_px = tsai.focal_m / tsai.pixel_pitch_y_m;
  lens.cx_px = tsai.cx_px;
  lens.cy_px = tsai.cy_px;
  return lens;
}

/// Terms of the lens in the order of parameter_names().
std::vector<double*> terms_of(BrownLens& lens, BrownTerms terms) {
  std::vector<double*> all = {&lens.fx_px, &lens.fy_px, &lens.cx_px, &lens.cy_px, &lens.k1,
                              &lens.k2,    &lens.p1,    &lens.p2,    &lens.k3};
  if (terms == BrownTerms::k1_k2_p1_p2) all.pop_back();
  return all;
}

/// One Gauss-Newton step; returns its size in pixels. The models are close, so it needs no damping.
double improve(const std::vector<Ray>& rays, const CameraModel& shape, BrownTerms terms,
               BrownLens& lens) {
  const auto parameters = terms_of(lens, terms);
  const auto count = static_cast<Eigen::Index>(parameters.size());
  const CameraModel model{lens, shape.width_px, shape.height_px};
  MatrixXd jacobian = MatrixXd::Zero(2 * rays.size(), count);
  VectorXd residuals = VectorXd::Zero(2 * rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto image = project(model, rays[i].direction);
    const auto by_lens = d_px_d_lens(model, rays[i].direction);
    if (!image || !by_lens) continue;
    const auto row = 2 * static_cast<Eigen::Index>(i);
    residuals.segment<2>(row) = rays[i].px - image->px;
    jacobian.middleRows<2>(row) = by_lens->leftCols(count);
  }
  // Scales terms of very different size; a term that the image does not determine stays unchanged.
  const VectorXd scale = jacobian.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const MatrixXd scaled = jacobian * scale.asDiagonal();
  const VectorXd step = least_squares(scaled, residuals);
  for (Eigen::Index i = 0; i < count; ++i) *parameters[i] += scale[i] * step[i];
  return (scaled * step).lpNorm<Eigen::Infinity>();
}

BrownRefit compared(const std::vector<Ray>& rays, const CameraModel& shape, const BrownLens& lens) {
  BrownRefit refit;
  refit.lens = lens;
  const CameraModel model{lens, shape.width_px, shape.height_px};
  double sum = 0;
  for (const Ray& ray : rays) {
    const auto image = project(model, ray.direction);
    const double distance = image ? (image->px - ray.px).norm() : HUGE_VAL;
    sum += distance * distance;
    refit.max_px = std::max(refit.max_px, distance);
  }
  refit.points = static_cast<int>(rays.size());
  refit.rms_px = std::sqrt(sum / static_cast<double>(rays.size()));
  return refit;
}

/// Best approximation of a lens model by a Brown lens over the whole image: least squares of the
/// pixels of common rays. It is not exact without k3 or for Tsai's lens (which maps distorted to
/// undistorted); the figures state the difference. Throws Error(bad_input) if the model has rays
/// for less than half of the image.
BrownRefit refit_as_brown(const CameraModel& model, BrownTerms terms) {
  const auto* brown = std::get_if<BrownLens>(&model.lens);
  if (brown != nullptr && (terms == BrownTerms::k1_k2_p1_p2_k3 || brown->k3 == 0)) {
    return {*brown, 0, 0, 0};
  }
  const auto rays = rays_of(model);
  if (2 * rays.size() < static_cast<std::size_t>(kColumns) * kRows) {
    throw bad_input("the lens model has no rays for more than half of the image", {},
                    "calibrate again with the target over the whole image");
  }
  BrownLens lens = start_of(model);
  if (terms == BrownTerms::k1_k2_p1_p2) lens.k3 = 0;
  for (int i = 0; i < kSteps && improve(rays, model, terms, lens) > 1e-10; ++i) {
  }
  return compared(rays, model, lens);
}

/// Throws Error(bad_input) that names the file unless the camera is one that a calibration may
/// hold.
void check_imported(CalibratedCamera calibrated, const std::filesystem::path& file) {
  const Camera& camera = calibrated.camera;
  const auto& lens = std::get<BrownLens>(camera.model.lens);
  calibrated.worked_point = {camera.cam_from_world.inverse() * Vector3d(0, 0, 0.5),
                             {lens.cx_px, lens.cy_px}};
  Calibration one;
  one.method = "imported";
  one.cameras = {calibrated};
  std::vector<Error> faults =
      faults_of_reading(Document(Syntax::json, value_of(one)), walk_through(one));
  for (Error& fault : faults)
    fault = bad_input(fault.what_failed(),
                      {.file = file.string(), .field = fault.where().field, .camera = camera.name},
                      "export the camera again");
  throw_if_any(std::move(faults));
}

/// Fills a pattern with a camera's values: `n` its number, `k` the lens, `r` rows of the rotation,
/// `w` its vector (rad), `q` its quaternion, `t` the translation in `unit_m`. The principal point
/// is shifted to the pixel centres of the tool.
std::string filled(const char* pattern, std::size_t number, const Camera& camera,
                   double shift_px = 0, double unit_m = 1) {
  const auto& lens = std::get<BrownLens>(camera.model.lens);
  const auto& [rotation, translation_m] = camera.cam_from_world;
  const Eigen::Quaterniond q(rotation);
  Eigen::Matrix<double, 28, 1> numbers;
  numbers << lens.fx_px, lens.fy_px, lens.cx_px + shift_px, lens.cy_px + shift_px, lens.k1, lens.k2,
      lens.p1, lens.p2, lens.k3, translation_m / unit_m, rotation_vector(rotation), q.w(), q.vec(),
      rotation.row(0).transpose(), rotation.row(1).transpose(), rotation.row(2).transpose();
  fmt::dynamic_format_arg_store<fmt::format_context> values;
  values.push_back(fmt::arg("n", number));
  values.push_back(fmt::arg("name", camera.name));
  values.push_back(fmt::arg("width", camera.model.width_px));
  values.push_back(fmt::arg("height", camera.model.height_px));
  const double* number_at = numbers.data();
  for (const auto name : std::views::split(
           std::string_view("fx fy cx cy k1 k2 p1 p2 k3 tx ty tz wx wy wz qw qx qy qz "
                            "r00 r01 r02 r10 r11 r12 r20 r21 r22"),
           ' '))
    values.push_back(fmt::arg(std::string(name.begin(), name.end()).c_str(), *number_at++));
  return fmt::vformat(pattern, values);
}

constexpr const char* kRos = R"(image_width: {width}
image_height: {height}
camera_name: {name}
camera_matrix:
  rows: 3
  cols: 3
  data: [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [{k1}, {k2}, {p1}, {p2}, {k3}]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [{fx}, 0, {cx}, 0, 0, {fy}, {cy}, 0, 0, 0, 1, 0]
cam_from_world_rotation:
  rows: 3
  cols: 3
  data: [{r00}, {r01}, {r02}, {r10}, {r11}, {r12}, {r20}, {r21}, {r22}]
cam_from_world_translation_m:
  rows: 3
  cols: 1
  data: [{tx}, {ty}, {tz}]
)";

constexpr const char* kMrcal = R"(# written by drapebench; pose: camera from world, rad and m
{{
    'lensmodel':  'LENSMODEL_OPENCV5',
    'intrinsics': [ {fx}, {fy}, {cx}, {cy}, {k1}, {k2}, {p1}, {p2}, {k3} ],
    'extrinsics': [ {wx}, {wy}, {wz}, {tx}, {ty}, {tz} ],
    'imagersize': [ {width}, {height} ]
}}
)";

/// Pose of a camera relative to the one before it.
constexpr const char* kKalibrStep = R"(  T_cn_cnm1:
  - [{r00}, {r01}, {r02}, {tx}]
  - [{r10}, {r11}, {r12}, {ty}]
  - [{r20}, {r21}, {r22}, {tz}]
  - [0.0, 0.0, 0.0, 1.0]
)";
constexpr const char* kKalibr = R"(  camera_model: pinhole
  distortion_coeffs: [{k1}, {k2}, {p1}, {p2}]
  distortion_model: radtan
  intrinsics: [{fx}, {fy}, {cx}, {cy}]
  resolution: [{width}, {height}]
  rostopic: /{name}/image_raw
)";

constexpr const char* kDice = R"(  <ParameterList name="CAMERA {n}">
    <Parameter name="CAMERA_ID" type="string" value="{name}" />
    <Parameter name="CX" type="double" value="{cx}" />
    <Parameter name="CY" type="double" value="{cy}" />
    <Parameter name="FX" type="double" value="{fx}" />
    <Parameter name="FY" type="double" value="{fy}" />
    <Parameter name="K1" type="double" value="{k1}" />
    <Parameter name="K2" type="double" value="{k2}" />
    <Parameter name="K3" type="double" value="{k3}" />
    <Parameter name="P1" type="double" value="{p1}" />
    <Parameter name="P2" type="double" value="{p2}" />
    <Parameter name="TX" type="double" value="{tx}" />
    <Parameter name="TY" type="double" value="{ty}" />
    <Parameter name="TZ" type="double" value="{tz}" />
    <Parameter name="LENS_DISTORTION_MODEL" type="string" value="OPENCV_LENS_DISTORTION" />
    <Parameter name="IMAGE_HEIGHT_WIDTH" type="string" value="{{ {height}, {width} }}" />
    <ParameterList name="rotation_3x3_matrix">
      <Parameter name="ROW 0" type="string" value="{{ {r00}, {r01}, {r02} }}" />
      <Parameter name="ROW 1" type="string" value="{{ {r10}, {r11}, {r12} }}" />
      <Parameter name="ROW 2" type="string" value="{{ {r20}, {r21}, {r22} }}" />
    </ParameterList>
  </ParameterList>
)";

constexpr const char* kMatlab =
    R"(stereoParams.CameraParameters{n}.IntrinsicMatrix = [{fx}, 0, 0; 0, {fy}, 0; {cx}, {cy}, 1];
stereoParams.CameraParameters{n}.RadialDistortion = [{k1}, {k2}, {k3}];
stereoParams.CameraParameters{n}.TangentialDistortion = [{p1}, {p2}];
stereoParams.CameraParameters{n}.ImageSize = [{height}, {width}];
stereoParams.CameraParameters{n}.WorldUnits = 'millimeters';
)";
constexpr const char* kMatlabPair =
    "stereoParams.RotationOfCamera2 = [{r00}, {r10}, {r20}; {r01}, {r11}, {r21}; {r02}, {r12}, "
    "{r22}];\nstereoParams.TranslationOfCamera2 = [{tx}, {ty}, {tz}];\n";

template <class Matrix>
cv::Mat matrix_of(const Matrix& values) {
  cv::Mat matrix(static_cast<int>(values.rows()), static_cast<int>(values.cols()), CV_64F);
  for (int row = 0; row < matrix.rows; ++row) {
    for (int col = 0; col < matrix.cols; ++col) matrix.at<double>(row, col) = values(row, col);
  }
  return matrix;
}

std::string opencv_text(const Camera& camera) {
  const auto& lens = std::get<BrownLens>(camera.model.lens);
  Eigen::Matrix3d k;
  k << lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1;
  Eigen::Matrix<double, 1, 5> distortion;
  distortion << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3;
  cv::FileStorage storage(
      ".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  storage << "image_width" << camera.model.width_px << "image_height" << camera.model.height_px;
  storage << "camera_name" << camera.name;
  storage << "camera_matrix" << matrix_of(k);
  storage << "distortion_model"
          << "plumb_bob";
  storage << "distortion_coefficients" << matrix_of(distortion);
  storage << "cam_from_world_rotation" << matrix_of(camera.cam_from_world.rotation);
  storage << "cam_from_world_translation_m" << matrix_of(camera.cam_from_world.translation_m);
  return storage.releaseAndGetString();
}

/// The camera with its pose relative to another one instead of to the world.
Camera relative(Camera camera, const Camera& to) {
  CamFromWorld& pose = camera.cam_from_world;
  const CamFromWorld& from = to.cam_from_world;
  pose.rotation = (pose.rotation * from.rotation.transpose()).eval();
  pose.translation_m -= pose.rotation * from.translation_m;
  return camera;
}

std::vector<ExportedFile> files_of(const std::vector<Camera>& cameras, ExchangeFormat format) {
  const auto one_each = [&](const char* extension, const auto& text_of) {
    std::vector<ExportedFile> files;
    for (const Camera& camera : cameras)
      files.push_back({camera.name + extension, text_of(camera)});
    return files;
  };
  const auto joined = [&](const char* pattern, std::size_t first, double shift_px, double unit_m) {
    std::string text;
    for (std::size_t i = 0; i < cameras.size(); ++i)
      text += filled(pattern, i + first, cameras[i], shift_px, unit_m);
    return text;
  };
  switch (format) {
    case ExchangeFormat::opencv:
      return one_each(".yaml", opencv_text);
    case ExchangeFormat::ros:
      return one_each(".yaml", [](const Camera& camera) { return filled(kRos, 0, camera); });
    case ExchangeFormat::mrcal:
      return one_each(".cameramodel",
                      [](const Camera& camera) { return filled(kMrcal, 0, camera); });
    case ExchangeFormat::kalibr: {
      std::string text;
      for (std::size_t i = 0; i < cameras.size(); ++i)
        text += fmt::format("cam{}:\n", i) +
                (i > 0 ? filled(kKalibrStep, i, relative(cameras[i], cameras[i - 1])) : "") +
                filled(kKalibr, i, cameras[i]);
      return {{"camchain.yaml", text}};
    }
    case ExchangeFormat::dice:
      return {{"cal.xml", fmt::format(R"(<?xml version="1.0"?>
<ParameterList>
  <Parameter name="xml_file_format" type="string" value="DICe_xml_camera_system_file" />
  <Parameter name="system_type_3D" type="string" value="GENERIC_SYSTEM" />
  <Parameter name="extrinsics_relative_camera_to_camera" type="bool" value="false" />
{}</ParameterList>
)",
                                      joined(kDice, 0, 0, units::mm))}};
    case ExchangeFormat::matlab:
      if (cameras.size() != 2)
        throw usage_error(
            fmt::format("stereoParameters has two cameras, the calibration {}", cameras.size()),
            "write for another tool");
      return {{"stereoParams.m",
               "% written by drapebench: fields of a struct for stereoParameters()\n" +
                   joined(kMatlab, 1, 1, 1) +  // the corner pixel's centre is (1, 1)
                   filled(kMatlabPair, 2, relative(cameras[1], cameras[0]), 0, units::mm)}};
    case ExchangeFormat::colmap: {
      std::string lenses =
          "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS; written by drapebench, lengths in m\n";
      for (std::size_t i = 0; i < cameras.size(); ++i) {
        const bool full = std::get<BrownLens>(cameras[i].model.lens).k3 != 0;
        // COLMAP's corner pixel has its centre at (0.5, 0.5).
        lenses += filled(full ? "{n} FULL_OPENCV {width} {height} {fx} {fy} {cx} {cy} {k1} {k2} "
                                "{p1} {p2} {k3} 0 0 0\n"
                              : "{n} OPENCV {width} {height} {fx} {fy} {cx} {cy} {k1} {k2} {p1} "
                                "{p2}\n",
                         i + 1, cameras[i], 0.5);
      }
      return {{"cameras.txt", lenses},
              {"images.txt",
               "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then POINTS2D (none); lengths in "
               "m\n" +
                   joined("{n} {qw} {qx} {qy} {qz} {tx} {ty} {tz} {n} {name}.png\n\n", 1, 0, 1)},
              {"points3D.txt", "# no points\n"}};
    }
  }
  throw internal_error("a format of no name");
}

}  // namespace

ExportResult export_calibration(const Calibration& calibration, ExchangeFormat format,
                                const ExportOptions& options) {
  if (calibration.no_go)
    throw bad_input("the calibration is NO-GO: " + *calibration.no_go, {.field = "no_go"},
                    "calibrate again; the files of other tools have no place for its verdict");
  // Kalibr's radtan has four terms; the other formats have k3.
  const BrownTerms terms =
      format == ExchangeFormat::kalibr ? BrownTerms::k1_k2_p1_p2 : BrownTerms::k1_k2_p1_p2_k3;
  ExportResult result;
  std::vector<Camera> cameras;
  for (const CalibratedCamera& calibrated : calibration.cameras) {
    const Camera& camera = calibrated.camera;
    const BrownRefit refit = refit_as_brown(camera.model, terms);
    if (!(refit.max_px <= options.max_refit_px)) {
      throw bad_input(
          fmt::format("the lens cannot be written in this format: it would change by up to {:.4f} "
                      "px (RMS {:.4f} px), the limit is {:g} px",
                      refit.max_px, refit.rms_px, options.max_refit_px),
          {.camera = camera.name}, "choose another format, or allow more with --max-refit-px");
    }
    cameras.push_back(camera);
    cameras.back().model.lens = refit.lens;
    result.cameras.push_back(camera.name);
    result.refits.push_back(refit);
  }
  result.files = files_of(cameras, format);
  return result;
}

std::vector<CalibratedCamera> import_cameras(const std::filesystem::path& file,
                                             ExchangeFormat format, const ImportOptions& options) {
  std::vector<CalibratedCamera> result;
  for (Camera& camera : cameras_of(file, format, options)) {
    require_plain_name(camera.name, {.file = file.string()});
    CalibratedCamera& calibrated = result.emplace_back();
    calibrated.camera = std::move(camera);
    check_imported(calibrated, file);
    // Half a metre away, through the centre of the upper left quadrant, where distortion is
    // visible.
    const auto& [name, model, pose] = calibrated.camera;
    const auto ray = unproject(model, {model.width_px / 4.0, model.height_px / 4.0});
    calibrated.worked_point.point_in_world = pose.inverse() * (0.5 * ray.value());
    calibrated.worked_point.px = project(model, pose * calibrated.worked_point.point_in_world)->px;
  }
  if (result.empty())
    throw bad_input("the file holds no camera", {.file = file.string()}, "give the right file");
  return result;
}

Calibration import_calibration(const std::vector<std::filesystem::path>& files,
                               ExchangeFormat format, const std::string& rig,
                               const ImportOptions& options) {
  Calibration calibration;
  calibration.method = "imported";
  calibration.rig = rig;
  std::set<std::string> names;
  for (const auto& file : files) {
    for (CalibratedCamera& camera : import_cameras(file, format, options)) {
      if (!names.insert(camera.camera.name).second) {
        throw bad_input(fmt::format("two cameras are called `{}`", camera.camera.name),
                        {.file = file.string()}, "name each after its own pictures");
      }
      calibration.cameras.push_back(std::move(camera));
    }
  }
  calibration.warnings.emplace_back(
      "imported: no residuals, no covariance; the error budget of a sheet lacks the calibration");
  const CamFromWorld& first = calibration.cameras.front().camera.cam_from_world;
  if (calibration.cameras.size() > 1 && first.translation_m.isZero() && first.rotation.isIdentity())
    calibration.warnings.push_back(
        fmt::format("the world is the frame of camera {}: x right, y down, z forward",
                    calibration.cameras.front().camera.name));
  return calibration;
}

}  // namespace drape::calib
