// SPDX-License-Identifier: Apache-2.0
#include "capture/capture.hpp"
#include "core/error.hpp"
#include "core/program/dates.hpp"

namespace drape::capture {

void CaptureOptions::check() const {
  if (threads < 1) throw usage_error("the number of threads must be 1 or more", "give --threads 1");
  if (recorded_on && !date_in(*recorded_on))
    throw usage_error("`" + *recorded_on + "` is no date", "write it as 2026-01-31");
}

}  // namespace drape::capture
