// SPDX-License-Identifier: Apache-2.0
#include "core/drawing/svg.hpp"

#include <fmt/format.h>

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

std::string coordinate(double value) {
  std::string text = fmt::format("{:.2f}", value);
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

}  // namespace drape
