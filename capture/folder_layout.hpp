// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "capture/capture.hpp"
#include "core/error.hpp"
#include "core/files/picture_layout.hpp"

namespace drape::capture {

/// Natural order of names: runs of digits compare as numbers, so "set2" comes before "set10". A
/// total order: only identical names are equal.
[[nodiscard]] bool natural_less(std::string_view a, std::string_view b);

struct FolderLayout {
  /// Sets in natural order, and cameras likewise within each; frames hold camera and file only.
  std::vector<FrameSet> sets;
  std::vector<IgnoredFile> ignored;
  /// Path of a picture, by its file in the recording, if it differs from its file in the folder.
  std::map<std::string, std::filesystem::path> places;

  [[nodiscard]] std::filesystem::path place(const std::filesystem::path& folder,
                                            const std::string& file) const {
    const auto found = places.find(file);
    return found == places.end() ? folder / file : found->second;
  }
};

/// Throws if a name cannot be that of a set or camera: see require_plain_name(); must be UTF-8.
void require_utf8_name(const std::string& name, const Where& where);

/// Finds the images below `folder` by set and camera, without opening them. Throws Error(bad_input)
/// for a folder without sets, a set without images, an unusable name, or two images of one camera;
/// proposes a layout that fits the names.
[[nodiscard]] FolderLayout read_layout(const std::filesystem::path& folder,
                                       PictureLayout layout = PictureLayout::sets);

/// Image files of all set folders relative to `folder`, in natural order.
[[nodiscard]] std::vector<std::string> image_files_below(const std::filesystem::path& folder);

/// The cameras of all sets. If a set lacks one, throws Error(bad_input) naming both, or adds that
/// message to `missing` if given.
[[nodiscard]] std::vector<std::string> require_same_cameras(
    const std::filesystem::path& folder, const FolderLayout& layout,
    std::vector<std::string>* missing = nullptr);

}  // namespace drape::capture
