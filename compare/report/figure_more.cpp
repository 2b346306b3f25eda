// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "compare/report/figures.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;
using units::percent;

constexpr std::array<const char*, 6> kColours = {"#0072b2", "#d55e00", "#009e73",
                                                 "#cc79a7", "#56b4e9", "#8a6d00"};

/// Blue where shorter, orange where longer, white at zero: safe for colour-blind readers.
std::string strain_colour(double ratio, double top) {
  const double t = std::clamp(ratio / top, -1.0, 1.0);
  const std::array<double, 3> end =
      t < 0 ? std::array<double, 3>{33, 102, 172} : std::array<double, 3>{203, 100, 20};
  std::array<long, 3> colour{};
  for (std::size_t k = 0; k < 3; ++k) colour[k] = std::lround(245 + std::abs(t) * (end[k] - 245));
  return fmt::format("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2]);
}

struct StrainPanel {
  double left, side, top;
  bool real;
};

void draw_strain(Svg& svg, const StrainPanel& panel, const RealVirtual& comparison, double top) {
  const auto place = [&](MarkId mark) -> Eigen::Vector2d {
    return {panel.left + panel.side * (mark.col + 0.5), panel.top + panel.side * (mark.row + 0.5)};
  };
  for (const AreaStrain& cell : comparison.strain.cells) {
    const double value = panel.real ? cell.real : cell.simulated;
    const Eigen::Vector2d corner = place(cell.corner);
    svg.rectangle(corner.x() + 3, corner.y() + 3, panel.side - 6, panel.side - 6,
                  fmt::format("fill=\"{}\"", strain_colour(value, top)),
                  fmt::format("area: {:+.1f} %", value / percent));
  }
  for (const EdgeStrain& edge : comparison.strain.edges) {
    const double value = panel.real ? edge.real : edge.simulated;
    svg.line(place(edge.from), place(edge.to),
             fmt::format("stroke=\"{}\" stroke-width=\"5\"", strain_colour(value, top)));
  }
}

double largest_strain(const RealVirtual& comparison) {
  std::vector<double> sizes = {0.01};
  for (const EdgeStrain& edge : comparison.strain.edges) {
    sizes.push_back(std::abs(edge.real));
    sizes.push_back(std::abs(edge.simulated));
  }
  return quantile(std::move(sizes), 0.95);
}

struct HemCurve {
  std::string label;
  const Drapemeter* value;
};

std::vector<HemCurve> hems_of(const DrapeInput& input, const Report& report) {
  std::vector<HemCurve> hems;
  if (report.measured_drapemeter.value)
    hems.push_back({"measured", &*report.measured_drapemeter.value});
  for (const RealVirtual& row : report.real_virtual) {
    const DrapemeterResult& result = report.drapemeters[row.simulation];
    if (result.value && hems.size() < kColours.size())
      hems.push_back({input.simulations[row.simulation].label(), &*result.value});
  }
  return hems;
}

/// "loading_moment_gf_cm_per_cm" as people read it: "moment (gf cm per cm)".
std::string axis_text(const std::string& column) {
  static constexpr std::array<std::string_view, 6> kUnits = {
      "_gf_cm_per_cm", "_gf_per_cm", "_percent", "_per_cm", "_deg", "_mm"};
  std::string name = column, unit;
  for (const std::string_view ending : kUnits) {
    if (!column.ends_with(ending)) continue;
    name = column.substr(0, column.size() - ending.size());
    unit = std::string(" (") + std::string(ending.substr(1)) + ")";
    break;
  }
  if (name.starts_with("loading_")) name.erase(0, 8);
  name += unit;
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

/// Loading and, where the file has it, unloading over the same axes: the gap between is the
/// hysteresis.
void draw_curve(Svg& svg, const FabricCurve& curve, double left, double top) {
  constexpr double kWide = 190, kTall = 110;
  const auto& columns = curve.points.columns;
  const auto& x = columns[0];
  const auto [x_low, x_high] = std::minmax_element(x.begin(), x.end());
  const std::size_t shown = std::min<std::size_t>(columns.size(), 3);
  double y_low = columns[1].front(), y_high = y_low;
  for (std::size_t k = 1; k < shown; ++k) {
    const auto [low, high] = std::minmax_element(columns[k].begin(), columns[k].end());
    y_low = std::min(y_low, *low);
    y_high = std::max(y_high, *high);
  }
  const double x_span = std::max(*x_high - *x_low, 1e-300),
               y_span = std::max(y_high - y_low, 1e-300);
  svg.rectangle(left, top, kWide, kTall, "fill=\"#f7f8fa\" stroke=\"#c9cfd6\"");
  for (std::size_t k = shown - 1; k >= 1; --k) {
    std::vector<Eigen::Vector2d> points;
    for (std::size_t i = 0; i < x.size(); ++i)
      points.emplace_back(left + kWide * (x[i] - *x_low) / x_span,
                          top + kTall * (1 - (columns[k][i] - y_low) / y_span));
    svg.polyline(points, k == 1 ? "stroke=\"#0072b2\" stroke-width=\"1.6\""
                                : "stroke=\"#d55e00\" stroke-width=\"1.4\" "
                                  "stroke-dasharray=\"4 3\"");
    if (k == 1)
      for (const Eigen::Vector2d& p : points) svg.circle(p, 1.4, "fill=\"#0072b2\"");
  }
  svg.text({left, top - 21}, curve.name, 12, "start", "fill=\"#222\" font-weight=\"600\"");
  svg.text({left, top - 7},
           fmt::format("{}, {:.3g} to {:.3g}", axis_text(curve.points.names[1]), y_low, y_high), 10,
           "start", kNote);
  svg.text({left, top + kTall + 14}, fmt::format("{:.3g}", *x_low), 10, "start", kNote);
  svg.text({left + kWide, top + kTall + 14}, fmt::format("{:.3g}", *x_high), 10, "end", kNote);
  svg.text({left + kWide / 2, top + kTall + 14}, axis_text(curve.points.names[0]), 10, "middle",
           kNote);
}

}  // namespace

Figure strain_figure(const std::string& drape, const DrapeInput& input,
                     const RealVirtual& comparison) {
  const Sheet& sheet = input.measured.sheet;
  const double side = 400.0 / std::max(sheet.rows, sheet.cols);
  const double top = largest_strain(comparison);
  const double height = 30 + side * sheet.rows + 50;
  Svg svg(900, height, fmt::format("Drape {}: strain between marks", drape));
  for (const bool real : {true, false}) {
    const double left = real ? 20 : 470;
    svg.text({left, 18}, real ? "measured" : "simulated, same places", 13, "start",
             "fill=\"#222\"");
    draw_strain(svg, {left, side, 24, real}, comparison, top);
  }
  for (int i = 0; i <= 40; ++i) {
    svg.rectangle(300 + 7.0 * i, height - 32, 7.3, 10,
                  fmt::format("fill=\"{}\"", strain_colour((i / 20.0 - 1) * top, top)));
  }
  for (const int end : {-1, 0, 1})
    svg.text({440.0 + 140 * end, height - 8}, fmt::format("{:+.1f} %", end * top / percent), 11,
             "middle", kNote);
  return {drape + "-strain",
          "Length of the straight line between neighbouring marks (lines) and area between four of "
          "them (tiles) against the flat print. Blue: shorter, as over a fold; orange: longer.",
          svg.finish()};
}

std::optional<Figure> hem_figure(const std::string& drape, const DrapeInput& input,
                                 const Report& report) {
  const std::vector<HemCurve> hems = hems_of(input, report);
  if (hems.empty()) return std::nullopt;
  double largest = 0;
  for (const HemCurve& hem : hems)
    for (const Harmonic& h : hem.value->spectrum) largest = std::max(largest, h.amplitude_m / mm);
  const double step = round_step(std::max(largest, 1e-3), 4);
  const double top = step * std::ceil(largest / step);
  const auto y = [&](double value) { return 20 + 200 * (1 - value / top); };
  Svg svg(760, 280, fmt::format("Drape {}: spectrum of the hem", drape));
  for (const double value : ticks(0, top, step)) {
    svg.line({60, y(value)}, {560, y(value)}, "stroke=\"#e3e6ea\"");
    svg.text({54, y(value) + 4}, fmt::format("{:g}", value), 11, "end", kNote);
  }
  const double wide = 500.0 / 24;
  for (std::size_t i = 0; i < hems.size(); ++i) {
    const double bar = 0.8 * wide / static_cast<double>(hems.size());
    for (const Harmonic& h : hems[i].value->spectrum) {
      const double left = 60 + wide * (h.order - 0.9) + bar * static_cast<double>(i);
      svg.rectangle(
          left, y(h.amplitude_m / mm), bar, y(0) - y(h.amplitude_m / mm),
          fmt::format("fill=\"{}\"", kColours[i]),
          fmt::format("{}: order {}, {:.2f} mm", hems[i].label, h.order, h.amplitude_m / mm));
    }
    const double at = 30 + 19.0 * static_cast<double>(i);
    svg.rectangle(575, at - 9, 12, 12, fmt::format("fill=\"{}\"", kColours[i]));
    svg.text({593, at + 1}, hems[i].label, 12, "start", "fill=\"#222\"");
  }
  for (int order = 1; order <= 24; order += order == 1 ? 1 : 2)
    svg.text({60 + wide * (order - 0.5), 236}, std::to_string(order), 11, "middle", kNote);
  svg.text({310, 262}, "waves around the hem", 12, "middle", "fill=\"#333\"");
  svg.text({16, 120}, "amplitude (mm)", 12, "middle",
           "fill=\"#333\" transform=\"rotate(-90 16 120)\"");
  return Figure{drape + "-hem",
                "Fourier amplitudes of the radius of the hem's shadow over the angle; a square "
                "patch has its own 4, 8, 12.",
                svg.finish()};
}

Figure fabric_figure(const std::string& drape, const std::vector<FabricCurve>& curves) {
  const std::size_t rows = (curves.size() + 2) / 3;
  Svg svg(720, 186.0 * static_cast<double>(rows), fmt::format("Drape {}: fabric curves", drape));
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::size_t row = i / 3, col = i % 3;
    draw_curve(svg, curves[i], 10 + 240.0 * static_cast<double>(col),
               38 + 186.0 * static_cast<double>(row));
  }
  return {drape + "-fabric",
          "Curves of the fabric as the simulations read them: loading (blue, each point a dot) and "
          "unloading (orange, dashed).",
          svg.finish()};
}

}  // namespace drape::compare
