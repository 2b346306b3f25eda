// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/files/picture_layout.hpp"
#include "core/parallel.hpp"
#include "core/recording.hpp"

namespace drape::capture {

struct CaptureOptions {
  int threads = 1;         ///< images checked in parallel; never changes a result
  PartDone progress = {};  ///< receives the file just finished

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

/// Image formats that a recording may contain.
enum class ImageFormat { png, jpeg, tiff };

/// Detects the format from the first bytes, independent of the file name.
[[nodiscard]] std::optional<ImageFormat> image_format(std::span<const unsigned char> bytes);

/// Explains why the file is not a complete image ("ends inside chunk IDAT"); nullopt if it is.
/// Needed because the decoder silently fills the missing part of a truncated file with grey. PNG:
/// every chunk and its CRC up to IEND. JPEG: every segment and scan up to the end marker. TIFF:
/// every directory entry, and every strip or tile of the first page, inside the file.
[[nodiscard]] std::optional<std::string> structure_fault(ImageFormat format,
                                                         std::span<const unsigned char> bytes);

struct ImageSize {
  int width_px = 0, height_px = 0;
  bool operator==(const ImageSize&) const = default;
};

/// Checks that `bytes` are one complete PNG, JPEG or TIFF image by walking its structure and
/// decoding it; returns the size of the stored pixels (an orientation tag is not applied). Throws
/// Error(bad_input) at `where` otherwise.
[[nodiscard]] ImageSize check_image(std::span<const unsigned char> bytes, const Where& where);

}  // namespace drape::capture
