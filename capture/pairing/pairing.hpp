// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/fields/fields.hpp"

namespace drape::capture {

/// One reading of a device's clock between two readings of the host's clock. The device read its
/// clock somewhere in between, so half the round trip bounds the error (Cristian 1989).
struct ClockSample {
  std::int64_t host_before_ns = 0;
  std::int64_t device_ns = 0;
  std::int64_t host_after_ns = 0;
};

/// Linear clock model: host = reference_host + (device - reference_device) * (1 + drift).
struct ClockFit {
  std::int64_t reference_device_ns = 0;
  std::int64_t reference_host_ns = 0;
  double drift_ppm = 0;   ///< excess rate of the host's clock, in parts per million
  double residual_s = 0;  ///< weighted root mean square residual of the fit, seconds
  double bound_s = 0;     ///< half the shortest round trip, which bounds one reading's error
  /// Additional bound within a second of the samples: effect of an unknown drift of up to 500 ppm,
  /// the assumed limit of a camera's oscillator; 0 once the drift is estimated.
  double drift_bound_s = 0;
  double span_s = 0;  ///< host time from the first to the last sample
  std::size_t samples = 0;
  bool drift_estimated = false;  ///< false if the span is too short; drift is then 0

  /// Bound on the error of the offset, whether the drift is known or not.
  [[nodiscard]] double offset_bound_s() const { return bound_s + drift_bound_s; }
  /// Host time of a device time, in seconds since `host_epoch_ns`.
  [[nodiscard]] double host_time_s(std::int64_t device_ns, std::int64_t host_epoch_ns) const;
};

/// Weighted least-squares fit of the samples, with weights 1 / (half round trip)^2. nullopt if
/// there is no sample, if a round trip is negative, or if the drift exceeds 500 ppm: then the
/// clock jumped between two samples and no straight line describes it.
[[nodiscard]] std::optional<ClockFit> fit_clock(const std::vector<ClockSample>& samples);

/// Jump of the device's clock between two readings beyond what their round trips and a drift of 500
/// ppm explain; nullopt if it may have run evenly. There are no false alarms: both readings bound
/// the clock on either side.
[[nodiscard]] std::optional<double> clock_jump_s(const ClockSample& before,
                                                 const ClockSample& after);

/// Cycle of a device's frame ids: first, first + 1, ..., last, first, ... GigE Vision counts
/// 1..65535 and skips 0 (GigE Vision 2.0, block_id); V4L2 counts 32 bits.
struct FrameIdRange {
  std::uint64_t first = 1;
  std::uint64_t last = 65535;
};

/// Converts wrapping frame ids to a count that never wraps: 0 for the first frame seen,
/// negative for earlier frames that arrive late. A camera that counts beyond the range has
/// 64-bit ids (GigE Vision 2.0, extended ids), which do not wrap. An id is assigned to the
/// count nearest to the newest frame, so gaps and delays of up to half the range are
/// distinguished from a wrap.
class FrameIdUnwrapper {
 public:
  /// Throws Error(usage) for a range of fewer than two ids.
  explicit FrameIdUnwrapper(FrameIdRange range);

  /// nullopt if `id` is below the range.
  [[nodiscard]] std::optional<std::int64_t> unwrap(std::uint64_t id);

 private:
  FrameIdRange range_;
  std::int64_t newest_ = 0;
  std::optional<std::uint64_t> newest_id_;
};

/// Delay of each camera's exposure after that of camera 0, in s, between -period/2 and +period/2.
/// Free-running cameras of one rate keep their initial phase, and nothing else distinguishes their
/// frames. `exposed_s` holds any one exposure of each camera on the common clock.
[[nodiscard]] std::vector<double> phases_s(const std::vector<double>& exposed_s, double period_s);

/// Shortest interval that contains one exposure of every camera: the smallest spread of a set.
[[nodiscard]] double least_spread_s(const std::vector<double>& phases_s, double period_s);

/// Restart time of a camera that was started at `began_ns` and exposes `phase_s` after camera 0, so
/// that both expose together: the first such time after `not_before_ns`. Assumes that the delay
/// from start to exposure stays the same.
[[nodiscard]] std::int64_t begin_again_ns(std::int64_t began_ns, double phase_s, double period_s,
                                          std::int64_t not_before_ns);

/// A frame that reached the host, complete or not, as pairing sees it.
struct FrameMark {
  std::size_t camera = 0;
  std::int64_t index = 0;                   ///< unwrapped frame id, see FrameIdUnwrapper
  std::optional<double> time_s;             ///< device time on the common clock
  std::optional<std::int64_t> trigger;      ///< 0-based; set if the trigger it answers is known
  bool complete = true;                     ///< true if every byte arrived
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
/// counted separately, since its first frame is already counted.
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
};

struct PairingResult {
  std::vector<PairedFrames> sets;     ///< in the order of triggers or times
  std::vector<FramePlace> places;     ///< one per input frame
  std::vector<CameraLedger> cameras;  ///< one per camera
};

/// Assigns every frame to exactly one bin. Frames of settled sets stay together. Pairs by trigger
/// index if `options.triggers` is given; else by device time on the common clock. Then each set
/// takes the frames of smallest spread, so that a frame without partners never displaces another.
/// The order of the input (that is, of arrival) does not matter.
///
/// Expected frames: the triggers; else `expected_frames`; else the range of the frame ids seen.
[[nodiscard]] PairingResult pair_frames(const std::vector<FrameMark>& frames,
                                        const PairingOptions& options);

/// Input indices of all cameras' frames from the first set to the last of at most `most` sets; of
/// all frames without a set, or if `most` is 0. Free-running cameras do not start and stop
/// together, so only frames between their sets count as requested.
[[nodiscard]] std::vector<std::size_t> frames_of_sets(const std::vector<FrameMark>& frames,
                                                      const PairingResult& pairing,
                                                      std::size_t most);

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
