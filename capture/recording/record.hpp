// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/live/live_capture.hpp"
#include "capture/recording/frame_quality.hpp"
#include "capture/recording/journal.hpp"
#include "capture/recording/still.hpp"
#include "core/recording.hpp"

namespace drape::capture {

/// Both are lossless; PGM is written many times as fast and takes twice the space.
enum class FrameFormat { png, pgm };

struct RecordOptions {
  std::filesystem::path
      folder;  ///< folder of the recording; made, or one to which the set is added
  std::string set;
  int frames = 1;        ///< several are <set>_000, <set>_001, ...
  bool average = false;  ///< one set, the mean of all frames, instead of one set per frame
  bool retake = false;   ///< the set is there: stored as <set>.new for Journal::replace
  double largest_spread_s = 0;
  QualityLimits limits;
  std::string recorded_on;  ///< ISO date
  FrameFormat format = FrameFormat::png;
  StillOptions still;
};

struct RecordResult {
  std::vector<std::string> sets;   ///< sets that were stored
  std::vector<LiveFault> refused;  ///< frames and sets that were not, with reason and remedy
  std::vector<std::string> files;  ///< images, relative to the folder
  StillReport still;
  std::size_t averaged = 0;                ///< frames of each camera in the average
  std::optional<LiveFault> short_average;  ///< stored as NO-GO: it is of fewer frames than asked
  std::vector<double> spread_bounds_s;     ///< for sets whose spread is not known
};

/// File of a frame's raw bytes in its set's folder.
[[nodiscard]] std::string raw_file(const std::string& camera, const LiveFrame& frame);

/// Throws Error(usage) when the name, or what a burst or a retake makes of it, cannot be that of a
/// set, or belongs to the recording's own files.
void require_set_name(const std::string& set);

/// Throws Error(bad_input) when a recording that has sets has other cameras, or images of another
/// size, than the rig: they would be measured as one.
void require_cameras_of_rig(const Recording& recording, const CamerasFile& rig);

/// Stores the sets of one capture as they come: <set>/<camera>.png or .pgm (8 bit, or 16 bit with
/// the sensor's value in the high bits), <set>/<camera>.<format>.raw where the grey does not hold
/// all that was sent, and <set>/capture.json. A set is refused when one of its frames is black,
/// saturated or blurred, has another size than the rig says, its spread is too large, or a camera
/// has moved since the reference set; nothing of it is written. An average is refused, too, when
/// the cloth moved.
class Recorder {
 public:
  /// Throws Error(bad_input) when the recording already holds a set of this name (or, for several
  /// frames, of one that begins with it), or is one of other cameras.
  Recorder(const CamerasFile& cameras, RecordOptions options, Journal& journal);

  void add(LiveSet set, const LiveReport& report);
  /// Stores the average. The manifest is written when the journal is published.
  [[nodiscard]] RecordResult finish();

 private:
  /// Why what is stored is no measurement.
  [[nodiscard]] std::optional<std::string> reason_against() const;
  [[nodiscard]] std::string folder_of(const std::string& set) const;
  void refuse_known_set() const;
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
  /// The average: its first set, and sums of all on the 16-bit scale.
  std::optional<LiveSet> first_;
  LiveReport first_report_;
  std::vector<std::vector<std::uint32_t>> sums_;
};

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::FrameFormat>[] = {"png", "pgm"};
