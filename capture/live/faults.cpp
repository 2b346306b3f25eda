// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "capture/live/live_capture.hpp"

namespace drape::capture {

void add_fault(std::vector<LiveFault>& faults, LiveFault fault) {
  const auto same = std::find_if(faults.begin(), faults.end(), [&](const LiveFault& f) {
    return f.camera == fault.camera && f.what == fault.what;
  });
  if (same == faults.end()) {
    faults.push_back(std::move(fault));
  } else {
    ++same->times;
  }
}

std::string to_string(PairedBy paired_by) {
  switch (paired_by) {
    case PairedBy::trigger:
      return "trigger";
    case PairedBy::time:
      return "device time";
    case PairedBy::arrival:
      return "arrival";
  }
  return {};
}

}  // namespace drape::capture
