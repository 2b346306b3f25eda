// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/print_plane.hpp"

namespace drape::detect {

/// The words of a tag family: where its bits lie and what each id says.
struct TagCode {
  int modules = 0;                       ///< along the black square's edge
  std::vector<std::array<int, 2>> bits;  ///< module (x, y) of each bit, most significant first
  std::vector<std::uint64_t> words;      ///< by id; white is 1
};

/// Names of the families that can be read.
[[nodiscard]] std::vector<std::string> tag_families();

/// Finds the AprilTags of a print (Olson 2011; Wang & Olson 2016, the AprilTag 3 library). One
/// finder serves one thread at a time; building it once saves the decoder's table per frame.
class TagFinder {
 public:
  /// Throws Error(bad_input) for a family this program does not know; none, for a print without
  /// tags, is the empty name.
  explicit TagFinder(const std::string& family);
  ~TagFinder();
  TagFinder(const TagFinder&) = delete;
  TagFinder& operator=(const TagFinder&) = delete;

  /// Tags whose id is on the print, ordered by id, with corners as one reads the tag: upper left,
  /// upper right, lower right, lower left. An id seen twice is left out: one of them is wrong.
  [[nodiscard]] std::vector<TagDetection> find(const GreyImage& image, const PrintPlane& plane,
                                               double noise_sigma);

  /// Every tag of the family in the picture, also those that are not on a print or are seen twice.
  [[nodiscard]] std::vector<TagDetection> find_all(const GreyImage& image, double noise_sigma);

  /// The family's words, for reading tags at known places.
  [[nodiscard]] const TagCode& code() const;

 private:
  struct Reading {
    TagDetection tag;
    int wrong_bits = 0;
  };
  [[nodiscard]] std::vector<Reading> read(const GreyImage& image, double noise_sigma);

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace drape::detect
