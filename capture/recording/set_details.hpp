// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture/live/live_capture.hpp"
#include "capture/recording/record.hpp"
#include "core/fields/records.hpp"

namespace drape::capture {

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
/// faults, and why the set is not a valid measurement, if so.
struct SetDetails {
  std::string set;
  std::optional<std::string> no_go, fallen_back;
  std::string recorded_on;
  SyncMethod method = SyncMethod::free_run;
  PairedBy paired_by = PairedBy::time;
  std::optional<std::int64_t> trigger;
  std::optional<double> spread_s, spread_bound_s;
  std::size_t averaged = 1;
  StillReport still;
  StillOptions still_options;
  std::vector<CameraDetails> cameras;
  std::vector<LiveFault> faults;
};
void fields(Fields& f, SetDetails& details);

[[nodiscard]] SetDetails set_details(const std::string& name, const LiveSet& set,
                                     const std::vector<FrameQuality>& qualities,
                                     std::size_t averaged, const LiveReport& report,
                                     const StillReport& still, const RecordOptions& options,
                                     const std::optional<std::string>& no_go);

/// The part of capture.json that an import keeps.
struct SetNotes {
  std::string set;  ///< name of the set when captured
  std::optional<std::string> no_go, cloth;
  std::optional<double> motion_px, camera_shift_px;
};
void fields(Fields& f, SetNotes& notes);

}  // namespace drape::capture

template <>
inline constexpr drape::Format drape::format_of<drape::capture::SetDetails>{
    "capture", Syntax::json, 1, "details of a captured set"};
template <>
inline constexpr drape::Format drape::format_of<drape::capture::SetNotes>{"capture"};
