// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/fields/fields.hpp"
#include "core/program/program.hpp"

namespace drape {

/// Content of a folder of pictures: one view by all cameras, or all views of one camera.
enum class FoldersOf { views, cameras };

struct CalibImagesOptions {
  std::filesystem::path folder;     ///< folder of the images
  std::string board;                ///< inner corners as COLSxROWS, e.g. "9x6"
  std::optional<double> square_mm;  ///< side of a square
  std::filesystem::path target;     ///< target.toml of any kind, instead of `board` and `square_mm`
  std::optional<FoldersOf> folders;  ///< absent if inferred from the number of folders
  double thickness_mm = 0;           ///< distance between the sides of a two-sided target
  std::filesystem::path out;
  std::filesystem::path lens_from;  ///< calibration.json with known lenses; can be empty
};

void fields(Fields& f, CalibImagesOptions& options);

/// `drape calib images`: calibrates from a plain folder of chessboard pictures in one command.
/// Images are FOLDER/<camera><number>.<ending> (left01.jpg, right01.jpg, cam2_07_int.png: the
/// number with the most distinct values is the view), FOLDER/<view>/<camera>.<ending> or
/// FOLDER/<camera>/<number>.<ending>; a view may lack a camera. Makes a recording and a rig in the
/// output folder, then runs `drape import`, `drape detect` and `drape calib --method joint`.
/// Returns the exit code. Throws Error(usage, bad_input) for an unusable board or folder, and for
/// an output folder that holds anything but an earlier run's files.
[[nodiscard]] int calibrate_images(const CalibImagesOptions& options, const CommonOptions& common);

}  // namespace drape
