// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace drape {

/// Escapes text for an element or a double-quoted attribute of XML or HTML.
[[nodiscard]] std::string xml(const std::string& text);

/// Shortest decimal text of a coordinate, with at most two decimals.
[[nodiscard]] std::string coordinate(double value, int decimals = 2);

[[nodiscard]] std::string base64(const std::vector<unsigned char>& bytes);

/// A standalone SVG picture, built element by element. Styles are attributes, so the picture looks
/// the same in its own file, in a page and in print.
class Svg {
 public:
  /// `title` is the text for screen readers, `origin` the coordinates of the upper left corner.
  Svg(double width, double height, const std::string& title,
      const Eigen::Vector2d& origin = Eigen::Vector2d::Zero());

  void rectangle(double x, double y, double width, double height, const std::string& style,
                 const std::string& hover = {});
  void circle(const Eigen::Vector2d& centre, double radius, const std::string& style,
              const std::string& hover = {});
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const std::string& style);
  void polyline(const std::vector<Eigen::Vector2d>& points, const std::string& style);
  void polygon(const std::vector<Eigen::Vector2d>& points, const std::string& style);
  /// `anchor` is "start", "middle" or "end".
  void text(const Eigen::Vector2d& at, const std::string& text, double size,
            const std::string& anchor = "start", const std::string& style = {});
  /// Text that reads upwards, centred on a point.
  void text_upwards(const Eigen::Vector2d& at, const std::string& text, double size);
  void open_group(const std::string& style);
  void close_group();

  [[nodiscard]] std::string finish() const;

 private:
  void element(const std::string& tag, const std::string& attributes, const std::string& hover);
  std::string body_;
};

inline constexpr const char* kNote = "fill=\"#555\"";  ///< colour attribute of ticks and notes

/// Colours of series, safe for colour-blind readers (Okabe and Ito 2008).
inline constexpr std::array<const char*, 6> kSeries = {"#0072b2", "#d55e00", "#009e73",
                                                       "#cc79a7", "#56b4e9", "#8a6d00"};
/// Line style of series `i`: every second group of three is dashed, to stay distinct in grey print.
[[nodiscard]] std::string series_line(std::size_t i);

/// Step of 1, 2, 2.5 or 5 times a power of ten that splits 0 to `largest` into about `count`.
[[nodiscard]] double round_step(double largest, int count);

/// Multiples of `step` from `low` to `high`, both included with a tolerance of 1e-6 steps.
[[nodiscard]] std::vector<double> ticks(double low, double high, double step);

/// Range, ticks and label of one axis.
struct Axis {
  std::string label = {};
  double low = 0, high = 1;
  double step = 0;                ///< distance between ticks; 0 for none
  const char* format = "{:.4g}";  ///< format of a tick label
};
/// Makes an axis from `low` to `high` with about `count` ticks, at whole numbers if `whole`.
[[nodiscard]] Axis axis_over(std::string label, double low, double high, int count, bool whole);

/// Rectangle of a picture with linear axes.
class Chart {
 public:
  struct Area {
    double left, top, width, height;
  };
  /// Draws both axes. The picture must outlive the chart.
  Chart(Svg& svg, const Area& area, Axis x, Axis y);

  /// Position in the picture of a point given in axis values.
  [[nodiscard]] Eigen::Vector2d at(double x, double y) const;
  void curve(const std::vector<Eigen::Vector2d>& points, const std::string& style);

 private:
  Svg& svg_;
  Area area_;
  Axis x_, y_;
};

/// Draws one entry of a legend: a short line and its name.
void draw_legend_line(Svg& svg, const Eigen::Vector2d& at, const std::string& style,
                      const std::string& label);

}  // namespace drape
