// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape {

/// A picture's name without its extension: camera and number of the view.
struct PictureName {
  std::string camera;  ///< empty if the name is only a number
  std::string view;
};

/// Reads the names of pictures of one or several cameras. Among the numbers at the same
/// position in all names, the one with the most different values is the view (the last, if
/// equal); if the names differ in form, it is the last number of each. Date and time count as
/// one number, and only if the names are not distinguished without them. Leading zeros are
/// ignored (img2, img02), and numbers are written with equal width. A name without a number is
/// a separate view.
[[nodiscard]] std::vector<PictureName> read_picture_names(const std::vector<std::string>& names);

/// `drape calib images`: calibrates from a plain folder of chessboard pictures in one command.
/// Images are FOLDER/<camera><number>.<ending> (left01.jpg, right01.jpg, cam2_07_int.png: the
/// number with the most distinct values is the view), FOLDER/<view>/<camera>.<ending> or
/// FOLDER/<camera>/<number>.<ending>; a view may lack a camera. Makes a recording and a rig in the
/// output folder, then runs `drape import`, `drape detect` and `drape calib --method joint`.
/// Returns the exit code. Refuses an unusable board or folder, and an output folder that holds
/// anything but an earlier run's files.
[[nodiscard]] int calib_images_command(int argc, char** argv);

}  // namespace drape
