// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "detect/image.hpp"
#include "detect/print_plane.hpp"

namespace drape {

/// Finds the AprilTags of a print (Olson 2011; Wang & Olson 2016, the AprilTag 3 library). One
/// finder serves one thread at a time; building it once saves the decoder's table per frame.
class TagFinder {
 public:
  /// Throws Error(bad_input) for a family this program does not know.
  explicit TagFinder(const std::string& family);
  ~TagFinder();
  TagFinder(const TagFinder&) = delete;
  TagFinder& operator=(const TagFinder&) = delete;

  /// Tags whose id is on the print, ordered by id, with corners as one reads the tag: upper left,
  /// upper right, lower right, lower left. An id seen twice is left out: one of them is wrong.
  [[nodiscard]] std::vector<TagDetection> find(const GreyImage& image, const PrintPlane& plane,
                                               double noise_sigma);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace drape
