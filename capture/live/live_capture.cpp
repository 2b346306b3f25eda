// SPDX-License-Identifier: Apache-2.0
#include "capture/live/live_capture.hpp"

#include "capture/live/session.hpp"
#include "core/error.hpp"

namespace drape::capture {

void LiveOptions::check() const {
  if (frames < 1) throw usage_error("the number of frames must be 1 or more", "give --frames 1");
  if (!(patience_s > 0)) throw usage_error("the patience is not positive", "give some seconds");
}

LiveResult capture_live(const CamerasFile& cameras, const LiveOptions& options) {
  options.check();
  if (cameras.cameras.empty()) throw usage_error("no camera to capture with", "name a camera");
  return Session(cameras, options).run();
}

}  // namespace drape::capture
