// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/live/live_capture.hpp"
#include "capture/live/pictures.hpp"
#include "capture/recording/journal.hpp"
#include "capture/recording/still.hpp"
#include "core/fields/records.hpp"
#include "core/recording.hpp"

namespace drape::capture {

/// Lossless formats; PGM is many times faster to write and takes twice the space.
enum class FrameFormat { png, pgm };

struct RecordOptions {
  std::filesystem::path
      folder;  ///< folder of the recording: a new one, or one to which the set is added
  std::string set;
  int frames = 1;        ///< several frames are stored as <set>_000, <set>_001, ...
  bool average = false;  ///< store one set, the mean of all frames
  bool retake = false;   ///< the set exists: store as <set>.new for Journal::replace
  double largest_spread_s = 0;
  QualityLimits limits;
  std::string recorded_on;  ///< ISO date
  FrameFormat format = FrameFormat::png;
  StillOptions still;
};

struct RecordResult {
  std::vector<std::string> sets;   ///< names of the stored sets
  std::vector<LiveFault> refused;  ///< frames and sets that were refused, with reason and remedy
  std::vector<std::string> files;  ///< image files, relative to the folder
  StillReport still;
  std::size_t averaged = 0;                ///< frames per camera in the average
  std::optional<LiveFault> short_average;  ///< stored as NO-GO, with fewer frames than requested
  std::vector<double> spread_bounds_s;     ///< bounds for sets of unknown spread
};

/// Throws Error(usage) if the name, or its form for a burst or retake, cannot be that of a set or
/// is reserved for the recording's own files.
void require_set_name(const std::string& set);

/// Throws Error(bad_input) if an existing recording has other cameras or image sizes than the rig,
/// since both would be measured together.
void require_cameras_of_rig(const Recording& recording, const CamerasFile& rig);

/// Stores the sets of a capture as they arrive: <set>/<camera>.png or .pgm (8 bit, or 16
/// bit with the sensor's value in the high bits), <set>/<camera>.<format>.raw if grey does
/// not hold all the data, and <set>/capture.json. Refuses a set as a whole if one of its
/// frames is black, saturated, blurred or not of the rig's size, its spread is too large,
/// or a camera has moved since the reference set. An average is also refused if the cloth
/// moved.
class Recorder {
 public:
  /// Throws Error(bad_input) if the recording already holds a set of this name (for several frames,
  /// one that begins with it), or has other cameras.
  Recorder(const CamerasFile& cameras, RecordOptions options, Journal& journal);

  void add(LiveSet set, const LiveReport& report);
  /// Stores the average. The manifest is written when the journal is published.
  [[nodiscard]] RecordResult finish();

 private:
  /// Reason why the stored sets are not valid measurements; nullopt if they are.
  [[nodiscard]] std::optional<std::string> reason_against() const;
  [[nodiscard]] std::string folder_of(const std::string& set) const;
  void sum_up(LiveSet set, const LiveReport& report);
  void store(const std::string& name, const LiveSet& set,
             const std::vector<FrameQuality>& qualities, std::size_t averaged,
             const LiveReport& report);

  const CamerasFile& cameras_;
  RecordOptions options_;
  Journal& journal_;
  StillWatch still_;
  RecordResult result_;
  std::size_t taken_ = 0, summed_ = 0;
  /// For the average: the first set, and sums over all sets on the 16-bit scale.
  std::optional<LiveSet> first_;
  LiveReport first_report_;
  std::vector<std::vector<std::uint32_t>> sums_;
};

struct CameraDetails {
  LiveCameraReport report;
  std::int64_t frame_index = 0;
  std::optional<double> time_s;
  std::string pixel_format;
  int bits = 8;
  std::optional<std::string> raw_file, raw_sha256;
  FrameQuality quality;
};

/// capture.json of a set: times, spread, settings read back, clocks, ledger so far, stillness,
/// faults, and why the set is no valid measurement, if so.
struct SetDetails {
  std::string set;
  std::optional<std::string> no_go;
  std::string recorded_on;
  LiveReport report;  ///< `cameras` below has its cameras
  LiveSet moment;     ///< without its frames
  std::size_t averaged = 1;
  StillReport still;
  StillOptions still_options;
  std::vector<CameraDetails> cameras;
};
void fields(Fields& f, SetDetails& details);

/// The part of capture.json that an import keeps.
struct SetNotes {
  std::string set;  ///< name of the set when captured
  std::optional<std::string> no_go, cloth;
  std::optional<double> motion_px, camera_shift_px;
};
void fields(Fields& f, SetNotes& notes);

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::FrameFormat>[] = {"png", "pgm"};

template <>
inline constexpr drape::Format drape::format_of<drape::capture::SetDetails>{
    "capture", Syntax::json, 1, "details of a captured set"};
template <>
inline constexpr drape::Format drape::format_of<drape::capture::SetNotes>{"capture"};
