// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/files/picture_layout.hpp"
#include "core/recording.hpp"

namespace drape::capture {

struct CaptureOptions {
  int threads = 1;  ///< images checked in parallel; never changes a result
  /// Receives the fraction done (0..1) and the file just finished; calls do not overlap.
  std::function<void(double, const std::string&)> progress = {};

  bool allow_missing = false;  ///< import: a set without a camera's image is only a warning
  PictureLayout layout = PictureLayout::sets;  ///< import: of the folder

  /// Date of the recording as ISO date (2026-01-31); absent if unknown.
  std::optional<std::string> recorded_on = {};

  void check() const;  ///< throws Error(usage)
};

// ---- import: converts images from elsewhere to a recording ---------------------------------

/// A file of the imported folder that is not part of the recording, with the reason.
struct IgnoredFile {
  std::string file;  ///< relative to the imported folder
  std::string reason;
};

struct ImportReport {
  std::vector<std::string> cameras;  ///< in natural order; a set that lacks one causes a warning
  std::size_t images = 0;
  std::uintmax_t image_bytes = 0;  ///< sum of the file sizes
  bool in_place = false;           ///< true if the imported folder itself becomes the recording
  std::vector<IgnoredFile> ignored;
  std::vector<std::string> warnings;  ///< e.g. two images with the same bytes
  std::vector<std::string> advice;    ///< another layout that the folder may have
  std::vector<std::pair<std::filesystem::path, std::string>> read;  ///< pictures, SHA-256
};

struct ImportResult {
  Recording recording;
  ImportReport report;
};

/// Throws the Error of import_folder() if the folder holds no sets of images or the recording would
/// lie inside it; writes nothing.
void require_importable(const std::filesystem::path& folder,
                        const std::filesystem::path& recording_folder,
                        PictureLayout layout = PictureLayout::sets);

/// Makes a recording of `folder`/<set>/<camera>.png|jpg|jpeg|tif|tiff, or of a folder in another
/// layout. Sets and cameras are in
/// natural order (set2 before set10). Every image is checked for completeness and decoded for its
/// size, then copied byte for byte into `recording_folder` (unless that is `folder` itself),
/// together with a set's capture.json, whose NO-GO is kept. recording.json is written last. A
/// refused import writes nothing.
///
/// Throws Error(bad_input) naming set, camera and file for an image that is truncated, unreadable
/// or of another size than that camera's first one, a camera missing from a set, two images of one
/// camera in a set, a folder without sets, and if `recording_folder` holds other images.
[[nodiscard]] ImportResult import_folder(const std::filesystem::path& folder,
                                         const std::filesystem::path& recording_folder,
                                         const CaptureOptions& options);

// ---- verify: compares a recording with its manifest ---------------------------------------

/// An image that is missing or no longer has the recorded bytes.
struct RecordingFault {
  std::string set;
  std::string camera;
  std::string file;  ///< relative to the recording's folder
  std::string what;
};

struct VerifyReport {
  std::size_t sets = 0;
  std::size_t images = 0;               ///< listed in the manifest
  std::vector<RecordingFault> faults;   ///< in the order of the manifest
  std::vector<std::string> not_listed;  ///< images in the set folders, absent from the manifest
  std::vector<std::string> no_go;       ///< sets that are no valid measurements, with reasons
  /// Sets of a running or killed capture that the manifest does not list yet.
  std::vector<std::string> in_journal;

  [[nodiscard]] bool good() const { return faults.empty(); }
};

/// Compares every image with its SHA-256 in recording.json and lists all faults, not just the
/// first. Throws Error(bad_input) only if the manifest itself is unusable.
[[nodiscard]] VerifyReport verify_recording(const std::filesystem::path& recording_folder,
                                            const CaptureOptions& options);

}  // namespace drape::capture
