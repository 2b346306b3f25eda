// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/fields/fields.hpp"

namespace drape::capture {

/// Description of one frame for pairing, that reached the host, whole or not.
struct FrameMark {
  std::size_t camera = 0;
  std::int64_t index = 0;                   ///< unwrapped frame id, see FrameIdUnwrapper
  std::optional<double> time_s;             ///< device time on the common clock
  std::optional<std::int64_t> trigger;      ///< 0-based, when the frame is known to answer it
  bool complete = true;                     ///< every byte of it arrived
  std::optional<std::size_t> settled = {};  ///< number of a set that was given out already
  bool given_up = false;                    ///< no partner came while its pixels were kept
};

/// Destination of a frame. A frame that never arrived has no FrameMark; it is counted per camera.
enum class FrameBin { in_set, unpaired, incomplete };

/// Why a frame is unpaired.
enum class Unpaired { no, partner_missing, repeated_id, no_time, no_trigger };

struct FramePlace {
  FrameBin bin = FrameBin::unpaired;
  Unpaired why_unpaired = Unpaired::no;
  std::optional<std::size_t> set;  ///< index into PairingResult::sets
};

/// One frame of each camera, of one instant.
struct PairedFrames {
  std::vector<std::size_t> frames;      ///< index into the input, one per camera in their order
  std::optional<std::int64_t> trigger;  ///< absent when paired by time
  std::optional<double> spread_s;       ///< latest minus earliest; absent without device times
};

/// Sums per camera: expected = in_set + unpaired + incomplete + never_arrived. A repeated id is
/// counted apart, because the frame it repeats has been counted already.
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
  /// Pairing by time: the largest spread of a set, at most half the frame period.
  double window_s = 0;
  /// Triggers sent; pairing is by trigger when given, by time otherwise.
  std::optional<std::int64_t> triggers = {};
  /// Frames every camera was commanded to take, where that is known without triggers.
  std::optional<std::int64_t> expected_frames = {};

  void check() const;  ///< throws Error(usage)
};

struct PairingResult {
  std::vector<PairedFrames> sets;     ///< in order of trigger or time
  std::vector<FramePlace> places;     ///< one per input frame
  std::vector<CameraLedger> cameras;  ///< one per camera
};

/// Puts every frame into exactly one bin. Frames of settled sets stay together. By trigger index
/// when `options.triggers` is given; else by device time on the common clock, taking for every set
/// the frames of smallest spread, so that a frame without partner never takes a partner away from
/// another set. The order of the input (that is, of arrival) never matters.
///
/// Expected frames: the triggers; else `expected_frames`; else the span of the frame ids seen.
[[nodiscard]] PairingResult pair_frames(const std::vector<FrameMark>& frames,
                                        const PairingOptions& options);

/// Input indices of the frames from the first set to the last of at most `most` sets, of every
/// camera; of all frames when there is no set. Free-running cameras neither start nor stop
/// together: only what lies between their sets was to be captured.
[[nodiscard]] std::vector<std::size_t> frames_of_sets(const std::vector<FrameMark>& frames,
                                                      const PairingResult& pairing,
                                                      std::size_t most);

/// Input indices of all frames.
[[nodiscard]] std::vector<std::size_t> every_frame(const std::vector<FrameMark>& frames);

/// The trigger that a frame answers: the last one at or before `time_s + early_s`, when the frame
/// came at most `latest_s` after it. Nothing when no trigger fits. `trigger_time_s` ascends.
[[nodiscard]] std::optional<std::int64_t> trigger_of(double time_s,
                                                     const std::vector<double>& trigger_time_s,
                                                     double early_s, double latest_s);

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::Unpaired>[] = {
    "paired", "no frame of every other camera within the window", "its frame id was seen before",
    "it has no device time", "it answers no trigger"};
