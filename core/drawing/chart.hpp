// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/drawing/svg.hpp"

namespace drape {

inline constexpr const char* kNote = "fill=\"#555\"";  ///< colour of ticks and notes

/// Colours of series, safe for colour-blind readers (Okabe and Ito 2008).
inline constexpr std::array<const char*, 6> kSeries = {"#0072b2", "#d55e00", "#009e73",
                                                       "#cc79a7", "#56b4e9", "#8a6d00"};
/// Line of series `i`: every second three dashed, so that they differ in grey print too.
[[nodiscard]] std::string series_line(std::size_t i);

/// 1, 2, 2.5 or 5 times a power of ten, so that about `count` steps reach `largest`.
[[nodiscard]] double round_step(double largest, int count);

/// Multiples of a step from one value to another, both included within a millionth of a step.
[[nodiscard]] std::vector<double> ticks(double low, double high, double step);

/// Values along one side of a chart.
struct Axis {
  std::string label = {};
  double low = 0, high = 1;
  double step = 0;                ///< between ticks; 0: none
  const char* format = "{:.4g}";  ///< format of a tick
};
/// From `low` to `high` with about `count` ticks; whole steps where `whole`.
[[nodiscard]] Axis axis_over(std::string label, double low, double high, int count, bool whole);

/// A rectangle of a picture with linear axes.
class Chart {
 public:
  struct Area {
    double left, top, width, height;
  };
  /// Draws both axes; the picture outlives the chart.
  Chart(Svg& svg, const Area& area, Axis x, Axis y);

  /// Place of a point in the picture.
  [[nodiscard]] Eigen::Vector2d at(double x, double y) const;
  void curve(const std::vector<Eigen::Vector2d>& points, const std::string& style);
  /// From the axis up to `y`, or from `from` to `y`.
  void bar(double x_low, double x_high, double y, const std::string& style,
           const std::string& hover, double from = 0);

 private:
  Svg& svg_;
  Area area_;
  Axis x_, y_;
};

/// One line of a legend: a piece of line and its name.
void draw_legend_line(Svg& svg, const Eigen::Vector2d& at, const std::string& style,
                      const std::string& label);

}  // namespace drape
