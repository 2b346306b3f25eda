// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape {

/// `drape calib images`: calibrates from a plain folder of chessboard pictures in one command.
/// Images are FOLDER/<camera><number>.<ending> (left01.jpg, right01.jpg, cam2_07_int.png: the
/// number with the most distinct values is the view), FOLDER/<view>/<camera>.<ending> or
/// FOLDER/<camera>/<number>.<ending>; a view may lack a camera. Makes a recording and a rig in the
/// output folder, then runs `drape import`, `drape detect` and `drape calib --method joint`.
/// Returns the exit code. Refuses an unusable board or folder, and an output folder with files
/// other than those of an earlier run.
[[nodiscard]] int calib_images_command(int argc, char** argv);

}  // namespace drape
