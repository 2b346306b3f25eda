// SPDX-License-Identifier: Apache-2.0
#include "core/drawing/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace drape {

std::string series_line(std::size_t i) {
  return fmt::format("stroke=\"{}\" stroke-width=\"1.6\"{}", kSeries[i % kSeries.size()],
                     i / 3 % 2 == 1 ? " stroke-dasharray=\"6 3\"" : "");
}

double round_step(double largest, int count) {
  const double rough = largest / count;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 2.5, 5.0})
    if (factor * power >= rough * (1 - 1e-9)) return factor * power;
  return 10 * power;
}

std::vector<double> ticks(double low, double high, double step) {
  const double first = std::ceil(low / step - 1e-6), last = std::floor(high / step + 1e-6);
  std::vector<double> values(static_cast<std::size_t>(std::max(last - first + 1, 0.0)));
  for (std::size_t k = 0; k < values.size(); ++k)
    values[k] = (first + static_cast<double>(k)) * step;
  return values;
}

Axis axis_over(std::string label, double low, double high, int count, bool whole) {
  if (!(high > low)) high = low + 1;
  const double step = round_step(high - low, count);
  if (whole) {
    low = step * std::floor(low / step + 1e-9);
    high = step * std::ceil(high / step - 1e-9);
  }
  return {std::move(label), low, high, step};
}

Chart::Chart(Svg& svg, const Area& area, Axis x, Axis y)
    : svg_(svg), area_(area), x_(std::move(x)), y_(std::move(y)) {
  const double bottom = area.top + area.height, right = area.left + area.width;
  const auto values = [](const Axis& axis) {
    return axis.step > 0 ? ticks(axis.low, axis.high, axis.step) : std::vector<double>();
  };
  for (const double value : values(y_)) {
    const Eigen::Vector2d place = at(x_.low, value);
    svg.line(place, {right, place.y()}, "stroke=\"#e3e6ea\"");
    svg.text(place + Eigen::Vector2d(-6, 4), fmt::format(fmt::runtime(y_.format), value + 0.0), 11,
             "end", kNote);
  }
  for (const double value : values(x_)) {
    const Eigen::Vector2d place = at(value, y_.low);
    svg.line(place, place + Eigen::Vector2d(0, 5), "stroke=\"#555\"");
    svg.text(place + Eigen::Vector2d(0, 17), fmt::format(fmt::runtime(x_.format), value + 0.0), 11,
             "middle", kNote);
  }
  svg.line({area.left, bottom}, {right, bottom}, "stroke=\"#555\"");
  svg.text({(area.left + right) / 2, bottom + 34}, x_.label, 12, "middle", "fill=\"#333\"");
  svg.text_upwards({area.left - 42, (area.top + bottom) / 2}, y_.label, 12);
}

Eigen::Vector2d Chart::at(double x, double y) const {
  return {area_.left + area_.width * (x - x_.low) / (x_.high - x_.low),
          area_.top + area_.height * (y_.high - y) / (y_.high - y_.low)};
}

void Chart::curve(const std::vector<Eigen::Vector2d>& points, const std::string& style) {
  std::vector<Eigen::Vector2d> places;
  for (const Eigen::Vector2d& p : points) places.push_back(at(p.x(), p.y()));
  svg_.polyline(places, style);
}

void draw_legend_line(Svg& svg, const Eigen::Vector2d& at, const std::string& style,
                      const std::string& label) {
  svg.line(at, at + Eigen::Vector2d(24, 0), style);
  svg.text(at + Eigen::Vector2d(30, 4), label, 12);
}

}  // namespace drape
