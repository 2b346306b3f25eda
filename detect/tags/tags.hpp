// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/prints/face.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/labels.hpp"

struct apriltag_detector;

namespace drape::detect {

/// Settings of the AprilTag library's search.
struct TagSearch {
  int border_modules = 1;
  int wrong_bits = 2;  ///< wrong bits that are corrected
  /// Edge refinement loses small tags; without it corners are off by some tenths of a pixel.
  bool refine_edges = false;
};

/// Finds AprilTags anywhere in a picture (Olson 2011; Wang & Olson 2016, the AprilTag 3 library).
/// Corners are those of the upright tag: upper left, upper right, lower right, lower left. Each
/// thread needs a finder of its own. The decoder's table is made by the first full search.
class TagFinder {
 public:
  /// Throws Error(bad_input) for an unknown family; an empty name, for a print without tags, finds
  /// none.
  explicit TagFinder(const std::string& family, const TagSearch& search = {});

  /// Tags whose id is on the print, ordered by id, with at most one wrong bit. An id that occurs
  /// twice is omitted, since one of the two is wrong.
  [[nodiscard]] std::vector<TagDetection> find(const GreyImage& image, const PrintPlane& plane,
                                               double noise_sigma);
  /// All tags of the family in the picture, including those that are not on a print or occur twice.
  [[nodiscard]] std::vector<TagDetection> find_all(const GreyImage& image, double noise_sigma);
  /// Reads a print's tags at the positions given by its dots. Each four dots at the corners of a
  /// cell define a map for sampling the modules: first the homography of a flat cell, then a curved
  /// map from the four ellipses. Curvature that distorts a tag's outline leaves its modules
  /// readable, and only a few thousand pixels are examined. Ordered by id; an id read in two places
  /// is omitted.
  [[nodiscard]] std::vector<TagDetection> read_between_dots(const GreyImage& image,
                                                            const PrintPlane& plane,
                                                            const std::vector<UnlabelledDot>& dots,
                                                            double noise_sigma) const;

 private:
  struct Reading {
    TagDetection tag;
    int wrong_bits = 0;
  };
  [[nodiscard]] std::vector<Reading> read(const GreyImage& image, double noise_sigma);

  TagSearch search_;
  std::optional<TagFamily> family_;
  std::shared_ptr<apriltag_detector> detector_;
};

/// True if the print has tags and each is centred between four dots.
[[nodiscard]] bool tags_sit_between_dots(const PrintPlane& plane);

}  // namespace drape::detect
