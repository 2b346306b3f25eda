// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/exchange/exchange.hpp"

namespace drape::calib {

/// A camera with a Brown lens, ready for export.
struct BrownCamera {
  std::string name;
  BrownLens lens;
  int width_px = 0, height_px = 0;
  CamFromWorld cam_from_world;
};

[[nodiscard]] std::vector<ExportedFile> opencv_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> ros_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> dice_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> matlab_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> kalibr_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> colmap_files(const std::vector<BrownCamera>& cameras);
[[nodiscard]] std::vector<ExportedFile> mrcal_files(const std::vector<BrownCamera>& cameras);

/// Cameras in one file, with the names stated there.
[[nodiscard]] std::vector<Camera> cameras_of(const std::filesystem::path& file,
                                             ExchangeFormat format, const ImportOptions& options);

/// Rotation nearest to a matrix with rounded elements. Throws Error(bad_input) naming the field for
/// any other matrix.
[[nodiscard]] Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& matrix,
                                          const std::filesystem::path& file,
                                          const std::string& field);

}  // namespace drape::calib
