// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "compare/meshes/obstacle_mesh.hpp"
#include "compare/report/figures.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::deg;
using units::mm;

constexpr double kPanel = 500;             ///< side of one view, picture units
constexpr double kObjectBehind_m = 0.003;  ///< cloth that touches is drawn over the object
constexpr double kMarkLift_m = 0.006;      ///< draws a mark before the cells around it

/// Orthographic view from an azimuth and an elevation.
struct View {
  Eigen::Vector3d right, up, toward;
  Eigen::Vector3d centre_m;
  double scale = 1;  ///< picture units per metre
  Eigen::Vector2d middle;

  View(double azimuth_rad, double elevation_rad) {
    const double ca = std::cos(azimuth_rad), sa = std::sin(azimuth_rad);
    const double ce = std::cos(elevation_rad), se = std::sin(elevation_rad);
    toward = {ca * ce, sa * ce, se};
    right = {-sa, ca, 0};
    up = toward.cross(right);
  }

  [[nodiscard]] Eigen::Vector2d draw(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d p = point - centre_m;
    return middle + scale * Eigen::Vector2d(right.dot(p), -up.dot(p));
  }
  [[nodiscard]] double nearness(const Eigen::Vector3d& point) const { return toward.dot(point); }
};

/// Something to paint, the far ones first.
struct Item {
  double nearness = 0;
  const MarkError* mark = nullptr;       ///< a mark, else the cell
  std::vector<Eigen::Vector3d> corners;  ///< of a cell
  bool object = false;                   ///< the cell is of the object under the cloth
};

std::string cell_colour(const std::vector<Eigen::Vector3d>& corners, const View& view,
                        bool object) {
  Eigen::Vector3d normal = (corners[1] - corners[0] + corners[2] - corners[3])
                               .cross(corners[3] - corners[0] + corners[2] - corners[1]);
  normal.normalize();
  const bool printed_side = normal.dot(view.toward) > 0;
  if (!printed_side) normal = -normal;
  const Eigen::Vector3d light = (view.toward + 0.55 * view.up - 0.45 * view.right).normalized();
  const double shade = 0.60 + 0.40 * std::max(0.0, normal.dot(light));
  const Eigen::Vector3d base = object         ? Eigen::Vector3d(205, 170, 120)
                               : printed_side ? Eigen::Vector3d(236, 239, 243)
                                              : Eigen::Vector3d(196, 190, 184);
  const Eigen::Vector3d colour = shade * base;
  return fmt::format("#{:02x}{:02x}{:02x}", std::lround(colour.x()), std::lround(colour.y()),
                     std::lround(colour.z()));
}

std::vector<Item> cells_of(const Sheet& sheet, const View& view) {
  std::vector<Item> items;
  for (int row = 0; row + 1 < sheet.rows; ++row) {
    for (int col = 0; col + 1 < sheet.cols; ++col) {
      const SheetMark *a = sheet.find({row, col}), *b = sheet.find({row + 1, col}),
                      *c = sheet.find({row + 1, col + 1}), *d = sheet.find({row, col + 1});
      if (!a || !b || !c || !d) continue;
      Item item;
      item.corners = {a->point_in_world, b->point_in_world, c->point_in_world, d->point_in_world};
      item.nearness = view.nearness(
          0.25 * (item.corners[0] + item.corners[1] + item.corners[2] + item.corners[3]));
      items.push_back(item);
    }
  }
  return items;
}

/// Faces of the object that look at the viewer.
std::vector<Item> object_items(const DrapeInput& input, const Sheet& cloth, const View& view) {
  std::vector<Item> items;
  if (!input.scene) return items;
  for (const auto& quad : uncovered_quads(*input.scene, cloth)) {
    if ((quad[2] - quad[0]).cross(quad[3] - quad[1]).dot(view.toward) <= 0) continue;
    Item item;
    item.corners.assign(quad.begin(), quad.end());
    item.nearness = view.nearness(0.25 * (quad[0] + quad[1] + quad[2] + quad[3])) - kObjectBehind_m;
    item.object = true;
    items.push_back(item);
  }
  return items;
}

void paint_mark(Svg& svg, const View& view, const MarkError& mark, const ErrorScale& scale) {
  const std::string colour = scale.colour(mark.distance_m / mm);
  const Eigen::Vector2d real = view.draw(mark.real_in_world),
                        simulated = view.draw(mark.virtual_in_world);
  svg.line(real, simulated, "stroke=\"#1d2733\" stroke-width=\"2.6\" stroke-linecap=\"round\"");
  svg.line(real, simulated,
           fmt::format("stroke=\"{}\" stroke-width=\"1.4\" stroke-linecap=\"round\"", colour));
  svg.circle(
      real, 4.2, fmt::format("fill=\"{}\" stroke=\"#1d2733\" stroke-width=\"0.9\"", colour),
      fmt::format("row {}, col {}: {:.2f} mm", mark.mark.row, mark.mark.col, mark.distance_m / mm));
}

