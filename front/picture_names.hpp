// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape {

/// A picture's name without its ending: the camera, and the view's number.
struct PictureName {
  std::string camera;  ///< empty if the name is only a number
  std::string view;
};

/// Reads the names of one camera's or several cameras' pictures. Of the numbers that stand at the
/// same place in all names that with the most different values is the view, the last of equals;
/// where the names are not of one form the last number of each. Date and time count as one number,
/// and only where the names are not told apart without them. Numbers are equal whatever zeros stand
/// before them (img2, img02), and are written equally wide. A name without a number is a view by
/// itself.
[[nodiscard]] std::vector<PictureName> read_picture_names(const std::vector<std::string>& names);

}  // namespace drape
