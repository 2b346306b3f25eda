// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/live/frame_quality.hpp"
#include "capture/live/live_capture.hpp"
#include "capture/live/still.hpp"
#include "core/recording.hpp"

namespace drape::capture {

/// Both are lossless; PGM is written many times as fast and takes twice the space.
enum class FrameFormat { png, pgm };

struct RecordOptions {
  std::filesystem::path folder;  ///< of the recording; made, or one to which the set is added
  std::string set;
  bool average = false;  ///< one set, the mean of all frames, instead of one set per frame
  double largest_spread_s = 0;
  QualityLimits limits;
  std::string recorded_on;  ///< ISO date
  FrameFormat format = FrameFormat::png;
  StillOptions still;
};

struct RecordResult {
  std::vector<std::string> sets;   ///< that were stored
  std::vector<LiveFault> refused;  ///< frames and sets that were not, with reason and remedy
  std::vector<std::string> files;  ///< images, relative to the folder
  StillReport still;
};

/// Throws Error(bad_input) when the recording already holds a set of this name (or, for several
/// frames, of one that begins with it), or the name cannot be a folder's. Call before capturing.
void require_new_set(const RecordOptions& options);

/// Stores every good set: <set>/<camera>.png or .pgm, <set>/capture.json (times, spread, settings
/// read back, clocks, ledger, stillness), and recording.json last, which holds the hashes of all.
/// Sets are <set>, or <set>_000, <set>_001, ... for several frames. A set is refused when one of
/// its frames is black, saturated or blurred, has another size than the rig says, its spread is too
/// large, a camera has moved since the reference set, or the cloth moved in a burst to be averaged;
/// nothing of it is written.
[[nodiscard]] RecordResult record_live(const LiveResult& live, const CamerasFile& cameras,
                                       const RecordOptions& options);

}  // namespace drape::capture
