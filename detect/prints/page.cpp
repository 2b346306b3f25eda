// SPDX-License-Identifier: Apache-2.0
#include "detect/prints/page.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/drawing/svg.hpp"
#include "core/units.hpp"

namespace drape::detect {
namespace {

using Eigen::Vector2d;
using units::mm;

/// Millimetres with up to four decimals, without trailing zeros.
std::string text_of(double metres) {
  std::string text = fmt::format("{:.4f}", metres / mm);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string pdf_text(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += (c == '\\' || c == '(' || c == ')' ? "\\" : "") + std::string(1, c);
  return result;
}

/// Writes PDF content streams, with y flipped to point down.
class PdfContent {
 public:
  explicit PdfContent(double page_height_m) : height_m_(page_height_m) {}

  void operator()(const PageDisc& disc) {
    // Eight cubic arcs approximate a circle to 4e-6 of the radius.
    constexpr int kArcs = 8;
    const double angle = 2 * std::numbers::pi / kArcs;
    const double handle = 4.0 / 3.0 * std::tan(angle / 4);
    const auto at = [&](double a) { return Vector2d(std::cos(a), std::sin(a)); };
    const auto along = [&](double a) { return Vector2d(-std::sin(a), std::cos(a)); };
    const auto place = [&](const Vector2d& unit) {
      return point(disc.centre_m + disc.radius_m * unit);
    };
    text += fmt::format("{} g {} m\n", disc.dark ? 0 : 1, place(at(0)));
    for (int i = 0; i < kArcs; ++i) {
      const double from = angle * i, to = angle * (i + 1);
      text += fmt::format("{} {} {} c\n", place(at(from) + handle * along(from)),
                          place(at(to) - handle * along(to)), place(at(to)));
    }
    text += "f\n";
  }

  void operator()(const PageArea& area) {
    text += "0 g\n";
    for (const PageBox& box : area.boxes) {
      const Vector2d lower_left(box.corner_m.x(), box.corner_m.y() + box.size_m.y());
      text += fmt::format("{} {} {} re\n", point(lower_left), text_of(box.size_m.x()),
                          text_of(box.size_m.y()));
    }
    text += "f\n";
  }

  void operator()(const PageText& line) {
    text += fmt::format("0 g BT /F1 {} Tf {} Td ({}) Tj ET\n", text_of(line.height_m),
                        point(line.baseline_m), pdf_text(line.text));
  }

  std::string text;

 private:
  [[nodiscard]] std::string point(const Vector2d& p) const {
    return text_of(p.x()) + " " + text_of(height_m_ - p.y());
  }
  double height_m_;
};

struct SvgContent {
  std::string text;

  void operator()(const PageDisc& disc) {
    text += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\"{}/>\n", text_of(disc.centre_m.x()),
                        text_of(disc.centre_m.y()), text_of(disc.radius_m),
                        disc.dark ? "" : " fill=\"#fff\"");
  }

  void operator()(const PageArea& area) {
    text += "<path d=\"";
    for (const PageBox& box : area.boxes) {
      const std::string width = text_of(box.size_m.x());
      text += fmt::format("M{} {}h{}v{}h-{}z", text_of(box.corner_m.x()), text_of(box.corner_m.y()),
                          width, text_of(box.size_m.y()), width);
    }
    text += "\"/>\n";
  }

  void operator()(const PageText& line) {
    text += fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\">{}</text>\n",
                        text_of(line.baseline_m.x()), text_of(line.baseline_m.y()),
                        text_of(line.height_m), xml(line.text));
  }
};

}  // namespace

std::string pdf_of(const Page& page) {
  constexpr double kPointsPerMm = 72 / 25.4;
  PdfContent content(page.size_m.y());
  content.text = fmt::format("{0:.10f} 0 0 {0:.10f} 0 0 cm\n", kPointsPerMm);
  for (const auto& item : page.items) std::visit(content, item);
  const Vector2d size = page.size_m / mm * kPointsPerMm;
  const std::vector<std::string> objects = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.6f} {:.6f}] /Contents 4 0 R "
                  "/Resources << /Font << /F1 5 0 R >> >> >>",
                  size.x(), size.y()),
      fmt::format("<< /Length {} >>\nstream\n{}endstream", content.text.size(), content.text),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
      fmt::format("<< /Title ({}) /Producer (drapebench) >>", pdf_text(page.title))};
  std::string file = "%PDF-1.4\n";
  std::string places = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    places += fmt::format("{:010} 00000 n \n", file.size());
    file += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  const std::size_t start = file.size();
  return file + places +
         fmt::format("trailer\n<< /Size {} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{}\n%%EOF\n",
                     objects.size() + 1, start);
}

std::string svg_of(const Page& page) {
  SvgContent content;
  for (const auto& item : page.items) std::visit(content, item);
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" "
      "viewBox=\"0 0 {0} {1}\" font-family=\"Helvetica, Arial, sans-serif\">\n<title>{2}</title>\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n{3}</svg>\n",
      text_of(page.size_m.x()), text_of(page.size_m.y()), xml(page.title), content.text);
}

}  // namespace drape::detect
