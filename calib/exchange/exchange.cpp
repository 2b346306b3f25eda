// SPDX-License-Identifier: Apache-2.0
#include "calib/exchange/exchange.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <set>

#include "calib/exchange/formats.hpp"
#include "core/error.hpp"

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
  }
  return result;
}

void check_imported(const Camera& camera, const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& what, const std::string& field) {
    return bad_input(what, {.file = file.string(), .field = field}, "export the camera again");
  };
  const auto& lens = std::get<BrownLens>(camera.model.lens);
  const Eigen::Matrix3d& rotation = camera.cam_from_world.rotation;
  Eigen::VectorXd numbers(12);
  numbers << lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.k1, lens.k2, lens.p1, lens.p2,
      lens.k3, camera.cam_from_world.translation_m;
  if (!numbers.allFinite() || !rotation.allFinite())
    throw refuse("a number of the camera is not finite", "");
  if (!(lens.fx_px > 0 && lens.fy_px > 0))
    throw refuse("the focal length is not positive", "focal length");
  if (camera.model.width_px < 1 || camera.model.height_px < 1)
    throw refuse("the image has no size", "image size");
  const bool orthonormal =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6;
  if (!orthonormal || rotation.determinant() < 0)
    throw refuse("the matrix is not a rotation", "rotation");
}

CalibratedCamera import_camera(const std::filesystem::path& file, ExchangeFormat format) {
  CalibratedCamera result;
  switch (format) {
    case ExchangeFormat::opencv:
      result.camera = camera_of_opencv(file);
      break;
    case ExchangeFormat::mrcal:
      result.camera = camera_of_mrcal(file);
      break;
    default:
      throw usage_error("only files of OpenCV and mrcal can be imported",
                        "give --from opencv or --from mrcal");
  }
  result.camera.name = file.stem().string();
  check_imported(result.camera, file);
  // The worked point is 0.5 m away, imaged in the upper left quadrant, where distortion is visible.
  const CameraModel& model = result.camera.model;
  const auto ray = unproject(model, {model.width_px / 4.0, model.height_px / 4.0});
  if (!ray) {
    throw bad_input("the lens folds over inside the image", {.file = file.string()},
                    "calibrate with fewer distortion terms");
  }
  result.worked_point.point_in_world = result.camera.cam_from_world.inverse() * (0.5 * *ray);
  result.worked_point.px =
      project(model, result.camera.cam_from_world * result.worked_point.point_in_world)->px;
  return result;
}

Calibration import_calibration(const std::vector<std::filesystem::path>& files,
                               ExchangeFormat format, const std::string& rig) {
  Calibration calibration;
  calibration.method = "imported";
  calibration.rig = rig;
  std::set<std::string> names;
  for (const auto& file : files) {
    calibration.cameras.push_back(import_camera(file, format));
    const std::string& name = calibration.cameras.back().camera.name;
    if (!names.insert(name).second) {
      throw bad_input(fmt::format("two files are called `{}`", name), {.file = file.string()},
                      "name each file after its camera");
    }
  }
  calibration.warnings.emplace_back(
      "imported: no residuals, no covariance; the error budget of a sheet lacks the calibration");
  return calibration;
}

}  // namespace drape::calib
