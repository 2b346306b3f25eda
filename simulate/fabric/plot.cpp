// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/drawing/chart.hpp"
#include "core/units.hpp"
#include "simulate/fabric/fitted_laws.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;

constexpr double kWidth = 360, kHeight = 260;
constexpr const char* kUnloading = "stroke=\"#0072b2\" stroke-width=\"1\" stroke-dasharray=\"4 3\"";
constexpr const char* kPieces = "stroke=\"#cc0000\" stroke-width=\"1.5\"";

struct Panel {
  std::string title, x_label, y_label;
  double x_unit = 1, y_unit = 1;
  const KawabataCurve* curve = nullptr;
  const ForceCurve* line = nullptr;
  const ForceCurve* pieces = nullptr;
};

/// Points of an odd curve at its hinges, clipped at the edges of the panel.
std::vector<Vector2d> law_of(const ForceCurve& curve, const Panel& panel, const Vector2d& low,
                             const Vector2d& high) {
  std::vector<double> knots = {low.x(), 0, high.x()};
  for (const auto& hinge : curve.hinges)
    for (const double side : {-1, 1}) knots.push_back(side * hinge.at / panel.x_unit);
  std::sort(knots.begin(), knots.end());
  std::vector<Vector2d> points;
  for (double x : knots) {
    if (x < low.x() || x > high.x()) continue;
    double y = curve.odd_value(x * panel.x_unit) / panel.y_unit;
    if (y > high.y() || y < low.y()) {  // the line from the origin leaves the panel here
      x *= (y > 0 ? high.y() : low.y()) / y;
      y = curve.odd_value(x * panel.x_unit) / panel.y_unit;
    }
    points.emplace_back(x, y);
  }
  return points;
}

void draw(Svg& svg, const Panel& panel, double left, double top) {
  const KawabataCurve& c = *panel.curve;
  std::vector<Vector2d> loading, unloading;
  Vector2d low(c.x.front() / panel.x_unit, 0), high(c.x.back() / panel.x_unit, 0);
  for (std::size_t i = 0; i < c.x.size(); ++i) {
    loading.emplace_back(c.x[i] / panel.x_unit, c.loading[i] / panel.y_unit);
    unloading.emplace_back(c.x[i] / panel.x_unit, c.unloading[i] / panel.y_unit);
    for (const double y : {loading.back().y(), unloading.back().y()}) {
      low.y() = std::min(low.y(), y);
      high.y() = std::max(high.y(), y);
    }
  }
  svg.text({left + 62, top + 18}, panel.title, 13, "start", "fill=\"#222\" font-weight=\"bold\"");
  Chart chart(svg, {left + 62, top + 30, kWidth - 76, kHeight - 76},
              axis_over(panel.x_label, low.x(), high.x(), 6, false),
              axis_over(panel.y_label, low.y(), high.y(), 6, false));
  chart.curve(loading, series_line(0));
  chart.curve(unloading, kUnloading);
  chart.curve(law_of(*panel.line, panel, low, high), series_line(1));
  const std::vector<Vector2d> pieces = law_of(*panel.pieces, panel, low, high);
  chart.curve(pieces, kPieces);
  for (const Vector2d& p : pieces) svg.circle(chart.at(p.x(), p.y()), 2.5, "fill=\"#cc0000\"");
}

}  // namespace

std::string curves_svg(const Fabric& fabric, int segments) {
  const ClothLaws line = fit_laws(fabric, 1).laws, pieces = fit_laws(fabric, segments).laws;
  const std::string title =
      fmt::format("{}, {:g} g/m2", fabric.name, fabric.areal_density_kg_per_m2 / units::g_per_m2);
  Svg svg(3 * kWidth, 2 * kHeight + 60, title);
  svg.rectangle(0, 0, 3 * kWidth, 2 * kHeight + 60, "fill=\"#fff\"");
  svg.text({62, 18}, title, 13, "start", "fill=\"#222\" font-weight=\"bold\"");
  for (int d = 0; d < 2; ++d) {
    const std::string direction = d == 0 ? "warp" : "weft";
    const Panel panels[3] = {
        {"tensile " + direction, "strain (%)", "force (gf/cm)", units::percent, units::gf_per_cm,
         &fabric.tensile[d], &line.tensile[d], &pieces.tensile[d]},
        {fmt::format("shear {} (used: mean of warp and weft)", direction), "angle (degrees)",
         "force (gf/cm)", units::deg, units::gf_per_cm, &fabric.shear[d], &line.shear,
         &pieces.shear},
        {"bending " + direction, "curvature (1/cm)", "moment (gf cm/cm)", units::per_cm,
         units::gf_cm_per_cm, &fabric.bending[d], &line.bending[d], &pieces.bending[d]}};
    for (int k = 0; k < 3; ++k) draw(svg, panels[k], k * kWidth, 28 + d * kHeight);
  }
  double x = 62;
  for (const auto& [style, what] : {std::pair<std::string, std::string>{series_line(0), "loading"},
                                    {kUnloading, "unloading"},
                                    {series_line(1), "one segment"},
                                    {kPieces, fmt::format("{} segments, as used", segments)}}) {
    draw_legend_line(svg, {x, 2 * kHeight + 44}, style, what);
    x += 170;
  }
  return svg.finish();
}

}  // namespace drape::simulate
