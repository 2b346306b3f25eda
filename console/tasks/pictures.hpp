// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <mutex>
#include <span>
#include <string>

#include "core/recording.hpp"

namespace drape::console {

/// A frame for the screen.
struct Picture {
  std::string jpeg;
  double saturated_fraction = 0;  ///< pixels at the sensor's largest value
};

/// Scales a frame (PNG, JPEG or TIFF; 8 or 16 bits) down to a width in px and paints every pixel of
/// the screen red below which one of the sensor lies at its largest value. Throws Error(bad_input)
/// when the bytes are no picture.
[[nodiscard]] Picture make_picture(std::span<const unsigned char> bytes, int width_px,
                                   bool mark_saturation);

/// Pictures of recorded frames, the last ones kept in memory. Safe from several threads.
class PictureShelf {
 public:
  [[nodiscard]] Picture picture(const Recording& recording, const FrameSet& set,
                                const RecordedFrame& frame, int width_px, bool mark_saturation);

 private:
  static constexpr std::size_t kMostBytes = 32U << 20U;
  std::mutex mutex_;
  std::map<std::string, Picture> pictures_;
  std::list<std::string> order_;  ///< oldest first
  std::size_t bytes_ = 0;
};

}  // namespace drape::console
