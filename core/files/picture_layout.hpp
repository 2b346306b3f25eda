// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"

namespace drape {

/// Layout of a folder with the pictures of several cameras.
enum class PictureLayout {
  sets,     ///< FOLDER/<set>/<camera>.png
  cameras,  ///< FOLDER/<camera>/<set>.png, or with a number instead of the set
  names     ///< FOLDER/<camera><number>.png, or <set>_<camera>.png, or <camera>_<set>.png
};
template <>
inline constexpr std::string_view names_of<PictureLayout>[] = {"sets", "cameras", "names"};

/// A picture with set and camera, taken from its folder and name.
struct PlacedPicture {
  std::string set, camera;
  std::filesystem::path file;
};

/// True for the names of PNG, JPEG and TIFF files, but not for hidden ones.
[[nodiscard]] bool is_picture_name(const std::string& name);

/// Detects the layout of a folder: `cameras` if one of its folders holds more pictures than there
/// are folders, `names` if pictures lie in it directly, else `sets`.
[[nodiscard]] PictureLayout layout_found(const std::filesystem::path& folder);

/// Pictures of a folder in the layout `cameras` or `names`. Their names number the views of a
/// series (set `view_07`) or name the sets. Pictures without subfolders are read as a series with
/// read_picture_names(), unless the first or last word of their names gives fewer cameras, each
/// with every set. Throws Error(bad_input) for two pictures of one camera and set.
[[nodiscard]] std::vector<PlacedPicture> placed_pictures(const std::filesystem::path& folder,
                                                         PictureLayout layout);

/// A picture's name without its extension: camera and number of the view.
struct PictureName {
  std::string camera;  ///< empty if the name is only a number
  std::string view;
};

/// Reads the names of pictures of one or several cameras. Of the numbers at the same position
/// in all names, the one with the most distinct values is the view (the last, if equal); if
/// the names differ in form, it is the last number of each. Date and time count as one
/// number, used only if the names are ambiguous without them. Leading zeros are ignored
/// (img2, img02), and numbers are written with equal width. A name without a number is a
/// separate view.
[[nodiscard]] std::vector<PictureName> read_picture_names(const std::vector<std::string>& names);

}  // namespace drape
