// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape {

/// A picture's name without its ending: the camera, and the view's number as written.
struct PictureName {
  std::string camera;  ///< empty where the name is nothing but the number
  std::string view;
};

/// Reads the names of one camera's or several cameras' pictures. Of the numbers that stand at the
/// same place in all names that with the most different values is the view, the last of equals;
/// where the names are not of one form the last number of each. A name without a number is a view
/// by itself.
[[nodiscard]] std::vector<PictureName> read_picture_names(const std::vector<std::string>& names);

}  // namespace drape
