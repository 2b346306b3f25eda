// SPDX-License-Identifier: Apache-2.0
#include "compare/report/error_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/drawing/chart.hpp"

namespace drape::compare {
namespace {

/// Viridis at eleven even places.
constexpr std::array<std::array<double, 3>, 11> kViridis{{{68, 1, 84},
                                                          {72, 36, 117},
                                                          {65, 68, 135},
                                                          {53, 95, 141},
                                                          {42, 120, 142},
                                                          {33, 145, 140},
                                                          {34, 168, 132},
                                                          {68, 191, 112},
                                                          {122, 209, 81},
                                                          {189, 223, 38},
                                                          {253, 231, 37}}};

}  // namespace

ErrorScale::ErrorScale(double largest_mm) {
  const double largest = largest_mm > 1e-6 ? largest_mm : 1.0;
  step_mm_ = round_step(largest, 5);
  top_mm_ = step_mm_ * std::ceil(largest / step_mm_ * (1 - 1e-9));
}

std::string ErrorScale::colour(double value_mm) const {
  const double place = std::clamp(value_mm / top_mm_, 0.0, 1.0) * (kViridis.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
  const Eigen::Vector3d low(kViridis[below].data()), high(kViridis[below + 1].data());
  return hex_colour(low + (place - static_cast<double>(below)) * (high - low));
}

bool ErrorScale::is_dark(double value_mm) const {
  return value_mm / top_mm_ < 0.55;
}

void ErrorScale::draw(Svg& svg, double x, double y, double width) const {
  constexpr int kPieces = 60;
  for (int i = 0; i < kPieces; ++i) {
    // Each piece overlaps the next by a little, else thin white lines show between them.
    const double left = x + width * i / kPieces;
    svg.rectangle(left, y, std::min(width / kPieces + 0.5, x + width - left), 10,
                  fmt::format("fill=\"{}\"", colour(top_mm_ * (i + 0.5) / kPieces)));
  }
  for (const double value : ticks(0, top_mm_, step_mm_)) {
    const Eigen::Vector2d at(x + width * value / top_mm_, y + 10);
    svg.line(at, at + Eigen::Vector2d(0, 4), "stroke=\"#444\"");
    svg.text(at + Eigen::Vector2d(0, 15), fmt::format("{:g}", value), 11, "middle",
             "fill=\"#333\"");
  }
  svg.text({x + width / 2, y + 39}, "distance real to virtual (mm)", 11, "middle", "fill=\"#333\"");
}

}  // namespace drape::compare
