// SPDX-License-Identifier: Apache-2.0
#include "calib/exchange/exchange.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <set>

#include "calib/exchange/formats.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::calib {

ExportResult export_calibration(const Calibration& calibration, ExchangeFormat format,
                                const ExportOptions& options) {
  if (calibration.no_go)
    throw bad_input("the calibration is NO-GO: " + *calibration.no_go, {.field = "no_go"},
                    "calibrate again; the files of other tools have no place for its verdict");
  // Kalibr's radtan has four terms; the other formats have k3.
  const BrownTerms terms =
      format == ExchangeFormat::kalibr ? BrownTerms::k1_k2_p1_p2 : BrownTerms::k1_k2_p1_p2_k3;
  ExportResult result;
  std::vector<BrownCamera> cameras;
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
    cameras.push_back({camera.name, refit.lens, camera.model.width_px, camera.model.height_px,
                       camera.cam_from_world});
    result.cameras.push_back(camera.name);
    result.refits.push_back(refit);
  }
  switch (format) {
    case ExchangeFormat::opencv:
      result.files = opencv_files(cameras);
      break;
    case ExchangeFormat::kalibr:
      result.files = kalibr_files(cameras);
      break;
    case ExchangeFormat::colmap:
      result.files = colmap_files(cameras);
      break;
    case ExchangeFormat::mrcal:
      result.files = mrcal_files(cameras);
      break;
    case ExchangeFormat::ros:
      result.files = ros_files(cameras);
      break;
    case ExchangeFormat::dice:
      result.files = dice_files(cameras);
      break;
    case ExchangeFormat::matlab:
      result.files = matlab_files(cameras);
      break;
  }
  return result;
}

namespace {

/// Throws Error(bad_input) that names the file unless the camera is valid.
void check_imported(const Camera& camera, const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& what, const std::string& field) {
    return bad_input(what, {.file = file.string(), .field = field, .camera = camera.name},
                     "export the camera again");
  };
  const auto& lens = std::get<BrownLens>(camera.model.lens);
  Eigen::VectorXd numbers(12);
  numbers << lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.k1, lens.k2, lens.p1, lens.p2,
      lens.k3, camera.cam_from_world.translation_m;
  if (!numbers.allFinite() || !camera.cam_from_world.rotation.allFinite())
    throw refuse("a number of the camera is not finite", "");
  if (!(lens.fx_px > 0 && lens.fy_px > 0))
    throw refuse("the focal length is not positive", "focal length");
  if (camera.model.width_px < 1 || camera.model.height_px < 1)
    throw refuse("the image has no size", "image size");
}

}  // namespace

std::vector<CalibratedCamera> import_cameras(const std::filesystem::path& file,
                                             ExchangeFormat format, const ImportOptions& options) {
  std::vector<CalibratedCamera> result;
  for (Camera& camera : cameras_of(file, format, options)) {
    camera.cam_from_world.rotation =
        rotation_of(camera.cam_from_world.rotation, file, "cam_from_world_rotation");
    require_plain_name(camera.name, {.file = file.string()});
    check_imported(camera, file);
    // Half a metre away, through the centre of the upper left quadrant, where distortion is
    // visible.
    const CameraModel& model = camera.model;
    const auto ray = unproject(model, {model.width_px / 4.0, model.height_px / 4.0});
    if (!ray) {
      throw bad_input("the lens folds over inside the image",
                      {.file = file.string(), .camera = camera.name},
                      "calibrate with fewer distortion terms");
    }
    CalibratedCamera& calibrated = result.emplace_back();
    calibrated.worked_point.point_in_world = camera.cam_from_world.inverse() * (0.5 * *ray);
    calibrated.worked_point.px =
        project(model, camera.cam_from_world * calibrated.worked_point.point_in_world)->px;
    calibrated.camera = std::move(camera);
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
