// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// The tags of one AprilTag family with a black rim of one or more modules around their bits: one
/// is the library's own, Kalibr's grids have two (Olson 2011; the AprilTag 3 library).
class TagFamily {
 public:
  /// Throws Error(bad_input) for a family that is not known or a rim outside 1 to 4 modules.
  TagFamily(const std::string& name, int border_modules);
  ~TagFamily();
  TagFamily(const TagFamily&) = delete;
  TagFamily& operator=(const TagFamily&) = delete;

  [[nodiscard]] int count() const;         ///< of different tags
  [[nodiscard]] int edge_modules() const;  ///< along the black square
  /// Side of the square that black() covers: the black square and its white margin, or a family
  /// whose bits reach beyond its border.
  [[nodiscard]] int total_modules() const;
  /// A module of a tag standing upright, from its upper left.
  [[nodiscard]] bool black(int id, int x, int y) const;

  /// Every tag of the family in the picture, ordered by id, corners as one reads the tag: upper
  /// left, upper right, lower right, lower left.
  [[nodiscard]] std::vector<TagDetection> find(const GreyImage& image, double noise_sigma) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace drape::detect
