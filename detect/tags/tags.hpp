// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/prints/tag_family.hpp"
#include "detect/dots/local_map.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/print_plane.hpp"

struct apriltag_detector;

namespace drape::detect {

/// Settings of the library's search for tags.
struct TagSearch {
  int border_modules = 1;
  int wrong_bits = 2;  ///< in a tag that is still read
  /// Refined edges lose tags of few pixels; without them corners are some tenths of a pixel off.
  bool refine_edges = false;
};

/// Finds AprilTags anywhere in a picture (Olson 2011; Wang & Olson 2016, the AprilTag 3 library),
/// corners as one reads the tag: upper left, upper right, lower right, lower left. One finder
/// serves one thread at a time; the decoder's table is made when a whole picture is first searched.
class TagFinder {
 public:
  /// Throws Error(bad_input) for a family that is not known; the empty name, of a print without
  /// tags, finds none.
  explicit TagFinder(const std::string& family, const TagSearch& search = {});

  /// Tags whose id is on the print, ordered by id, with at most one wrong bit. An id seen twice is
  /// left out: one of them is wrong.
  [[nodiscard]] std::vector<TagDetection> find(const GreyImage& image, const PrintPlane& plane,
                                               double noise_sigma);
  /// Every tag of the family in the picture, also those that are not on a print or are seen twice.
  [[nodiscard]] std::vector<TagDetection> find_all(const GreyImage& image, double noise_sigma);
  /// Reads the tags of a print where its dots say that they are: each four dots that stand as the
  /// corners of one cell span a map, through which the modules are sampled. First the projective
  /// map of a flat cell, then one that bends as the four ellipses say. Bending that spoils a tag's
  /// outline leaves the modules readable, and only a few thousand pixels are looked at. Ordered by
  /// id; an id read in two places is left out.
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

  void make_detector();

  TagSearch search_;
  std::optional<TagFamily> family_;
  std::shared_ptr<apriltag_detector> detector_;
};

/// True when the print has tags and every one sits in the middle of four dots.
[[nodiscard]] bool tags_sit_between_dots(const PrintPlane& plane);

}  // namespace drape::detect
