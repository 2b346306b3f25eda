// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "compare/report/figures.hpp"
#include "core/drawing/chart.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using units::mm;
using units::percent;

std::string gap_text(const Sheet& sheet, const RealVirtual& comparison, MarkId mark) {
  for (const auto& [gaps, what] :
       {std::pair{&sheet.gaps, "not measured"}, {&comparison.marks.excluded, "not compared"}})
    for (const Gap& gap : *gaps)
      if (gap.mark == mark)
        return fmt::format("row {}, col {}: {}: {}", mark.row, mark.col, what, gap.reason);
  return fmt::format("row {}, col {}: not in the sheet", mark.row, mark.col);
}

/// Blue where shorter, orange where longer, white at zero: safe for colour-blind readers.
std::string strain_colour(double ratio, double top) {
  const double t = std::clamp(ratio / top, -1.0, 1.0);
  const Eigen::Vector3d white = Eigen::Vector3d::Constant(245),
                        end = t < 0 ? Eigen::Vector3d(33, 102, 172) : Eigen::Vector3d(203, 100, 20);
  return hex_colour(white + std::abs(t) * (end - white));
}

double largest_strain(const RealVirtual& comparison) {
  std::vector<double> sizes = {0.01};
  for (const EdgeStrain& edge : comparison.strain.edges)
    sizes.insert(sizes.end(), {std::abs(edge.real), std::abs(edge.simulated)});
  return quantile(sizes, 0.95);
}

}  // namespace

Figure map_figure(const std::string& drape, const DrapeInput& input,
                  const RealVirtual& comparison) {
  const Sheet& sheet = input.measured.sheet;
  const ErrorScale scale = scale_of(comparison);
  const double side = 440.0 / std::max(sheet.rows, sheet.cols);
  Svg svg(500, 40 + side * sheet.rows + 55, fmt::format("Drape {}: distance of each mark", drape));
  std::size_t next = 0;
  const auto& errors = comparison.marks.marks;
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col) {
      const Vector2d corner(44 + side * col, 30 + side * row);
      if (next >= errors.size() || errors[next].mark != MarkId{row, col}) {
        svg.rectangle(corner.x() + 0.5, corner.y() + 0.5, side - 3, side - 3,
                      "fill=\"#f4f5f7\" stroke=\"#b5bcc5\" stroke-dasharray=\"3 3\" rx=\"3\"",
                      gap_text(sheet, comparison, {row, col}));
        continue;
      }
      const double value = errors[next++].distance_m / mm;
      svg.rectangle(corner.x(), corner.y(), side - 2, side - 2,
                    fmt::format("fill=\"{}\" rx=\"3\"", scale.colour(value)),
                    fmt::format("row {}, col {}: {:.2f} mm", row, col, value));
      svg.text(corner + Vector2d(side / 2 - 1, side / 2 + 3), fmt::format("{:.1f}", value),
               0.3 * side, "middle", scale.is_dark(value) ? "fill=\"#fff\"" : "fill=\"#111\"");
    }
    svg.text({38, 30 + side * (row + 0.5) + 3}, std::to_string(row), 11, "end", kNote);
  }
  for (int col = 0; col < sheet.cols; ++col)
    svg.text({43 + side * (col + 0.5), 24}, std::to_string(col), 11, "middle", kNote);
  svg.text({44, 10}, "col, along the weft →", 11, "start", kNote);
  svg.text({10, 36}, "row, along the warp →", 11, "start",
           "fill=\"#555\" transform=\"rotate(90 10 36)\"");
  scale.draw(svg, 114, 36 + side * sheet.rows, 300);
  return {drape + "-map",
          "The patch laid flat, printed side up: distance of each mark in mm. Dashed tiles are "
          "gaps.",
          svg.finish()};
}

