// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/fields/fields.hpp"

namespace drape::capture {

/// A frame that reached the host, complete or not, as pairing sees it.
struct FrameMark {
  std::size_t camera = 0;
  std::int64_t index = 0;                   ///< unwrapped frame id, see FrameIdUnwrapper
  std::optional<double> time_s;             ///< device time on the common clock
  std::optional<std::int64_t> trigger;      ///< 0-based; set if the trigger it answers is known
  bool complete = true;                     ///< every byte of it arrived
  std::optional<std::size_t> settled = {};  ///< index of the set in which it was already delivered
  bool given_up = false;                    ///< no partner arrived while its pixels were kept
};

/// Result for a frame. A frame that never arrived has no FrameMark; it is counted per camera.
enum class FrameBin { in_set, unpaired, incomplete };

/// Reason why a frame is unpaired.
enum class Unpaired { no, partner_missing, repeated_id, no_time, no_trigger };

struct FramePlace {
  FrameBin bin = FrameBin::unpaired;
  Unpaired why_unpaired = Unpaired::no;
  std::optional<std::size_t> set;  ///< index into PairingResult::sets
};

/// One frame of each camera, exposed at the same instant.
struct PairedFrames {
  std::vector<std::size_t> frames;      ///< input indices, one per camera in their order
  std::optional<std::int64_t> trigger;  ///< absent if paired by time
  std::optional<double> spread_s;  ///< latest minus earliest exposure; absent without device times
};

/// Totals per camera: expected = in_set + unpaired + incomplete + never_arrived. A repeated id is
/// counted separately, since the frame that it repeats has been counted.
struct CameraLedger {
  std::int64_t expected = 0;
  std::int64_t in_set = 0;
  std::int64_t unpaired = 0;
  std::int64_t incomplete = 0;
  std::int64_t never_arrived = 0;
  std::int64_t repeated = 0;

  [[nodiscard]] bool closes() const {
    return expected == in_set + unpaired + incomplete + never_arrived;
  }
};

struct PairingOptions {
  std::size_t cameras = 0;
  /// Pairing by time: largest spread of a set, at most half the frame period.
  double window_s = 0;
  /// Number of triggers sent; if given, pairing is by trigger, else by time.
  std::optional<std::int64_t> triggers = {};
  /// Frames that every camera was commanded to take, if known without triggers.
  std::optional<std::int64_t> expected_frames = {};

  void check() const;  ///< throws Error(usage)
};

struct PairingResult {
  std::vector<PairedFrames> sets;     ///< in the order of triggers or times
  std::vector<FramePlace> places;     ///< one per input frame
  std::vector<CameraLedger> cameras;  ///< one per camera
};

/// Assigns every frame to exactly one bin. Frames of settled sets stay together. Pairs by trigger
/// index if `options.triggers` is given; else by device time on the common clock, choosing for
/// every set the frames of smallest spread, so that a frame without partners never takes one away
/// from another set. The order of the input (that is, of arrival) does not matter.
///
/// Expected frames: the triggers; else `expected_frames`; else the range of the frame ids seen.
[[nodiscard]] PairingResult pair_frames(const std::vector<FrameMark>& frames,
                                        const PairingOptions& options);

/// Input indices of all cameras' frames from the first set to the last of at most `most` sets; of
/// all frames if there is no set. Free-running cameras do not start and stop together, so only
/// frames between their sets count as requested.
[[nodiscard]] std::vector<std::size_t> frames_of_sets(const std::vector<FrameMark>& frames,
                                                      const PairingResult& pairing,
                                                      std::size_t most);

/// Input indices of all frames.
[[nodiscard]] std::vector<std::size_t> every_frame(const std::vector<FrameMark>& frames);

/// Trigger answered by a frame: the last one at or before `time_s + early_s`, if the frame came at
/// most `latest_s` after it. nullopt if none fits. `trigger_time_s` ascends.
[[nodiscard]] std::optional<std::int64_t> trigger_of(double time_s,
                                                     const std::vector<double>& trigger_time_s,
                                                     double early_s, double latest_s);

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::Unpaired>[] = {
    "paired", "no frame of every other camera within the window", "its frame id was seen before",
    "it has no device time", "it answers no trigger"};