void paint(Svg& svg, const View& view, const DrapeInput& input, const RealVirtual& comparison,
           const ErrorScale& scale) {
  const Sheet& cloth = input.simulations[comparison.simulation].sheet.sheet;
  std::vector<Item> items = object_items(input, cloth, view);
  const std::vector<Item> cells = cells_of(cloth, view);
  items.insert(items.end(), cells.begin(), cells.end());
  for (const MarkError& mark : comparison.marks.marks) {
    Item item;
    item.mark = &mark;
    item.nearness = kMarkLift_m + std::max(view.nearness(mark.real_in_world),
                                           view.nearness(mark.virtual_in_world));
    items.push_back(item);
  }
  std::stable_sort(items.begin(), items.end(),
                   [](const Item& a, const Item& b) { return a.nearness < b.nearness; });
  for (const Item& item : items) {
    if (item.mark) {
      paint_mark(svg, view, *item.mark, scale);
      continue;
    }
    const auto& c = item.corners;
    const std::string colour = cell_colour(c, view, item.object);
    const std::string edge = item.object ? fmt::format(" stroke=\"{}\"", colour) : "";
    svg.polygon({view.draw(c[0]), view.draw(c[1]), view.draw(c[2]), view.draw(c[3])},
                fmt::format("fill=\"{}\"{}", colour, edge));
  }
}

/// Fits the view to everything that is drawn; returns the height that it takes.
double fit(View& view, const Sheet& sheet, const RealVirtual& comparison, double left) {
  Eigen::Array2d low(1e9, 1e9), high(-1e9, -1e9);
  const auto extend = [&](const Eigen::Vector3d& point) {
    const Eigen::Array2d p(view.right.dot(point), view.up.dot(point));
    low = low.min(p);
    high = high.max(p);
  };
  for (const SheetMark& mark : sheet.marks) extend(mark.point_in_world);
  for (const MarkError& mark : comparison.marks.marks) extend(mark.real_in_world);
  const Eigen::Array2d middle = 0.5 * (low + high);
  view.centre_m = middle.x() * view.right + middle.y() * view.up;
  view.scale = (kPanel - 40) / (high - low).maxCoeff();
  const double height = view.scale * (high.y() - low.y()) + 30;
  view.middle = {left + kPanel / 2, height / 2};
  return height;
}

/// The three world axes, 30 mm long, in the lower left corner of a view.
void draw_axes(Svg& svg, const View& view, double left, double bottom) {
  const Eigen::Vector2d origin(left + 45, bottom - 40);
  const double length_m = 30 * mm;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    const Eigen::Vector2d arm =
        view.scale * length_m * Eigen::Vector2d(view.right.dot(unit), -view.up.dot(unit));
    svg.line(origin, origin + arm, "stroke=\"#555\" stroke-width=\"1.2\"");
    svg.text(origin + 1.22 * arm + Eigen::Vector2d(0, 4), std::string(1, "xyz"[axis]), 11, "middle",
             "fill=\"#555\"");
  }
}

}  // namespace

Figure sheet_figure(const std::string& drape, const DrapeInput& input,
                    const RealVirtual& comparison) {
  const Simulation& simulation = input.simulations[comparison.simulation];
  const Sheet& sheet = simulation.sheet.sheet;
  const ErrorScale scale = scale_of(comparison);
  std::array<View, 2> views = {View(-60 * deg, 32 * deg), View(120 * deg, 32 * deg)};
  double height = 0;
  for (std::size_t side = 0; side < 2; ++side) {
    const double left = kPanel * static_cast<double>(side);
    height = std::max(height, fit(views[side], sheet, comparison, left));
  }
  const double bottom = height + 58;
  Svg svg(
      2 * kPanel, bottom,
      fmt::format("Drape {}: real marks and the simulated sheet {}", drape, simulation.label()));
  for (std::size_t side = 0; side < 2; ++side) {
    svg.open_group("stroke=\"#8a94a0\" stroke-width=\"0.5\" stroke-linejoin=\"round\"");
    paint(svg, views[side], input, comparison, scale);
    svg.close_group();
    draw_axes(svg, views[side], kPanel * static_cast<double>(side), bottom);
  }
  const double bar = 50 * mm * views[0].scale;
  svg.line({150, bottom - 22}, {150 + bar, bottom - 22}, "stroke=\"#333\" stroke-width=\"2\"");
  svg.text({150 + bar / 2, bottom - 6}, "50 mm", 11, "middle", "fill=\"#333\"");
  scale.draw(svg, kPanel + 150, bottom - 44, 300);
  return {
      drape + "-sheet",
      fmt::format("Simulation {} (grey; darker where the back of the cloth is seen), the object "
                  "under it (brown) and the real marks, from two opposite sides. Each line leads "
                  "from a real mark to "
                  "the same point of the virtual cloth, true to scale; axes are 30 mm long.",
                  simulation.label()),
      svg.finish()};
}

}  // namespace drape::compare
