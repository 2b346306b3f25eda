// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/fields/fields.hpp"

namespace drape::calib {

/// Calibration file formats of other tools. All describe pinhole lenses with Brown's distortion and
/// poses of the camera from the world, but where a format loses the world.
enum class ExchangeFormat {
  opencv,  ///< one <camera>.yaml each, cv::FileStorage: camera_matrix, distortion_coefficients
  kalibr,  ///< camchain.yaml: pinhole-radtan, each camera from the one before (the world is lost)
  colmap,  ///< cameras.txt, images.txt, points3D.txt: OPENCV, or FULL_OPENCV when k3 is not zero
  mrcal,   ///< one <camera>.cameramodel each: LENSMODEL_OPENCV5
  ros,     ///< one <camera>.yaml each, as from camera_calibration, with the pose
  dice,    ///< cal.xml of Digital Image Correlation Engine, lengths in mm
  matlab,  ///< stereoParams of two cameras as text, lengths in mm (the world is lost)
};

/// A Brown lens that approximates another lens model.
struct BrownRefit {
  BrownLens lens;
  int points = 0;     ///< number of pixels compared, on a grid over the image
  double rms_px = 0;  ///< root mean square distance between the two projections
  double max_px = 0;  ///< largest distance
};

struct ExportOptions {
  double max_refit_px = 0.01;  ///< refuses an export that changes a projected pixel by more
};

struct ExportedFile {
  std::filesystem::path name;  ///< path relative to the folder of the export
  std::string text;
};

struct ExportResult {
  std::vector<ExportedFile> files;
  std::vector<std::string> cameras;  ///< in the order of the calibration
  std::vector<BrownRefit> refits;    ///< same order; zero differences if the lens is unchanged
};

/// Exports in the tool's unit of length (mm for DICe and MATLAB, else m) and with its pixel centres
/// (COLMAP: corner pixel centred at (0.5, 0.5)). Throws Error(bad_input) naming the camera whose
/// lens differs by more than allowed.
[[nodiscard]] ExportResult export_calibration(const Calibration& calibration, ExchangeFormat format,
                                              const ExportOptions& options);

struct ImportOptions {
  /// Length of one unit of the file; default: a metre for OpenCV, ROS, Kalibr and mrcal, a
  /// millimetre for DICe, MATLAB's WorldUnits; required for COLMAP.
  std::optional<double> unit_m;
};

/// Reads cameras from one file. OpenCV, ROS (a pose requires the keys cam_from_world_rotation and
/// cam_from_world_translation_m, or rvec and tvec) and mrcal files hold one, named after the file;
/// Kalibr, DICe, MATLAB and COLMAP (cameras.txt, with images.txt beside it) several. Throws
/// Error(bad_input) naming file and field for a lens that Brown's five terms cannot represent, an
/// unknown key, an impossible matrix element, a missing pose, or a number that is not finite.
[[nodiscard]] std::vector<CalibratedCamera> import_cameras(const std::filesystem::path& file,
                                                           ExchangeFormat format,
                                                           const ImportOptions& options = {});

/// Calibration made of imported cameras. It has no residuals or covariance and warns of that.
[[nodiscard]] Calibration import_calibration(const std::vector<std::filesystem::path>& files,
                                             ExchangeFormat format, const std::string& rig,
                                             const ImportOptions& options = {});

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::ExchangeFormat>[] = {
    "opencv", "kalibr", "colmap", "mrcal", "ros", "dice", "matlab"};
