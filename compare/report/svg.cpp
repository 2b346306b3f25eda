// SPDX-License-Identifier: Apache-2.0
#include "compare/report/svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace drape::compare {
namespace {

constexpr const char* kFont =
    "system-ui, -apple-system, 'Segoe UI', Roboto, 'Noto Sans', 'DejaVu Sans', sans-serif";

std::string point_list(const std::vector<Eigen::Vector2d>& points) {
  std::string text;
  for (const Eigen::Vector2d& p : points)
    text += (text.empty() ? "" : " ") + coordinate(p.x()) + "," + coordinate(p.y());
  return text;
}

using Colour = std::array<double, 3>;

/// Viridis at eleven even places.
constexpr std::array<Colour, 11> kViridis{{{68, 1, 84},
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

Colour viridis(double t) {
  const double place = std::clamp(t, 0.0, 1.0) * (kViridis.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
  const double part = place - static_cast<double>(below);
  Colour colour{};
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] = kViridis[below][k] + part * (kViridis[below + 1][k] - kViridis[below][k]);
  return colour;
}

std::string hex(const Colour& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", std::lround(colour[0]), std::lround(colour[1]),
                     std::lround(colour[2]));
}

}  // namespace

std::string xml(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        // Control characters are not allowed in XML at all.
        safe += static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' ? ' ' : c;
    }
  }
  return safe;
}

std::string coordinate(double value) {
  std::string text = fmt::format("{:.2f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

Svg::Svg(double width, double height, const std::string& title, const Eigen::Vector2d& origin) {
  head_ = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{4} {5} {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" role=\"img\" font-family=\"{2}\"><title>{3}</title>\n",
      coordinate(width), coordinate(height), kFont, xml(title), coordinate(origin.x()),
      coordinate(origin.y()));
}

void Svg::element(const std::string& tag, const std::string& attributes, const std::string& hover) {
  if (hover.empty()) {
    body_ += fmt::format("<{} {}/>\n", tag, attributes);
  } else {
    body_ += fmt::format("<{0} {1}><title>{2}</title></{0}>\n", tag, attributes, xml(hover));
  }
}

void Svg::rectangle(double x, double y, double width, double height, const std::string& style,
                    const std::string& hover) {
  element("rect",
          fmt::format("x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" {}", coordinate(x),
                      coordinate(y), coordinate(width), coordinate(height), style),
          hover);
}

void Svg::circle(const Eigen::Vector2d& centre, double radius, const std::string& style,
                 const std::string& hover) {
  element("circle",
          fmt::format("cx=\"{}\" cy=\"{}\" r=\"{}\" {}", coordinate(centre.x()),
                      coordinate(centre.y()), coordinate(radius), style),
          hover);
}

void Svg::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const std::string& style) {
  element("line",
          fmt::format("x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" {}", coordinate(from.x()),
                      coordinate(from.y()), coordinate(to.x()), coordinate(to.y()), style),
          {});
}

void Svg::polyline(const std::vector<Eigen::Vector2d>& points, const std::string& style) {
  if (points.size() > 1)
    element("polyline", fmt::format("points=\"{}\" fill=\"none\" {}", point_list(points), style),
            {});
}

void Svg::polygon(const std::vector<Eigen::Vector2d>& points, const std::string& style) {
  element("polygon", fmt::format("points=\"{}\" {}", point_list(points), style), {});
}

void Svg::text(const Eigen::Vector2d& at, const std::string& text, double size,
               const std::string& anchor, const std::string& style) {
  body_ += fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"{}\" {}>{}</text>\n",
                       coordinate(at.x()), coordinate(at.y()), coordinate(size), anchor,
                       style.empty() ? "fill=\"#222\"" : style, xml(text));
}

void Svg::image(double x, double y, double width, double height, const std::string& data_uri,
                const std::string& id) {
  element("image",
          fmt::format("x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
                      "href=\"{}\"{}",
                      coordinate(x), coordinate(y), coordinate(width), coordinate(height), data_uri,
                      id.empty() ? "" : " id=\"" + xml(id) + "\""),
          {});
}

void Svg::open_group(const std::string& style) {
  body_ += fmt::format("<g {}>\n", style);
}

void Svg::close_group() {
  body_ += "</g>\n";
}

std::string Svg::finish() const {
  return head_ + body_ + "</svg>\n";
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

ErrorScale::ErrorScale(double largest_mm) {
  const double largest = largest_mm > 1e-6 ? largest_mm : 1.0;
  step_mm_ = round_step(largest, 5);
  top_mm_ = step_mm_ * std::ceil(largest / step_mm_ * (1 - 1e-9));
}

std::string ErrorScale::colour(double value_mm) const {
  return hex(viridis(value_mm / top_mm_));
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
  for (int i = 0; i * step_mm_ <= top_mm_ * (1 + 1e-9); ++i) {
    const double at = x + width * i * step_mm_ / top_mm_;
    svg.line({at, y + 10}, {at, y + 14}, "stroke=\"#444\"");
    svg.text({at, y + 25}, fmt::format("{:g}", i * step_mm_), 11, "middle", "fill=\"#333\"");
  }
  svg.text({x + width / 2, y + 39}, "distance real to virtual (mm)", 11, "middle", "fill=\"#333\"");
}

std::string base64(const std::vector<unsigned char>& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = bytes.size() - i;
    const unsigned word = static_cast<unsigned>(bytes[i]) << 16 |
                          (left > 1 ? static_cast<unsigned>(bytes[i + 1]) << 8 : 0U) |
                          (left > 2 ? static_cast<unsigned>(bytes[i + 2]) : 0U);
    text += kDigits[word >> 18 & 63];
    text += kDigits[word >> 12 & 63];
    text += left > 1 ? kDigits[word >> 6 & 63] : '=';
    text += left > 2 ? kDigits[word & 63] : '=';
  }
  return text;
}

std::string jpeg_data_uri(const std::vector<unsigned char>& bytes) {
  return "data:image/jpeg;base64," + base64(bytes);
}

}  // namespace drape::compare
