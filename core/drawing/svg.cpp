// SPDX-License-Identifier: Apache-2.0
#include "core/drawing/svg.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <utility>

namespace drape {
namespace {

constexpr const char* kFont =
    "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', 'DejaVu Sans', sans-serif";

std::string numbers(std::initializer_list<std::pair<const char*, double>> attributes) {
  std::string text;
  for (const auto& [name, value] : attributes)
    text += fmt::format("{}=\"{}\" ", name, coordinate(value));
  return text;
}

std::string point_list(const std::vector<Eigen::Vector2d>& points) {
  std::string text;
  for (const Eigen::Vector2d& p : points)
    text += (text.empty() ? "" : " ") + coordinate(p.x()) + "," + coordinate(p.y());
  return "points=\"" + text + "\" ";
}

}  // namespace

std::string xml(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else if (c == '"')
      safe += "&quot;";
    else  // XML forbids control characters
      safe += static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' ? ' ' : c;
  }
  return safe;
}

std::string coordinate(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string base64(const std::vector<unsigned char>& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = bytes.size() - i;
    const unsigned word =
        bytes[i] << 16U | (left > 1 ? bytes[i + 1] << 8U : 0U) | (left > 2 ? bytes[i + 2] : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= left ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

Svg::Svg(double width, double height, const std::string& title, const Eigen::Vector2d& origin)
    : body_(fmt::format(
          "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{4} {5} {0} {1}\" width=\"{0}\" "
          "height=\"{1}\" role=\"img\" font-family=\"{2}\"><title>{3}</title>\n",
          coordinate(width), coordinate(height), kFont, xml(title), coordinate(origin.x()),
          coordinate(origin.y()))) {}

void Svg::element(const std::string& tag, const std::string& attributes, const std::string& hover) {
  body_ += fmt::format("<{} {}", tag, attributes);
  body_ += hover.empty() ? "/>\n" : fmt::format("><title>{}</title></{}>\n", xml(hover), tag);
}

void Svg::rectangle(double x, double y, double width, double height, const std::string& style,
                    const std::string& hover) {
  element("rect", numbers({{"x", x}, {"y", y}, {"width", width}, {"height", height}}) + style,
          hover);
}

void Svg::circle(const Eigen::Vector2d& centre, double radius, const std::string& style,
                 const std::string& hover) {
  element("circle", numbers({{"cx", centre.x()}, {"cy", centre.y()}, {"r", radius}}) + style,
          hover);
}

void Svg::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const std::string& style) {
  element("line",
          numbers({{"x1", from.x()}, {"y1", from.y()}, {"x2", to.x()}, {"y2", to.y()}}) + style,
          {});
}

void Svg::polyline(const std::vector<Eigen::Vector2d>& points, const std::string& style) {
  if (points.size() > 1) element("polyline", point_list(points) + "fill=\"none\" " + style, {});
}

void Svg::polygon(const std::vector<Eigen::Vector2d>& points, const std::string& style) {
  element("polygon", point_list(points) + style, {});
}

void Svg::text(const Eigen::Vector2d& at, const std::string& text, double size,
               const std::string& anchor, const std::string& style) {
  body_ += fmt::format("<text {}text-anchor=\"{}\" {}>{}</text>\n",
                       numbers({{"x", at.x()}, {"y", at.y()}, {"font-size", size}}), anchor,
                       style.empty() ? "fill=\"#222\"" : style, xml(text));
}

void Svg::text_upwards(const Eigen::Vector2d& at, const std::string& text, double size) {
  this->text(at, text, size, "middle",
             fmt::format("fill=\"#333\" transform=\"rotate(-90 {} {})\"", coordinate(at.x()),
                         coordinate(at.y())));
}

void Svg::open_group(const std::string& style) {
  body_ += fmt::format("<g {}>\n", style);
}

void Svg::close_group() {
  body_ += "</g>\n";
}

std::string Svg::finish() const {
  return body_ + "</svg>\n";
}

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
