// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape {

/// Parts of a picture's file name: camera, and number of the view as written.
struct PictureName {
  std::string camera;  ///< empty if the name is only a number
  std::string view;
};

/// Parses the names of pictures by one or several cameras. Of the numbers at the same position in
/// all names, the one with the most distinct values is the view, the last one on a tie; if the
/// names differ in form, it is the last number of each. A name without a number is a view by
/// itself.
[[nodiscard]] std::vector<PictureName> read_picture_names(const std::vector<std::string>& names);

}  // namespace drape
