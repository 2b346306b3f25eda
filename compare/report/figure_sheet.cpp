// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "compare/report/figures.hpp"
#include "compare/report/view.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::deg;
using units::mm;

constexpr double kPanel = 500;         ///< side of one view, picture units
constexpr double kMarkLift_m = 0.006;  ///< draws a mark before the cells around it

std::string mark_text(MarkId mark, const std::string& what) {
  return fmt::format("row {}, col {}: {}", mark.row, mark.col, what);
}

void paint_mark(Svg& svg, const Orthographic& view, const MarkError& mark,
                const ErrorScale& scale) {
  const std::string colour = scale.colour(mark.distance_m / mm);
  const Vector2d real = view.at(mark.real_in_world), simulated = view.at(mark.virtual_in_world);
  svg.line(real, simulated, "stroke=\"#1d2733\" stroke-width=\"2.6\" stroke-linecap=\"round\"");
  svg.line(real, simulated,
           fmt::format("stroke=\"{}\" stroke-width=\"1.4\" stroke-linecap=\"round\"", colour));
  svg.circle(real, 4.2, fmt::format("fill=\"{}\" stroke=\"#1d2733\" stroke-width=\"0.9\"", colour),
             mark_text(mark.mark, fmt::format("{:.2f} mm", mark.distance_m / mm)));
}

/// Draws the three world axes, 30 mm long, in the lower left corner of a view.
void draw_axes(Svg& svg, const Orthographic& view, const Vector2d& corner) {
  for (int axis = 0; axis < 3; ++axis) {
    const Vector2d arm = view.at(30 * mm * Vector3d::Unit(axis)) - view.origin;
    svg.line(corner, corner + arm, "stroke=\"#555\" stroke-width=\"1.2\"");
    svg.text(corner + 1.22 * arm + Vector2d(0, 4), std::string(1, "xyz"[axis]), 11, "middle",
             "fill=\"#555\"");
  }
}

void draw_band(Svg& svg, const Orthographic& view, const std::vector<BandMark>& band,
               const Sheet& measured) {
  for (const BandMark& one : band)
    svg.circle(view.at(one.mean_in_world), std::max(0.5, view.scale * one.radius95_m),
               "fill=\"#4c78a8\" fill-opacity=\"0.18\" stroke=\"#4c78a8\" stroke-width=\"0.7\"",
               mark_text(one.mark, fmt::format("95 % within {:.2f} mm", one.radius95_m / mm)));
  for (const BandMark& one : band) {
    const SheetMark* real = measured.find(one.mark);
    if (real == nullptr) continue;
    const double off_m = (real->point_in_world - one.mean_in_world).norm();
    svg.circle(view.at(real->point_in_world), 2.2,
               off_m <= one.radius95_m ? "fill=\"#1b7f3b\"" : "fill=\"#b3261e\"",
               mark_text(one.mark, fmt::format("real mark {:.2f} mm from the mean", off_m / mm)));
  }
}

/// Draws a box about each mark, as far as friction leaves its place open.
void draw_friction(Svg& svg, const Orthographic& view, const FrictionBand& band) {
  for (const MarkInterval& one : band.marks) {
    const Vector2d low = view.at(one.low_in_world), high = view.at(one.high_in_world);
    svg.rectangle(low.x(), high.y(), high.x() - low.x(), low.y() - high.y(),
                  "fill=\"none\" stroke=\"#b07a00\" stroke-width=\"0.7\"",
                  mark_text(one.mark, "left open by friction"));
  }
}

}  // namespace

std::optional<BranchList> list_of(const DrapeInput& input, const BranchSet& set) {
  const Simulation& first = input.simulations[set.branches.front().as_placed.simulation];
  return list_above(first.sheet.file, set.sha256);
}

Figure sheet_figure(const std::string& drape, const DrapeInput& input,
                    const RealVirtual& comparison) {
  const Simulation& simulation = input.simulations[comparison.simulation];
  const Sheet& sheet = simulation.sheet.sheet;
  const ErrorScale scale = scale_of(comparison);
  std::vector<Vector3d> points;
  for (const SheetMark& mark : sheet.marks) points.push_back(mark.point_in_world);
  for (const MarkError& mark : comparison.marks.marks) points.push_back(mark.real_in_world);
  std::array<Orthographic, 2> views = {Orthographic::from(-60 * deg, 32 * deg),
                                       Orthographic::from(120 * deg, 32 * deg)};
  const double height =
      std::max(views[0].fit(points, 0, kPanel, 20), views[1].fit(points, kPanel, kPanel, 20));
  const double bottom = height + 58;
  Svg svg(
      2 * kPanel, bottom,
      fmt::format("Drape {}: real marks and the simulated sheet {}", drape, simulation.label()));
  for (const Orthographic& view : views) {
    Painter painter(view.viewer());
    if (input.scene) painter.add_objects(*input.scene, sheet);
    painter.add_cloth(sheet);
    for (const MarkError& mark : comparison.marks.marks) {
      const bool real = view.toward.dot(mark.real_in_world - mark.virtual_in_world) > 0;
      painter.add(real ? mark.real_in_world : mark.virtual_in_world, kMarkLift_m,
                  [&](Svg& picture) { paint_mark(picture, view, mark, scale); });
    }
    painter.paint(svg);
    draw_axes(svg, view, {(&view == &views[0] ? 0 : kPanel) + 45, bottom - 40});
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

std::optional<Figure> band_figure(const std::string& drape, const DrapeInput& input,
                                  const BranchSet& set) {
  constexpr double kSide = 380, kMargin = 24;
  const auto list = list_of(input, set);
  if (!list || list->band.empty()) return std::nullopt;
  std::vector<Vector3d> points;
  for (const BandMark& one : list->band)
    for (const double end : {-1, 1})
      points.emplace_back(one.mean_in_world + Vector3d::Constant(end * one.radius95_m));
  Svg svg(2 * kSide, kSide + 20, "Bands of the marks of drape " + drape);
  for (const bool side : {false, true}) {
    Orthographic view{Vector3d::UnitX(), side ? Vector3d::UnitZ() : Vector3d::UnitY(),
                      side ? Vector3d(-Vector3d::UnitY()) : Vector3d::UnitZ()};
    const double left = side ? kSide : 0;
    view.fit(points, left, kSide, kMargin);
    svg.text({left + kMargin, 14}, side ? "from the side" : "from above", 12);
    draw_band(svg, view, list->band, input.measured.sheet);
    if (list->friction_band) draw_friction(svg, view, *list->friction_band);
  }
  return Figure{drape + "-band",
                "Where the ensemble's drapes have each mark: 95 % of them within the disc. Dots "
                "are the real marks, green in their band, red outside; boxes are "
                "what friction leaves open of the scene's own drape.",
                svg.finish()};
}

}  // namespace drape::compare