Figure histogram_figure(const std::string& drape, const RealVirtual& comparison) {
  const DistanceStatistics& s = comparison.statistics;
  const double width = round_step(s.max_m / mm > 1e-6 ? s.max_m / mm : 1.0, 12);
  std::vector<int> counts(static_cast<std::size_t>(std::floor(s.max_m / mm / width)) + 1, 0);
  for (const MarkError& mark : comparison.marks.marks)
    ++counts[std::min(counts.size() - 1, static_cast<std::size_t>(mark.distance_m / mm / width))];
  Axis marks = axis_over("marks", 0, *std::max_element(counts.begin(), counts.end()), 4, true);
  marks.step = std::max(1.0, marks.step);
  Svg svg(500, 300, fmt::format("Drape {}: histogram of distances", drape));
  Chart chart(svg, {52, 58, 430, 200},
              {"distance real to virtual (mm)", 0, width * static_cast<double>(counts.size()),
               counts.size() > 12 ? 2 * width : width},
              marks);
  const ErrorScale scale = scale_of(comparison);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double low = width * static_cast<double>(i);
    chart.bar(low + 0.04 * width, low + 0.96 * width, counts[i],
              fmt::format("fill=\"{}\"", scale.colour(low + width / 2)),
              fmt::format("{:g} to {:g} mm: {} marks", low, low + width, counts[i]));
  }
  double y = 4;
  for (const auto& [value_m, label] : {std::pair{s.median_m, "median {:.2f} mm"},
                                       {s.mean_m, "mean {:.2f} mm"},
                                       {s.p95_m, "95 % below {:.2f} mm"}}) {
    const Vector2d foot = chart.at(value_m / mm, 0);
    const bool flip = foot.x() > 350;
    svg.line({foot.x(), y}, foot,
             "stroke=\"#b3261e\" stroke-width=\"1.3\" stroke-dasharray=\"5 3\"");
    svg.text({foot.x() + (flip ? -4 : 4), y + 8}, fmt::format(fmt::runtime(label), value_m / mm),
             11.5, flip ? "end" : "start", "fill=\"#8c1d18\"");
    y += 16;
  }
  return {drape + "-histogram", fmt::format("Distances of the {} marks.", s.marks), svg.finish()};
}

Figure strain_figure(const std::string& drape, const DrapeInput& input,
                     const RealVirtual& comparison) {
  const Sheet& sheet = input.measured.sheet;
  const double side = 400.0 / std::max(sheet.rows, sheet.cols), top = largest_strain(comparison);
  const double height = 30 + side * sheet.rows + 50;
  Svg svg(900, height, fmt::format("Drape {}: strain between marks", drape));
  for (const bool real : {true, false}) {
    const double left = real ? 20 : 470;
    const auto place = [&](MarkId mark) -> Vector2d {
      return {left + side * (mark.col + 0.5), 24 + side * (mark.row + 0.5)};
    };
    svg.text({left, 18}, real ? "measured" : "simulated, same places", 13);
    for (const AreaStrain& cell : comparison.strain.cells) {
      const double value = real ? cell.real : cell.simulated;
      svg.rectangle(place(cell.corner).x() + 3, place(cell.corner).y() + 3, side - 6, side - 6,
                    fmt::format("fill=\"{}\"", strain_colour(value, top)),
                    fmt::format("area: {:+.1f} %", value / percent));
    }
    for (const EdgeStrain& edge : comparison.strain.edges)
      svg.line(place(edge.from), place(edge.to),
               fmt::format("stroke=\"{}\" stroke-width=\"5\"",
                           strain_colour(real ? edge.real : edge.simulated, top)));
  }
  for (int i = 0; i <= 40; ++i)
    svg.rectangle(300 + 7.0 * i, height - 32, 7.3, 10,
                  fmt::format("fill=\"{}\"", strain_colour((i / 20.0 - 1) * top, top)));
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
  std::vector<std::pair<std::string, const Drapemeter*>> hems;
  const auto add = [&](const std::string& label, const DrapemeterResult& result) {
    if (result.value && hems.size() < kSeries.size()) hems.emplace_back(label, &*result.value);
  };
  add("measured", report.measured_drapemeter);
  for (const RealVirtual& row : report.real_virtual)
    add(input.simulations[row.simulation].label(), report.drapemeters[row.simulation]);
  if (hems.empty()) return std::nullopt;
  double largest = 1e-3;
  for (const auto& [label, hem] : hems)
    for (const Harmonic& h : hem->spectrum) largest = std::max(largest, h.amplitude_m / mm);
  Svg svg(760, 280, fmt::format("Drape {}: spectrum of the hem", drape));
  Chart chart(svg, {60, 20, 500, 200}, {"waves around the hem", 0.5, 24.5, 2},
              axis_over("amplitude (mm)", 0, largest, 4, true));
  const double bar = 0.8 / static_cast<double>(hems.size());
  for (std::size_t i = 0; i < hems.size(); ++i) {
    const auto& [label, hem] = hems[i];
    const double left = bar * static_cast<double>(i) - 0.4;
    for (const Harmonic& h : hem->spectrum)
      chart.bar(h.order + left, h.order + left + bar, h.amplitude_m / mm,
                fmt::format("fill=\"{}\"", kSeries[i]),
                fmt::format("{}: order {}, {:.2f} mm", label, h.order, h.amplitude_m / mm));
    draw_legend_line(svg, {575, 26 + 19.0 * static_cast<double>(i)},
                     fmt::format("stroke=\"{}\" stroke-width=\"8\"", kSeries[i]), label);
  }
  return Figure{drape + "-hem",
                "Fourier amplitudes of the radius of the hem's shadow over the angle; a square "
                "patch has its own 4, 8, 12.",
                svg.finish()};
}

}  // namespace drape::compare
