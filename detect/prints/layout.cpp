// SPDX-License-Identifier: Apache-2.0
#include "detect/prints/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/error.hpp"
#include "core/units.hpp"
#include "detect/families/tag_family.hpp"
#include "detect/prints/tags.hpp"

namespace drape::detect {
namespace {

using Eigen::Vector2d;
using units::mm;

constexpr double kBorder = 5 * mm;  // printers leave about so much of the paper white
constexpr double kFoot = 16 * mm;   // ruler and two lines of text
constexpr double kRulerStep = 10 * mm;
constexpr double kLine = 0.2 * mm;  // width of the corner marks
constexpr double kCornerLength = 4 * mm;
constexpr double kText = 2.6 * mm;
constexpr const char* kDots = "middle of the first to middle of the last dot";

struct Paper {
  const char* name;
  Vector2d size_m;
};

std::vector<Paper> paper_sizes_for(const std::string& wanted) {
  const std::array<Paper, 3> all = {{{"a4", Vector2d(210, 297) * mm},
                                     {"a3", Vector2d(297, 420) * mm},
                                     {"letter", Vector2d(215.9, 279.4) * mm}}};
  std::vector<Paper> result;
  for (const Paper& paper : all) {
    const bool automatic = wanted == "auto" && std::string(paper.name) != "letter";
    if (automatic || wanted == paper.name) result.push_back(paper);
  }
  return result;
}

/// A sheet of paper and where the print lies on it.
struct Place {
  std::string paper;
  Vector2d size_m;
  Vector2d corner_m;  ///< upper left corner of the print
};

Place place_on(const Vector2d& print_m, const PrintOptions& options) {
  const Vector2d needed = print_m + Vector2d(2 * kBorder, 2 * kBorder + kFoot);
  const auto on = [&](const std::string& name, const Vector2d& size) {
    return Place{name, size, {(size.x() - print_m.x()) / 2, kBorder}};
  };
  if (options.paper == "fit") {
    return on(fmt::format("{:g} x {:g} mm", needed.x() / mm, needed.y() / mm), needed);
  }
  constexpr double kRounding = 1e-9;
  for (const Paper& paper : paper_sizes_for(options.paper)) {
    const Vector2d turned(paper.size_m.y(), paper.size_m.x());
    if ((needed.array() <= paper.size_m.array() + kRounding).all()) {
      return on(paper.name, paper.size_m);
    }
    if ((needed.array() <= turned.array() + kRounding).all()) {
      return on(std::string(paper.name) + " landscape", turned);
    }
  }
  throw bad_input(
      fmt::format("the print needs {:.1f} x {:.1f} mm of paper with its border and ruler; {} "
                  "does not hold it",
                  needed.x() / mm, needed.y() / mm,
                  options.paper == "auto" ? "neither a4 nor a3" : options.paper),
      {.field = "--paper"}, "give --paper fit and a printer that takes such a sheet");
}

/// Black L-shaped marks that touch the print's corners from outside.
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

/// A ruler of whole centimetres, as long as the print allows up to 100 mm, in thin lines: a picture
/// of the print shows it too, and nothing on it may look like a dot. Ticks are centred on their
/// places.
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

void add_foot(PrintedPage& result, const Vector2d& corner, const Vector2d& size,
              const std::string& what) {
  const Vector2d at = corner + Vector2d(0, size.y() + 3 * mm);
  const double ruler = add_ruler(result.page, at, size.x());
  result.page.items.emplace_back(
      PageText{at + Vector2d(0, 3 * mm + 1.4 * kText), kText,
               fmt::format("{}. Print at 100 %. The ruler is {:.0f} mm long.", what, ruler / mm)});
  result.page.items.emplace_back(PageText{at + Vector2d(0, 3 * mm + 2.8 * kText), kText,
                                          fmt::format("Check lengths: {}.", result.check_text)});
}

/// The lengths that tell whether the print came out at its size, along a row and along a column.
void set_check_lengths(PrintedPage& result, const Vector2d& lengths_m, const char* places) {
  result.check_m = lengths_m;
  result.check_text = fmt::format("{:.2f} mm along a row, {:.2f} mm along a column, {}",
                                  lengths_m.x() / mm, lengths_m.y() / mm, places);
}

struct Grid {
  int rows, cols;
  double pitch_m, dot_diameter_m;
};

void add_dots(PrintedPage& result, const Grid& grid) {
  for (int row = 0; row < grid.rows; ++row) {
    for (int col = 0; col < grid.cols; ++col) {
      result.page.items.emplace_back(
          PageDisc{result.first_m + row * result.by_row_m + col * result.by_col_m,
                   grid.dot_diameter_m / 2, true});
    }
  }
}

void add_light_centres(PrintedPage& result, const DotClasses& classes) {
  for (int row = 0; row < static_cast<int>(classes.rows.size()); ++row) {
    for (int col = 0; col < static_cast<int>(classes.rows[row].size()); ++col) {
      if (!classes.is_light({row, col})) continue;
      result.page.items.emplace_back(
          PageDisc{result.first_m + row * result.by_row_m + col * result.by_col_m,
                   classes.light_centre_diameter_m / 2, false});
    }
  }
}

/// The board's squares: dark where the sum of a square's row and column is even, the square between
/// corners (0, 0) and (1, 1) being (0, 0); with tags where no tag lies.
void add_squares(PrintedPage& result, const Target& target) {
  PageArea dark;
  // The first tag's square, counted as the loops below do.
  const Vector2d light = target.tags.empty() ? Vector2d(0, 1)
                                             : (target.tags.front().centre_m / target.pitch_m +
                                                Vector2d(target.cols - 2, target.rows - 2) / 2);
  const int odd = std::abs(static_cast<int>(std::lround(light.x() + light.y())) + 1) % 2;
  for (int row = -1; row < target.rows; ++row) {
    for (int col = -1; col < target.cols; ++col) {
      if ((row + col + 2) % 2 != odd) continue;
      // Rows of a target go up the page, so a square hangs above its corner.
      const Vector2d corner = result.first_m + (row + 1) * result.by_row_m + col * result.by_col_m;
      dark.boxes.push_back({corner, {target.pitch_m, target.pitch_m}});
    }
  }
  result.page.items.emplace_back(dark);
}

/// A dot that is cut off with the patch has its centre elsewhere.
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

/// A tag is read against the white around it: one module must stay free up to the nearest dot.
void check_quiet_zone(const Grid& grid, double edge_m, const PageArea& tag, const Vector2d& to_dot,
                      int id) {
  const Vector2d beyond = (to_dot.cwiseAbs().array() - edge_m / 2).max(0).matrix();
  const double module_m = tag.boxes.front().size_m.y();
  if (beyond.norm() - grid.dot_diameter_m / 2 >= module_m) return;
  throw bad_input(
      fmt::format(
          "tag {} (edge {:g} mm) leaves {:.2f} mm to the nearest dot, one module is {:.2f} mm", id,
          edge_m / mm, (beyond.norm() - grid.dot_diameter_m / 2) / mm, module_m / mm),
      {.field = "tags.edge_mm"}, "make the tags or the dots smaller");
}

/// Black squares that fill the gaps' crossings, so that every corner of a tag is one where two dark
/// and two light quarters meet (Kalibr's AprilGrid).
void add_small_squares(PrintedPage& result, const Target& target) {
  const double gap = target.pitch_m - target.tag_edge_m;
  PageArea squares;
  for (int row = -1; row < target.rows; row += 2) {
    for (int col = -1; col < target.cols; col += 2) {
      const Vector2d steps(0.25 * (2 * col + 2), 0.25 * (2 * row + 2));
      const Vector2d middle = result.first_m + steps.x() * result.by_col_m +
                              steps.y() * result.by_row_m - Vector2d(1, -1) * (gap / 2);
      squares.boxes.push_back({middle - Vector2d::Constant(gap / 2), {gap, gap}});
    }
  }
  result.page.items.emplace_back(squares);
}

struct PlacedTag {
  int id;
  Vector2d centre_m;  ///< on the page
};

void add_tags(PrintedPage& result, const Grid& grid, const TagLook& look,
              const std::vector<PlacedTag>& tags) {
  for (const auto& [id, centre_m] : tags) {
    PageArea tag = tag_on_page(look, id, centre_m);
    const Vector2d steps = (centre_m - result.first_m) / grid.pitch_m;
    const Vector2d to_dot = grid.pitch_m * (steps.array() - steps.array().round()).matrix();
    if (grid.dot_diameter_m > 0) check_quiet_zone(grid, look.edge_m, tag, to_dot, id);
    result.page.items.emplace_back(std::move(tag));
  }
}

}  // namespace

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

void PrintOptions::check() const {
  if (paper != "fit" && paper_sizes_for(paper).empty()) {
    throw usage_error(fmt::format("the paper `{}` is not known", paper),
                      "give --paper auto, a4, a3, letter or fit");
  }
}

PrintedPage page_of(const Print& print, const PrintOptions& options) {
  options.check();
  check_margins(print);
  const Vector2d size(print.patch_m[1], print.patch_m[0]);  // weft to the right, warp down
  const Place place = place_on(size, options);
  const Grid grid{print.rows, print.cols, print.pitch_m, print.dot_diameter_m};
  PrintedPage result;
  result.paper = place.paper;
  result.page.size_m = place.size_m;
  result.page.title = fmt::format("drapebench cloth {}", print.file.stem().string());
  result.first_m = place.corner_m + Vector2d(print.margin_m[1], print.margin_m[0]);
  result.by_row_m = {0, print.pitch_m};
  result.by_col_m = {print.pitch_m, 0};
  set_check_lengths(result, print.pitch_m * Vector2d(print.cols - 1, print.rows - 1), kDots);
  result.page.items.emplace_back(corner_marks(place.corner_m, size));
  add_dots(result, grid);
  if (print.dot_classes) {
    check_windows(*print.dot_classes);
    add_light_centres(result, *print.dot_classes);
  }
  std::vector<PlacedTag> tags;
  for (const PrintedTag& tag : print.tags)
    tags.push_back({tag.id, place.corner_m + Vector2d(tag.centre_m[1], tag.centre_m[0])});
  add_tags(result, grid, {print.tag_family, print.tag_edge_m}, tags);
  add_foot(result, place.corner_m, size,
           fmt::format("Mark (0, 0) is upper left, rows down along the warp; patch {:g} x {:g} mm, "
                       "pitch {:g} mm",
                       size.x() / mm, size.y() / mm, print.pitch_m / mm));
  return result;
}

namespace {

/// Half of what the paper must hold around the outermost points, beyond the distance to them.
Vector2d half_size_of(const Target& target) {
  const Vector2d last = target.point_in_target({target.rows - 1, target.cols - 1}).head<2>();
  switch (target.kind) {
    case TargetKind::dot_grid:
      return last + Vector2d::Constant(target.pitch_m / 2);  // half a pitch of white
    case TargetKind::aprilgrid:                              // the small squares and as much white
      return last + Vector2d::Constant(2 * (target.pitch_m - target.tag_edge_m));
    default:  // the outer squares and half a square of white
      return last + Vector2d::Constant(1.5 * target.pitch_m);
  }
}

const char* check_places(const Target& target) {
  if (target.kind == TargetKind::dot_grid) return kDots;
  if (target.kind == TargetKind::aprilgrid)
    return "outer edge of the first to outer edge of the last tag";
  return "first to last corner where four squares meet";
}

/// A tag in a light square is read against the white around it.
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

}  // namespace

PrintedPage page_of(const Target& target, const std::string& name, const PrintOptions& options) {
  options.check();
  const Vector2d size = 2 * half_size_of(target);
  const Place place = place_on(size, options);
  const Grid grid{target.rows, target.cols, target.pitch_m, target.dot_diameter_m};
  PrintedPage result;
  result.paper = place.paper;
  result.page.size_m = place.size_m;
  result.page.title = fmt::format("drapebench target {}", name);
  const Vector2d middle = place.corner_m + size / 2;  // y of the target up, of the page down
  const Eigen::Vector3d first = target.point_in_target({0, 0});
  result.first_m = middle + Vector2d(first.x(), -first.y());
  result.by_row_m = {0, -target.pitch_m};
  result.by_col_m = {target.pitch_m, 0};
  const Eigen::Vector3d last = target.point_in_target({target.rows - 1, target.cols - 1});
  set_check_lengths(result, 2 * last.head<2>(), check_places(target));
  result.page.items.emplace_back(corner_marks(place.corner_m, size));
  if (target.kind == TargetKind::dot_grid) {
    add_dots(result, grid);
  } else if (target.kind == TargetKind::aprilgrid) {
    add_small_squares(result, target);
  } else {
    add_squares(result, target);
  }
  if (target.kind >= TargetKind::charuco) check_square_zone(target);
  std::vector<PlacedTag> tags;
  for (const PrintedTag& tag : target.tags)
    tags.push_back({tag.id, middle + Vector2d(tag.centre_m.x(), -tag.centre_m.y())});
  add_tags(result, grid, {target.tag_family, target.tag_edge_m, target.tag_border}, tags);
  add_foot(
      result, place.corner_m, size,
      fmt::format("{} (0, 0) is lower left, x right, y up; pitch {:g} mm",
                  target.kind == TargetKind::dot_grid ? "Dot" : "Corner", target.pitch_m / mm));
  return result;
}

}  // namespace drape::detect
