// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "compare/report/figures.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr const char* kAxis = "stroke=\"#555\" stroke-width=\"1\"";
constexpr const char* kGrid = "stroke=\"#e3e6ea\" stroke-width=\"1\"";

/// A rectangle of the picture with linear axes.
struct Plot {
  double left, top, width, height;
  double x_min, x_max, y_min, y_max;

  [[nodiscard]] double x(double value) const {
    return left + width * (value - x_min) / (x_max - x_min);
  }
  [[nodiscard]] double y(double value) const {
    return top + height * (1 - (value - y_min) / (y_max - y_min));
  }
  [[nodiscard]] double bottom() const { return top + height; }
};

void draw_tile(Svg& svg, const Eigen::Vector2d& corner, double side, const MarkError* error,
               const std::string& gap, const ErrorScale& scale) {
  if (error) {
    const double value = error->distance_m / mm;
    svg.rectangle(
        corner.x(), corner.y(), side - 2, side - 2,
        fmt::format("fill=\"{}\" rx=\"3\"", scale.colour(value)),
        fmt::format("row {}, col {}: {:.2f} mm", error->mark.row, error->mark.col, value));
    svg.text(corner + Eigen::Vector2d(side / 2 - 1, side / 2 + 3), fmt::format("{:.1f}", value),
             0.3 * side, "middle", scale.is_dark(value) ? "fill=\"#fff\"" : "fill=\"#111\"");
    return;
  }
  svg.rectangle(corner.x() + 0.5, corner.y() + 0.5, side - 3, side - 3,
                "fill=\"#f4f5f7\" stroke=\"#b5bcc5\" stroke-dasharray=\"3 3\" rx=\"3\"", gap);
  svg.line(corner + Eigen::Vector2d(5, side - 7), corner + Eigen::Vector2d(side - 7, 5),
           "stroke=\"#b5bcc5\"");
}

std::string gap_text(const Sheet& sheet, const RealVirtual& comparison, MarkId mark) {
  for (const Gap& gap : sheet.gaps)
    if (gap.mark == mark)
      return fmt::format("row {}, col {}: not measured: {}", mark.row, mark.col, gap.reason);
  for (const Excluded& excluded : comparison.marks.excluded)
    if (excluded.mark == mark)
      return fmt::format("row {}, col {}: not compared: {}", mark.row, mark.col, excluded.reason);
  return fmt::format("row {}, col {}: not in the sheet", mark.row, mark.col);
}

void draw_level(Svg& svg, const Plot& plot, double value, const std::string& label, int row) {
  const double x = plot.x(value);
  svg.line({x, 16.0 * row + 4}, {x, plot.bottom()},
           "stroke=\"#b3261e\" stroke-width=\"1.3\" stroke-dasharray=\"5 3\"");
  const bool flip = x > plot.left + 0.7 * plot.width;
  svg.text({x + (flip ? -4 : 4), 16.0 * row + 12}, label, 11.5, flip ? "end" : "start",
           "fill=\"#8c1d18\"");
}

/// Index of the column whose residual is drawn, or nothing.
std::optional<std::size_t> residual_column(const History& history) {
  for (std::size_t i = 1; i < history.names.size(); ++i)
    if (history.names[i].find("residual") != std::string::npos) return i;
  return std::nullopt;
}

struct Curve {
  std::string label;
  std::vector<Eigen::Vector2d> points;  ///< x, log10 of the residual
};

/// "residual_force_mN" becomes "residual force (mN)"; a name without unit is a pure number.
std::string axis_label(const std::string& name) {
  constexpr std::array<const char*, 8> kUnits = {"s", "ms", "N", "mN", "uN", "uJ", "mm", "percent"};
  std::string words = name, unit;
  const std::size_t cut = name.rfind('_');
  if (cut != std::string::npos) {
    const std::string last = name.substr(cut + 1);
    if (std::find(kUnits.begin(), kUnits.end(), last) != kUnits.end()) {
      unit = " (" + last + ")";
      words = name.substr(0, cut);
    }
  }
  std::replace(words.begin(), words.end(), '_', ' ');
  return words + unit;
}

