// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/calibration.hpp"

#include "core/fields/fields.hpp"

namespace drape::calib {

/// File formats of other tools for a calibration. All of them have pinhole lenses with Brown's
/// distortion; all poses are camera from world.
enum class ExchangeFormat {
  opencv,  ///< one <camera>.yaml each, cv::FileStorage: camera_matrix, distortion_coefficients
  kalibr,  ///< camchain.yaml: pinhole-radtan, each camera from the one before (the world is lost)
  colmap,  ///< cameras.txt, images.txt, points3D.txt: OPENCV, or FULL_OPENCV when k3 is not zero
  mrcal,   ///< one <camera>.cameramodel each: LENSMODEL_OPENCV5
};

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::ExchangeFormat>[] = {
    "opencv", "kalibr", "colmap", "mrcal"};

namespace drape::calib {

/// A Brown lens that stands for another lens model.
struct BrownRefit {
  BrownLens lens;
  int points = 0;     ///< pixels compared, a grid over the image
  double rms_px = 0;  ///< root mean square distance between the two projections
  double max_px = 0;  ///< largest distance
};

enum class BrownTerms { k1_k2_p1_p2, k1_k2_p1_p2_k3 };

/// Brown lens nearest to a lens model over its whole image: least squares of the pixels that both
/// give for the same rays. Without k3, or for Tsai's lens (which works from distorted to
/// undistorted), the two cannot be equal: the figures say by how much they differ. Throws
/// Error(bad_input) when the model has rays for fewer than half of the image.
[[nodiscard]] BrownRefit refit_as_brown(const CameraModel& model, BrownTerms terms);

struct ExportOptions {
  double max_refit_px = 0.01;  ///< refused when a lens changes by more anywhere in the image
};

struct ExportedFile {
  std::filesystem::path name;  ///< relative to the folder of the export
  std::string text;
};

struct ExportResult {
  std::vector<ExportedFile> files;
  std::vector<std::string> cameras;  ///< in the calibration's order
  std::vector<BrownRefit> refits;    ///< the same; zero differences where the lens stayed as it is
};

/// Lengths in metres, pixel centres as the tool counts them (COLMAP: the corner pixel's centre is
/// (0.5, 0.5)). Throws Error(bad_input) naming the camera whose lens differs by more than allowed.
[[nodiscard]] ExportResult export_calibration(const Calibration& calibration, ExchangeFormat format,
                                              const ExportOptions& options);

/// One camera from one file of OpenCV (a pose needs the keys cam_from_world_rotation and
/// cam_from_world_translation_m, or rvec and tvec in metres) or mrcal (a pose in metres), named
/// after the file. Throws Error(bad_input) naming file and field: a lens model that Brown's five
/// terms cannot hold, no pose, no image size, a number that is not finite.
[[nodiscard]] CalibratedCamera import_camera(const std::filesystem::path& file,
                                             ExchangeFormat format);

/// A calibration of imported cameras. It has no residuals and no covariance, and warns of it.
[[nodiscard]] Calibration import_calibration(const std::vector<std::filesystem::path>& files,
                                             ExchangeFormat format, const std::string& rig);

}  // namespace drape::calib
