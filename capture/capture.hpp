// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/recording.hpp"

namespace drape::capture {

struct CaptureOptions {
  int threads = 1;  ///< images checked at a time; never changes a result
  /// Called with the fraction done (0..1) and the file just done; one call at a time.
  std::function<void(double, const std::string&)> progress = {};

  bool allow_missing = false;  ///< import: a set may lack a camera's image, which is a warning

  /// ISO date (2026-01-31) that an import states; absent when nobody knows it.
  std::optional<std::string> recorded_on = {};

  void check() const;  ///< throws Error(usage)
};

// ---- import: images from elsewhere become a recording -------------------------------------

/// A file of the imported folder that is not part of the recording, and why.
struct IgnoredFile {
  std::string file;  ///< relative to the imported folder
  std::string reason;
};

struct ImportReport {
  std::vector<std::string> cameras;  ///< natural order; every set holds all, or is warned of
  std::size_t images = 0;
  std::uintmax_t image_bytes = 0;  ///< sum of the file sizes
  bool in_place = false;           ///< the recording is the imported folder itself
  std::vector<IgnoredFile> ignored;
  std::vector<std::string> warnings;  ///< e.g. two images with the same bytes
};

struct ImportResult {
  Recording recording;
  ImportReport report;
};

/// Throws Error as import_folder() does for a folder that holds no sets of images, or that the
/// recording would lie in; writes nothing.
void require_importable(const std::filesystem::path& folder,
                        const std::filesystem::path& recording_folder);

/// Makes a recording of `folder`/<set>/<camera>.png|jpg|jpeg|tif|tiff. Sets and cameras are in
/// natural order (set2 before set10). Every image is proved whole and decoded once for its size,
/// then copied byte for byte into `recording_folder` (not when that is `folder` itself), as is a
/// capture.json beside them, whose NO-GO stays; recording.json is written last. A refused import
/// writes nothing.
///
/// Throws Error(bad_input) naming set, camera and file for an image that is truncated, unreadable
/// or of another size than that camera's first one, a camera missing from a set, two images of one
/// camera in a set, a folder without sets, and when `recording_folder` already holds other images.
[[nodiscard]] ImportResult import_folder(const std::filesystem::path& folder,
                                         const std::filesystem::path& recording_folder,
                                         const CaptureOptions& options);

// ---- verify: does a recording still hold what was recorded? -------------------------------

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
  std::vector<RecordingFault> faults;   ///< in the manifest's order
  std::vector<std::string> not_listed;  ///< images in the set folders that the manifest lacks
  std::vector<std::string> no_go;       ///< sets that are no measurement, and why
  /// Sets of a capture that goes on, or was killed, which the manifest lacks.
  std::vector<std::string> in_journal;

  [[nodiscard]] bool good() const { return faults.empty(); }
};

/// Compares every image with its SHA-256 in recording.json and lists all faults, not just the
/// first. Throws Error(bad_input) only when the manifest itself cannot be used.
[[nodiscard]] VerifyReport verify_recording(const std::filesystem::path& recording_folder,
                                            const CaptureOptions& options);

}  // namespace drape::capture
