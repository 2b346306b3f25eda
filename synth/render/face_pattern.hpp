// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/rig.hpp"

namespace drape::synth {

/// Coordinates on a printed face, metres: x to the right and y down, as one looks at the print.
/// Of a cloth x runs along the weft and y along the warp; of a target they are (x, -y).
using FacePoint = Eigen::Vector2d;

struct Disc {
  FacePoint centre;
  double radius_m = 0;
  double ink = 1;  ///< +1 prints, -1 takes the print of a disc below away
};

/// Axis-aligned printed rectangle.
struct Rectangle {
  FacePoint least, most;
};

/// Straight-sided cell of the face, corners in either order around it.
using FaceCell = std::array<FacePoint, 4>;

/// What is printed on a face, with exact areas. Rectangles must not overlap each other or a disc.
class FacePattern {
 public:
  FacePattern() = default;
  FacePattern(std::vector<Disc> discs, std::vector<Rectangle> rectangles);

  /// Fraction of a cell's area that is printed, 0..1, in closed form.
  [[nodiscard]] double coverage(const FaceCell& cell) const;
  [[nodiscard]] bool is_printed(const FacePoint& point) const;
  /// False when the cell is certainly all printed or all bare.
  [[nodiscard]] bool has_edge_in(const FaceCell& cell) const;
  [[nodiscard]] const std::vector<Disc>& discs() const { return discs_; }

 private:
  struct Bucket {
    std::vector<int> discs, rectangles;
  };
  [[nodiscard]] Eigen::Vector2i bucket_of(const FacePoint& point) const;
  void add(const FacePoint& least, const FacePoint& most, int index, bool is_disc);
  /// Calls `visit(bucket)` for the buckets that a box touches; shapes may come more than once.
  template <class Visit>
  void visit(const FacePoint& least, const FacePoint& most, const Visit& visit) const;

  std::vector<Disc> discs_;
  std::vector<Rectangle> rectangles_;
  FacePoint first_ = FacePoint::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<Bucket> buckets_;
};

/// Area of the intersection of a polygon (in its own sense of rotation, signed) with a disc.
[[nodiscard]] double polygon_disc_area(const FaceCell& cell, const FacePoint& centre,
                                       double radius_m);

/// Dots, light centres and tags of a cloth's print.
[[nodiscard]] FacePattern pattern_of(const Print& print);
/// Dots and tags, or squares, of a calibration target.
[[nodiscard]] FacePattern pattern_of(const Target& target);

/// A mark's place on the face.
[[nodiscard]] FacePoint face_point(const Print& print, MarkId mark);
[[nodiscard]] FacePoint face_point(const Target& target, MarkId mark);

}  // namespace drape::synth
