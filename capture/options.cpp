// SPDX-License-Identifier: Apache-2.0
#include "capture/capture.hpp"
#include "core/error.hpp"

namespace drape {

void CaptureOptions::check() const {
  if (threads < 1) throw usage_error("the number of threads must be 1 or more", "give --threads 1");
}

}  // namespace drape
