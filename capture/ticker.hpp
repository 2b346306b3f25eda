// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <mutex>
#include <string>

#include "capture/capture.hpp"

namespace drape::capture {

/// Counts finished images and reports them; calls to the callback do not overlap.
class Ticker {
 public:
  Ticker(const CaptureOptions& options, std::size_t total) : options_(options), total_(total) {}

  void done(const std::string& what) {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (options_.progress) {
      options_.progress(static_cast<double>(done_) / static_cast<double>(total_), what);
    }
  }

 private:
  const CaptureOptions& options_;
  std::size_t total_;
  std::size_t done_ = 0;
  std::mutex mutex_;
};

}  // namespace drape::capture
