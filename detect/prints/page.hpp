// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

namespace drape::detect {

/// A filled circle on a page. Positions are from the upper left corner, x right, y down, metres.
struct PageDisc {
  Eigen::Vector2d centre_m;
  double radius_m = 0;
  bool dark = true;
};

struct PageBox {
  Eigen::Vector2d corner_m;  ///< upper left corner
  Eigen::Vector2d size_m;
};

/// Adjacent black boxes, filled as one shape to avoid visible seams.
struct PageArea {
  std::vector<PageBox> boxes;
};

/// A line of ASCII text.
struct PageText {
  Eigen::Vector2d baseline_m;  ///< left end of the baseline
  double height_m = 0;         ///< font size
  std::string text;
};

/// One sheet of paper at true size.
struct Page {
  Eigen::Vector2d size_m;
  std::string title;
  std::vector<std::variant<PageDisc, PageArea, PageText>> items;  ///< in painting order
};

/// PDF 1.4 with vector shapes only and coordinates to 0.1 um, which tells viewers not to scale it.
/// Deterministic.
[[nodiscard]] std::string pdf_of(const Page& page);

/// SVG 1.1 in millimetres, otherwise like pdf_of().
[[nodiscard]] std::string svg_of(const Page& page);

}  // namespace drape::detect
