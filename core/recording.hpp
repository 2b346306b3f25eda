// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"

namespace drape {

/// One image of one camera.
struct RecordedFrame {
  std::string camera;
  std::string file;    ///< relative to the recording's folder
  std::string sha256;  ///< hash of the file's bytes
  int width_px = 0, height_px = 0;
  std::optional<double> device_time_s;  ///< absent for imported images
};

/// Frames that belong together (one instant, all cameras), in the order of the manifest.
struct FrameSet {
  std::string name;
  std::vector<RecordedFrame> frames;
  // Stated for live sets; absent if not measured.
  std::optional<std::string> details_sha256 = {};  ///< hash of <set>/capture.json
  std::optional<double> motion_px = {};            ///< largest motion between frames of the burst
  std::optional<double> camera_shift_px = {};      ///< background's shift against the reference set
  std::optional<std::string> no_go = {};  ///< why the set is no valid measurement; absent if GO
};

/// A recording: images <set>/<camera>.png and recording.json, which is written last.
struct Recording {
  std::filesystem::path folder;
  std::string source;                      ///< "import" or the capture method
  std::optional<std::string> recorded_on;  ///< ISO date when known
  std::vector<FrameSet> sets;
  Document document = {};  ///< recording.json as it was read

  /// Finds a set by name. Throws Error(bad_input) that lists the existing sets.
  [[nodiscard]] const FrameSet& set(const std::string& set_name) const;
};

void fields(Fields& f, FrameSet& set);
void fields(Fields& f, Recording& recording);
template <>
inline constexpr Format format_of<Recording>{"recording", Syntax::json, 1,
                                             "sets of frames and their hashes"};

/// Reads <folder>/recording.json. Throws Error if it is missing, too new, or lists no set.
[[nodiscard]] Recording read_recording(const std::filesystem::path& folder);
void write_recording(const Recording& recording);

/// Reads a frame's bytes and checks them against the SHA-256 in the manifest. Throws Error naming
/// set, camera and file if the image is missing, truncated or altered.
[[nodiscard]] std::vector<unsigned char> read_frame(const Recording& recording, const FrameSet& set,
                                                    const RecordedFrame& frame);

}  // namespace drape