constexpr std::array<const char*, 6> kStrokes = {
    "stroke=\"#0072b2\" stroke-width=\"1.6\"",
    "stroke=\"#d55e00\" stroke-width=\"1.6\"",
    "stroke=\"#009e73\" stroke-width=\"1.6\"",
    "stroke=\"#cc79a7\" stroke-width=\"1.6\" stroke-dasharray=\"6 3\"",
    "stroke=\"#56b4e9\" stroke-width=\"1.6\" stroke-dasharray=\"6 3\"",
    "stroke=\"#8a6d00\" stroke-width=\"1.6\" stroke-dasharray=\"2 3\""};

/// Smallest and largest value of each of 300 equal parts, so that long runs stay a small picture.
std::vector<Eigen::Vector2d> thinned(const std::vector<Eigen::Vector2d>& points) {
  constexpr std::size_t kParts = 300;
  if (points.size() <= 2 * kParts) return points;
  std::vector<Eigen::Vector2d> kept;
  for (std::size_t part = 0; part < kParts; ++part) {
    const auto begin = points.begin() + static_cast<std::ptrdiff_t>(part * points.size() / kParts);
    const auto end =
        points.begin() + static_cast<std::ptrdiff_t>((part + 1) * points.size() / kParts);
    auto [low, high] = std::minmax_element(
        begin, end,
        [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.y() < b.y(); });
    if (high < low) std::swap(low, high);
    kept.push_back(*low);
    if (high != low) kept.push_back(*high);
  }
  if (kept.back() != points.back()) kept.push_back(points.back());
  return kept;
}

Plot plot_of(const std::vector<Curve>& curves) {
  Plot plot{70, 16, 470, 230, 1e300, -1e300, 1e300, -1e300};
  for (const Curve& curve : curves) {
    for (const Eigen::Vector2d& p : curve.points) {
      plot.x_min = std::min(plot.x_min, p.x());
      plot.x_max = std::max(plot.x_max, p.x());
      plot.y_min = std::min(plot.y_min, p.y());
      plot.y_max = std::max(plot.y_max, p.y());
    }
  }
  plot.y_min = std::floor(plot.y_min);
  plot.y_max = std::max(std::ceil(plot.y_max), plot.y_min + 1);
  if (!(plot.x_max > plot.x_min)) plot.x_max = plot.x_min + 1;
  return plot;
}

