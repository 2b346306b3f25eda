// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/prints/face.hpp"

namespace drape::synth {

/// Quadrilateral cell of the face; corners in either orientation.
using FaceCell = std::array<FacePoint, 4>;

/// Print on a face, with exact areas. Boxes must not overlap each other or any disc.
class FacePattern {
 public:
  FacePattern() = default;
  explicit FacePattern(const Face& face);

  /// Printed fraction of a cell's area, 0..1, in closed form.
  [[nodiscard]] double coverage(const FaceCell& cell) const;
  [[nodiscard]] bool is_printed(const FacePoint& point) const;
  /// False if the cell is certainly all printed or all bare.
  [[nodiscard]] bool has_edge_in(const FaceCell& cell) const;

 private:
  struct Bucket {
    std::vector<int> discs, boxes;
  };
  [[nodiscard]] Eigen::Vector2i bucket_of(const FacePoint& point) const;
  void add(const FacePoint& least, const FacePoint& most, int index, bool is_disc);
  /// Calls `visit(bucket)` for the buckets that a box overlaps; shapes may be repeated.
  template <class Visit>
  void visit(const FacePoint& least, const FacePoint& most, const Visit& visit) const;

  std::vector<FaceDisc> discs_;
  std::vector<FaceBox> boxes_;
  FacePoint first_ = FacePoint::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<Bucket> buckets_;
};

/// Signed area of the intersection of a polygon, by its orientation, with a disc.
[[nodiscard]] double polygon_disc_area(const FaceCell& cell, const FacePoint& centre,
                                       double radius_m);

}  // namespace drape::synth
