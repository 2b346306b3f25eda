// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture/recording/record.hpp"

namespace drape::capture {

/// Stores every good set of a finished capture.
inline RecordResult record_live(const LiveResult& live, const CamerasFile& cameras,
                                RecordOptions options) {
  options.frames = static_cast<int>(live.pairing.sets.size());
  require_set_name(options.set);
  Journal journal(options.folder, options.recorded_on);
  Recorder recorder(cameras, std::move(options), journal);
  for (const PairedFrames& set : live.pairing.sets) {
    LiveSet one{set.spread_s, {}, set.trigger, {}};
    for (const std::size_t i : set.frames) one.frames.push_back(live.frames[i]);
    recorder.add(std::move(one), live.report);
  }
  RecordResult result = recorder.finish();
  journal.publish();
  return result;
}

}  // namespace drape::capture
