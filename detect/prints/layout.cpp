// SPDX-License-Identifier: Apache-2.0
#include "detect/prints/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/drawing/svg.hpp"
#include "core/files/files.hpp"
#include "core/prints/face.hpp"
#include "core/units.hpp"

namespace drape::detect {
namespace {

using Eigen::Vector2d;
using units::mm;

/// Millimetres with up to four decimals, without trailing zeros.
std::string text_of(double metres) {
  return coordinate(metres / mm, 4);
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

constexpr double kBorder = 5 * mm;  // typical unprintable margin
constexpr double kFoot = 16 * mm;   // height of the ruler and two lines of text
constexpr double kRulerStep = 10 * mm;
constexpr double kLine = 0.2 * mm;  // width of the corner marks
constexpr double kCornerLength = 4 * mm;
constexpr double kText = 2.6 * mm;
constexpr const char* kDots = "middle of the first to middle of the last dot";

/// A sheet of paper with the position of the print on it.
struct Place {
  std::string paper;
  Vector2d size_m;
  Vector2d corner_m;  ///< upper left corner of the print
};

Place place_on(const Vector2d& print_m, Paper asked) {
  struct Sheet {
    Paper paper;
    Vector2d size_m;
  };
  const std::array<Sheet, 3> sheets = {{{Paper::a4, Vector2d(210, 297) * mm},
                                        {Paper::a3, Vector2d(297, 420) * mm},
                                        {Paper::letter, Vector2d(215.9, 279.4) * mm}}};
  const Vector2d needed = print_m + Vector2d(2 * kBorder, 2 * kBorder + kFoot);
  const auto on = [&](const std::string& name, const Vector2d& size) {
    return Place{name, size, {(size.x() - print_m.x()) / 2, kBorder}};
  };
  if (asked == Paper::fit)
    return on(fmt::format("{:g} x {:g} mm", needed.x() / mm, needed.y() / mm), needed);
  constexpr double kRounding = 1e-9;
  const auto holds = [&](const Vector2d& size) {
    return (needed.array() <= size.array() + kRounding).all();
  };
  for (const auto& [paper, size] : sheets) {
    if (paper != asked && (asked != Paper::automatic || paper == Paper::letter)) continue;
    const std::string name(name_of(paper));
    if (holds(size)) return on(name, size);
    if (holds(size.reverse())) return on(name + " landscape", size.reverse());
  }
  throw bad_input(
      fmt::format("the print needs {:.1f} x {:.1f} mm of paper with its border and ruler; {} "
                  "does not hold it",
                  needed.x() / mm, needed.y() / mm,
                  asked == Paper::automatic ? "neither a4 nor a3" : name_of(asked)),
      {.field = "--paper"}, "give --paper fit and a printer that takes such a sheet");
}

/// Black L-shaped marks at the corners of the print, touching it from outside.
PageArea corner_marks(const Vector2d& corner, const Vector2d& size) {
  PageArea area;
  for (const int right : {0, 1}) {
    for (const int down : {0, 1}) {
      const Vector2d at = corner + size.cwiseProduct(Vector2d(right, down));
      const double x = right == 0 ? -kCornerLength : 0, y = down == 0 ? -kCornerLength : 0;
      const double line_x = right == 0 ? -kLine : 0, line_y = down == 0 ? -kLine : 0;
      area.boxes.push_back({at + Vector2d(x, line_y), {kCornerLength, kLine}});
      area.boxes.push_back({at + Vector2d(line_x, y), {kLine, kCornerLength}});
    }
  }
  return area;
}

/// Adds a ruler of whole centimetres up to 100 mm, in thin lines: it also appears in
/// pictures of the print and must not resemble a dot. Ticks are centred on their
/// positions.
double add_ruler(Page& page, const Vector2d& at, double room_m) {
  const int steps = std::clamp(static_cast<int>(room_m / kRulerStep), 1, 10);
  const double length = steps * kRulerStep;
  PageArea ruler;
  ruler.boxes.push_back({at + Vector2d(0, 3 * mm - kLine), {length, kLine}});
  for (int i = 0; i <= steps; ++i)
    ruler.boxes.push_back({at + Vector2d(i * kRulerStep - kLine / 2, 0), {kLine, 3 * mm}});
  page.items.emplace_back(ruler);
  return length;
}

/// Adds ruler and text below the face, which extends from `least` to `most`.
void add_foot(PrintedPage& result, const Vector2d& least, const Vector2d& most,
              const std::string& what) {
  const Vector2d at = result.face_m + Vector2d(least.x(), most.y() + 3 * mm);
  const double ruler = add_ruler(result.page, at, most.x() - least.x());
  result.page.items.emplace_back(
      PageText{at + Vector2d(0, 3 * mm + 1.4 * kText), kText,
               fmt::format("{}. Print at 100 %. The ruler is {:.0f} mm long.", what, ruler / mm)});
  result.page.items.emplace_back(PageText{at + Vector2d(0, 3 * mm + 2.8 * kText), kText,
                                          fmt::format("Check lengths: {}.", result.check_text)});
}

/// Sets the lengths, along a row and along a column, that show if the print has its true size.
void set_check_lengths(PrintedPage& result, const Vector2d& lengths_m, const char* places) {
  result.check_m = lengths_m;
  result.check_text = fmt::format("{:.2f} mm along a row, {:.2f} mm along a column, {}",
                                  lengths_m.x() / mm, lengths_m.y() / mm, places);
}

/// Throws for a dot cut off at the edge of the patch, which would shift its centre.
void check_margins(const Print& print) {
  const Vector2d marks_m = print.pitch_m * Vector2d(print.rows - 1, print.cols - 1);
  const Vector2d least_m = print.margin_m.cwiseMin(print.patch_m - marks_m - print.margin_m);
  if (least_m.minCoeff() >= print.dot_diameter_m / 2) return;
  throw bad_input(
      fmt::format("the outermost dots, {:g} mm wide, lie across the edge of the patch: their "
                  "middles are {:g} mm from it",
                  print.dot_diameter_m / mm, least_m.minCoeff() / mm),
      {.file = print.file.string(), .field = "margin_mm"},
      "give marks that end inside the patch; a print of margin 0 is for simulations only");
}

/// Throws unless one module of white remains between each tag and the nearest dot.
template <class Sheet>
void check_quiet_zones(const Sheet& sheet) {
  if (sheet.tags.empty() || sheet.dot_diameter_m <= 0) return;
  const double module_m = sheet.tag_edge_m / TagFamily(sheet.tag_family).edge_modules();
  for (const PrintedTag& tag : sheet.tags) {
    const Vector2d steps =
        (face_point(sheet, tag) - face_point(sheet, MarkId{0, 0})) / sheet.pitch_m;
    const Vector2d to_dot = sheet.pitch_m * (steps.array() - steps.array().round()).matrix();
    const Vector2d beyond = (to_dot.cwiseAbs().array() - sheet.tag_edge_m / 2).max(0).matrix();
    const double free_m = beyond.norm() - sheet.dot_diameter_m / 2;
    if (free_m >= module_m) continue;
    throw bad_input(
        fmt::format(
            "tag {} (edge {:g} mm) leaves {:.2f} mm to the nearest dot, one module is {:.2f} mm",
            tag.id, sheet.tag_edge_m / mm, free_m / mm, module_m / mm),
        {.field = "tags.edge_mm"}, "make the tags or the dots smaller");
  }
}

/// Half of the page needed for the target, including its margin beyond the outermost points.
Vector2d half_size_of(const Target& target) {
  const Vector2d last = target.point_in_target({target.rows - 1, target.cols - 1}).head<2>();
  switch (target.kind) {
    case TargetKind::dot_grid:
      return last + Vector2d::Constant(target.pitch_m / 2);  // half a pitch of white margin
    case TargetKind::aprilgrid:                              // small squares and as much margin
      return last + Vector2d::Constant(2 * (target.pitch_m - target.tag_edge_m));
    default:  // outer squares and half a square of margin
      return last + Vector2d::Constant(1.5 * target.pitch_m);
  }
}

const char* check_places(const Target& target) {
  if (target.kind == TargetKind::dot_grid) return kDots;
  if (target.kind == TargetKind::aprilgrid)
    return "outer edge of the first to outer edge of the last tag";
  return "first to last corner where four squares meet";
}

/// Throws unless a tag in a light square has enough white around it.
void check_square_zone(const Target& target) {
  const TagFamily family(target.tag_family, target.tag_border);
  const double module_m = target.tag_edge_m / family.edge_modules();
  const double white_m =
      (target.pitch_m - target.tag_edge_m) / (target.kind == TargetKind::charuco ? 2 : 1);
  if (white_m >= module_m) return;
  throw bad_input(
      fmt::format("the tags leave {:.2f} mm of white around them, one module is {:.2f} mm",
                  white_m / mm, module_m / mm),
      {.field = "tags.edge_mm"}, "make the tags smaller");
}

/// Draws a face with corner marks and foot on a page; `least` and `most` bound the printed
/// area.
PrintedPage lay_out(const Face& face, const Vector2d& least, const Vector2d& most, Paper paper) {
  const Vector2d size = most - least;
  const Place place = place_on(size, paper);
  PrintedPage result;
  result.paper = place.paper;
  result.face_m = place.corner_m - least;
  result.page.size_m = place.size_m;
  result.page.items.emplace_back(corner_marks(place.corner_m, size));
  for (const std::vector<FaceBox>& boxes : face.areas) {
    PageArea area;
    for (const FaceBox& box : boxes)
      area.boxes.push_back({result.face_m + box.least, box.most - box.least});
    result.page.items.emplace_back(std::move(area));
  }
  for (const FaceDisc& disc : face.discs)
    result.page.items.emplace_back(
        PageDisc{result.face_m + disc.centre, disc.radius_m, disc.ink > 0});
  return result;
}

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

std::string printing_advice(const std::filesystem::path& description) {
  return fmt::format(
      "print at 100 % and measure both check lengths; if both are longer or shorter by one factor, "
      "multiply every number in mm of {} by it, else print again without fitting to the page",
      description.string());
}

void check_windows(const DotClasses& classes) {
  std::map<std::string, MarkId> seen;
  for (std::size_t row = 0; row + 2 < classes.rows.size(); ++row) {
    for (std::size_t col = 0; col + 2 < classes.rows[row].size(); ++col) {
      std::string window;
      for (std::size_t i = 0; i < 3; ++i) window += classes.rows[row + i].substr(col, 3);
      const MarkId here{static_cast<int>(row), static_cast<int>(col)};
      const auto [first, is_new] = seen.emplace(window, here);
      if (is_new) continue;
      throw bad_input(fmt::format("the 3 x 3 dots from ({}, {}) look like those from ({}, {})",
                                  here.row, here.col, first->second.row, first->second.col),
                      {.field = "dot_classes.rows"},
                      "take an arrangement in which every window occurs once");
    }
  }
}

PrintedPage page_of(const Print& print, Paper paper) {
  check_margins(print);
  if (print.dot_classes) check_windows(*print.dot_classes);
  check_quiet_zones(print);
  const Vector2d size = print.patch_m.reverse();  // weft to the right, warp down
  PrintedPage result = lay_out(face_of(print), {0, 0}, size, paper);
  result.page.title = fmt::format("drapebench cloth {}", print.file.stem().string());
  set_check_lengths(result, print.pitch_m * Vector2d(print.cols - 1, print.rows - 1), kDots);
  add_foot(result, {0, 0}, size,
           fmt::format("Mark (0, 0) is upper left, rows down along the warp; patch {:g} x {:g} mm, "
                       "pitch {:g} mm",
                       size.x() / mm, size.y() / mm, print.pitch_m / mm));
  return result;
}

PrintedPage page_of(const Target& target, const std::string& name, Paper paper) {
  const bool dots = target.kind == TargetKind::dot_grid;
  if (target.kind >= TargetKind::charuco) check_square_zone(target);
  check_quiet_zones(target);
  const Vector2d half = half_size_of(target);
  PrintedPage result = lay_out(face_of(target), -half, half, paper);
  result.page.title = fmt::format("drapebench target {}", name);
  const Eigen::Vector3d last = target.point_in_target({target.rows - 1, target.cols - 1});
  set_check_lengths(result, 2 * last.head<2>(), check_places(target));
  add_foot(result, -half, half,
           fmt::format("{} (0, 0) is lower left, x right, y up; pitch {:g} mm",
                       dots ? "Dot" : "Corner", target.pitch_m / mm));
  return result;
}

Target object_plate(double size_m, int first_id) {
  // As on the cloth's print: dots wide enough for a hundredth of a pixel, tags readable from the
  // same distance as those of the cloth, one module of white in between.
  constexpr double kLeastPitch_m = 15 * mm;
  constexpr double kDotPart = 0.3, kTagPart = 0.55;
  const int dots = static_cast<int>(std::floor(size_m / kLeastPitch_m));
  if (dots < 3)
    throw usage_error(fmt::format("a plate of {:g} mm holds too few dots", size_m / mm),
                      "give --size-mm 45 or more");
  Target plate;
  plate.rows = plate.cols = dots;
  plate.pitch_m = size_m / dots;
  plate.dot_diameter_m = kDotPart * plate.pitch_m;
  plate.tag_family = "tag36h11";
  plate.tag_edge_m = kTagPart * plate.pitch_m;
  const double corner_m = 0.5 * (dots - 2) * plate.pitch_m;
  for (const double y : {-corner_m, corner_m})
    for (const double x : {-corner_m, corner_m}) plate.tags.push_back({first_id++, {x, y}});
  return plate;
}

std::string object_plate_toml(const Target& plate) {
  std::string text = fmt::format(
      "schema = \"drapebench/target/1\"\n"
      "# Sheet of {:g} mm on an object: cut along the corner marks and lay it edge on edge on a "
      "box,\n# or cut a hole in the middle that carries a sphere.\n"
      "kind = \"dot-grid\"\nrows = {}\ncols = {}\npitch_mm = {:.6f}\ndot_diameter_mm = {:.6f}\n\n"
      "[tags]\nfamily = \"{}\"\nedge_mm = {:.6f}\n",
      plate.pitch_m * plate.cols / mm, plate.rows, plate.cols, plate.pitch_m / mm,
      plate.dot_diameter_m / mm, plate.tag_family, plate.tag_edge_m / mm);
  for (const PrintedTag& tag : plate.tags)
    text += fmt::format("\n[[tags.tag]]\nid = {}\ncentre_mm = [{:.6f}, {:.6f}]\n", tag.id,
                        tag.centre_m.x() / mm, tag.centre_m.y() / mm);
  return text;
}

}  // namespace drape::detect
