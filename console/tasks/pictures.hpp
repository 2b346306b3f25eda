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

/// A frame scaled for the screen.
struct Picture {
  std::string jpeg;
  double saturated_fraction = 0;  ///< fraction of pixels at the sensor's largest value
};

/// Scales a frame (PNG, JPEG or TIFF; 8 or 16 bits) down to a width in px and paints every screen
/// pixel red that contains a saturated sensor pixel. Throws Error(bad_input) if the bytes are not a
/// picture.
[[nodiscard]] Picture make_picture(std::span<const unsigned char> bytes, int width_px,
                                   bool mark_saturation);

/// Cache of pictures of recorded frames. Thread-safe.
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
