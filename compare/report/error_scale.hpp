// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/drawing/svg.hpp"

namespace drape::compare {

/// Viridis (van der Walt & Smith 2015): even steps in lightness, safe for colour-blind readers and
/// in grey print. Lengths in mm.
class ErrorScale {
 public:
  /// From 0 to a round number at or above `largest_mm`.
  explicit ErrorScale(double largest_mm);
  [[nodiscard]] std::string colour(double value_mm) const;
  [[nodiscard]] bool is_dark(double value_mm) const;  ///< text on it must be light
  [[nodiscard]] double top_mm() const { return top_mm_; }
  /// Bar with ticks and the words "distance real to virtual (mm)"; 40 units high.
  void draw(Svg& svg, double x, double y, double width) const;

 private:
  double top_mm_ = 1;
  double step_mm_ = 1;
};

}  // namespace drape::compare
