// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "core/error.hpp"

namespace drape::capture {

struct FolderLayout {
  /// In natural order, as are the cameras of each; a frame has its camera and its file alone.
  std::vector<FrameSet> sets;
  std::vector<IgnoredFile> ignored;
};

/// Refuses what cannot be the name of a set or camera in a file: require_plain_name(), and UTF-8.
void require_utf8_name(const std::string& name, const Where& where);

/// Images below `folder` by set and camera, without opening them. Throws Error(bad_input) for a
/// folder without sets, a set without images, an unusable name, or two images of one camera.
[[nodiscard]] FolderLayout read_layout(const std::filesystem::path& folder);

/// Image files of all set folders relative to `folder`, in natural order.
[[nodiscard]] std::vector<std::string> image_files_below(const std::filesystem::path& folder);

/// The cameras of all sets. Throws Error(bad_input) naming the set and the camera it lacks; with
/// `missing` it says so there instead.
[[nodiscard]] std::vector<std::string> require_same_cameras(
    const std::filesystem::path& folder, const FolderLayout& layout,
    std::vector<std::string>* missing = nullptr);

}  // namespace drape::capture
