// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

namespace drape::detect {

/// A filled circle on a page. Positions from the upper left corner, x right, y down, metres.
struct PageDisc {
  Eigen::Vector2d centre_m;
  double radius_m = 0;
  bool dark = true;
};

struct PageBox {
  Eigen::Vector2d corner_m;  ///< upper left
  Eigen::Vector2d size_m;
};

/// Black boxes that touch, filled as one shape so that no seam shows between them.
struct PageArea {
  std::vector<PageBox> boxes;
};

/// A line of plain ASCII text.
struct PageText {
  Eigen::Vector2d baseline_m;  ///< left end
  double height_m = 0;         ///< font size
  std::string text;
};

/// One sheet of paper at its true size.
struct Page {
  Eigen::Vector2d size_m;
  std::string title;
  std::vector<std::variant<PageDisc, PageArea, PageText>> items;  ///< in the order of painting
};

/// PDF 1.4 with vector shapes only, coordinates to 0.1 um, that tells viewers not to scale it. The
/// same page gives the same bytes.
[[nodiscard]] std::string pdf_of(const Page& page);

/// SVG 1.1 in millimetres, otherwise as pdf_of().
[[nodiscard]] std::string svg_of(const Page& page);

}  // namespace drape::detect