void draw_curves(Svg& svg, const Plot& plot, const std::vector<Curve>& curves) {
  const int decades = static_cast<int>(plot.y_max - plot.y_min);
  const int every = std::max(1, decades / 6);
  for (int k = 0; k <= decades; k += every) {
    const double y = plot.y(plot.y_min + k);
    svg.line({plot.left, y}, {plot.left + plot.width, y}, kGrid);
    svg.text({plot.left - 6, y + 4}, fmt::format("1e{:+.0f}", plot.y_min + k), 11, "end", kNote);
  }
  const double step = round_step(plot.x_max - plot.x_min, 5);
  for (const double x : ticks(plot.x_min, plot.x_max, step)) {
    svg.line({plot.x(x), plot.bottom()}, {plot.x(x), plot.bottom() + 5}, kAxis);
    svg.text({plot.x(x), plot.bottom() + 18}, fmt::format("{:g}", x), 11, "middle", kNote);
  }
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const char* stroke = kStrokes[i % kStrokes.size()];
    std::vector<Eigen::Vector2d> points;
    for (const Eigen::Vector2d& p : curves[i].points)
      points.emplace_back(plot.x(p.x()), plot.y(p.y()));
    svg.polyline(points, stroke);
    const double y = plot.top + 10 + 19.0 * static_cast<double>(i);
    svg.line({560, y}, {584, y}, stroke);
    svg.text({590, y + 4}, curves[i].label, 12, "start", "fill=\"#222\"");
  }
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
      const bool has = next < errors.size() && errors[next].mark == MarkId{row, col};
      const MarkError* error = has ? &errors[next++] : nullptr;
      draw_tile(svg, {44 + side * col, 30 + side * row}, side, error,
                gap_text(sheet, comparison, {row, col}), scale);
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
  const auto bins = static_cast<std::size_t>(std::floor(s.max_m / mm / width)) + 1;
  std::vector<int> counts(bins, 0);
  for (const MarkError& mark : comparison.marks.marks)
    ++counts[std::min(bins - 1, static_cast<std::size_t>(mark.distance_m / mm / width))];
  const int tallest = *std::max_element(counts.begin(), counts.end());
  const double step = std::max(1.0, round_step(tallest, 4));
  const Plot plot{
      52, 58, 430, 200, 0, width * static_cast<double>(bins), 0, step * std::ceil(tallest / step)};
  Svg svg(500, 300, fmt::format("Drape {}: histogram of distances", drape));
  for (const double y : ticks(0, plot.y_max, step)) {
    svg.line({plot.left, plot.y(y)}, {plot.left + plot.width, plot.y(y)}, kGrid);
    svg.text({plot.left - 7, plot.y(y) + 4}, fmt::format("{:g}", y), 11, "end", kNote);
  }
  const ErrorScale scale = scale_of(comparison);
  for (std::size_t i = 0; i < bins; ++i) {
    const double low = width * static_cast<double>(i);
    svg.rectangle(plot.x(low) + 1, plot.y(counts[i]), plot.x(low + width) - plot.x(low) - 2,
                  plot.bottom() - plot.y(counts[i]),
                  fmt::format("fill=\"{}\"", scale.colour(low + width / 2)),
                  fmt::format("{:g} to {:g} mm: {} marks", low, low + width, counts[i]));
  }
  svg.line({plot.left, plot.bottom()}, {plot.left + plot.width, plot.bottom()}, kAxis);
  const std::size_t every = bins > 12 ? 2 : 1;
  for (std::size_t i = 0; i <= bins; i += every) {
    const double at = width * static_cast<double>(i);
    svg.text({plot.x(at), plot.bottom() + 17}, fmt::format("{:g}", at), 11, "middle", kNote);
  }
  draw_level(svg, plot, s.median_m / mm, fmt::format("median {:.2f} mm", s.median_m / mm), 0);
  draw_level(svg, plot, s.mean_m / mm, fmt::format("mean {:.2f} mm", s.mean_m / mm), 1);
  draw_level(svg, plot, s.p95_m / mm, fmt::format("95 % below {:.2f} mm", s.p95_m / mm), 2);
  svg.text({plot.left + plot.width / 2, 294}, "distance real to virtual (mm)", 12, "middle",
           "fill=\"#333\"");
  svg.text(
      {14, plot.top + plot.height / 2}, "marks", 12, "middle",
      fmt::format("fill=\"#333\" transform=\"rotate(-90 14 {})\"", plot.top + plot.height / 2));
  return {drape + "-histogram", fmt::format("Distances of the {} marks.", s.marks), svg.finish()};
}

std::optional<Figure> convergence_figure(const std::string& drape, const DrapeInput& input,
                                         const Report& report) {
  std::vector<Curve> curves;
  std::string x_name, y_name;
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    const auto column =
        simulation.history ? residual_column(*simulation.history) : std::optional<std::size_t>();
    if (!column) continue;
    x_name = simulation.history->names.front();
    y_name = simulation.history->names[*column];
    Curve curve{simulation.label(), {}};
    const auto &x = simulation.history->columns.front(), &y = simulation.history->columns[*column];
    for (std::size_t i = 0; i < x.size(); ++i)
      if (y[i] > 0) curve.points.emplace_back(x[i], std::log10(y[i]));
    curve.points = thinned(curve.points);
    if (!curve.points.empty()) curves.push_back(std::move(curve));
  }
  if (curves.empty()) return std::nullopt;
  const Plot plot = plot_of(curves);
  Svg svg(720, 300, fmt::format("Drape {}: convergence of the simulations", drape));
  draw_curves(svg, plot, curves);
  svg.line({plot.left, plot.bottom()}, {plot.left + plot.width, plot.bottom()}, kAxis);
  svg.text({plot.left + plot.width / 2, 292}, axis_label(x_name), 12, "middle", "fill=\"#333\"");
  svg.text(
      {14, plot.top + plot.height / 2}, axis_label(y_name), 12, "middle",
      fmt::format("fill=\"#333\" transform=\"rotate(-90 14 {})\"", plot.top + plot.height / 2));
  return Figure{drape + "-convergence", "Residual of each simulation over its run, logarithmic.",
                svg.finish()};
}

}  // namespace drape::compare
