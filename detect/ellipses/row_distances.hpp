// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include "detect/ellipses/blurred_ellipse.hpp"

namespace drape::detect {

/// Distances from an ellipse along rows of pixels, as BlurredEllipse has them one by one.
class RowDistances {
 public:
  explicit RowDistances(int count) : d_(count), vx_(count), vy_(count) {}

  /// The pixels (first_x, y), (first_x + 1, y) and so on.
  void fill(const BlurredEllipse& model, int first_x, int y);

  [[nodiscard]] double distance(int k) const { return d_[k]; }
  [[nodiscard]] int sector(int k) const { return BlurredEllipse::sector_of(vx_[k], vy_[k]); }

 private:
  std::vector<double> d_, vx_, vy_;
};

}  // namespace drape::detect
