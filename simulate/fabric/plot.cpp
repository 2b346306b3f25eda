// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {
namespace {

constexpr double kWidth = 360, kHeight = 260, kLeft = 62, kBottom = 46, kTop = 30, kRight = 14;

struct Panel {
  std::string title, x_label, y_label;
  double x_unit = 1, y_unit = 1;
  const KawabataCurve* curve = nullptr;
  const ForceCurve* line = nullptr;
  const ForceCurve* pieces = nullptr;
};

/// 1, 2 or 5 times a power of ten, giving four to nine steps.
double tick_step(double span) {
  const double power = std::pow(10, std::floor(std::log10(span / 4)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (span / (factor * power) <= 9) return factor * power;
  }
  return 10 * power;
}

/// Multiples of a step from one value to another.
std::vector<double> ticks(double low, double high, double step) {
  std::vector<double> values;
  double value = std::ceil(low / step) * step;
  while (value <= high + 1e-9 * step) {
    values.push_back(std::abs(value) < 1e-9 * step ? 0 : value);
    value += step;
  }
  return values;
}

/// Draws one panel in its own frame, moved to its place by the caller.
class Drawing {
 public:
  explicit Drawing(const Panel& panel) : panel_(panel) {
    const KawabataCurve& c = *panel.curve;
    x_low_ = c.x.front() / panel.x_unit;
    x_high_ = c.x.back() / panel.x_unit;
    for (const std::vector<double>* branch : {&c.loading, &c.unloading}) {
      for (const double f : *branch) {
        y_low_ = std::min(y_low_, f / panel.y_unit);
        y_high_ = std::max(y_high_, f / panel.y_unit);
      }
    }
  }

  std::string svg() {
    text_ += fmt::format("<text x='{}' y='18' class='t'>{}</text>\n", kLeft, panel_.title);
    axes();
    branch(panel_.curve->loading, "load");
    branch(panel_.curve->unloading, "unload");
    law(*panel_.line, "line", false);
    law(*panel_.pieces, "pieces", true);
    return text_;
  }

 private:
  [[nodiscard]] double px(double x) const {
    return kLeft + (x - x_low_) / (x_high_ - x_low_) * (kWidth - kLeft - kRight);
  }
  [[nodiscard]] double py(double y) const {
    return kHeight - kBottom - (y - y_low_) / (y_high_ - y_low_) * (kHeight - kTop - kBottom);
  }

  void axes() {
    for (const double x : ticks(x_low_, x_high_, tick_step(x_high_ - x_low_))) {
      text_ += fmt::format(
          "<line x1='{0:.1f}' x2='{0:.1f}' y1='{1:.1f}' y2='{2:.1f}' class='g'/>"
          "<text x='{0:.1f}' y='{3:.1f}' class='x'>{4:.4g}</text>\n",
          px(x), py(y_low_), py(y_high_), kHeight - kBottom + 14, x);
    }
    for (const double y : ticks(y_low_, y_high_, tick_step(y_high_ - y_low_))) {
      text_ += fmt::format(
          "<line x1='{1:.1f}' x2='{2:.1f}' y1='{0:.1f}' y2='{0:.1f}' class='g'/>"
          "<text x='{3:.1f}' y='{4:.1f}' class='y'>{5:.4g}</text>\n",
          py(y), px(x_low_), px(x_high_), kLeft - 5, py(y) + 4, y);
    }
    text_ += fmt::format("<text x='{:.1f}' y='{:.1f}' class='x'>{}</text>\n",
                         0.5 * (px(x_low_) + px(x_high_)), kHeight - 12, panel_.x_label);
    text_ += fmt::format("<text transform='translate(12 {:.1f}) rotate(-90)' class='x'>{}</text>\n",
                         0.5 * (py(y_low_) + py(y_high_)), panel_.y_label);
  }

  void branch(const std::vector<double>& values, const char* kind) {
    text_ += fmt::format("<polyline class='{}' points='", kind);
    for (std::size_t i = 0; i < values.size(); ++i) {
      text_ += fmt::format("{:.1f},{:.1f} ", px(panel_.curve->x[i] / panel_.x_unit),
                           py(values[i] / panel_.y_unit));
    }
    text_ += "'/>\n";
  }

  /// Odd beyond the origin; where it leaves the panel it is cut off.
  void law(const ForceCurve& curve, const char* kind, bool dots) {
    std::vector<double> knots = {x_low_, 0, x_high_};
    for (const auto& hinge : curve.hinges) {
      knots.push_back(hinge.at / panel_.x_unit);
      if (x_low_ < 0) knots.push_back(-hinge.at / panel_.x_unit);
    }
    std::sort(knots.begin(), knots.end());
    const auto y_at = [&](double x) { return curve.odd_value(x * panel_.x_unit) / panel_.y_unit; };
    text_ += fmt::format("<polyline class='{}' points='", kind);
    std::string circles;
    for (double x : knots) {
      if (x < x_low_ || x > x_high_) continue;
      double y = y_at(x);
      if (y > y_high_ || y < y_low_) {  // the line from the origin leaves the panel
        x *= (y > 0 ? y_high_ : y_low_) / y;
        y = y_at(x);
      } else if (dots && x != 0 && x != x_low_ && x != x_high_) {
        circles += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2.5'/>", px(x), py(y));
      }
      text_ += fmt::format("{:.1f},{:.1f} ", px(x), py(y));
    }
    text_ += "'/>" + circles + "\n";
  }

  const Panel& panel_;
  double x_low_ = 0, x_high_ = 0, y_low_ = 0, y_high_ = 0;
  std::string text_;
};

std::string legend(int segments, double y) {
  std::string text;
  double x = kLeft;
  for (const auto& [kind, what] : {std::pair<const char*, std::string>{"load", "loading"},
                                   {"unload", "unloading"},
                                   {"line", "one segment"},
                                   {"pieces", fmt::format("{} segments, as used", segments)}}) {
    text += fmt::format(
        "<line x1='{0}' x2='{1}' y1='{2}' y2='{2}' class='{3}'/><text x='{4}' y='{5}'>{6}</text>\n",
        x, x + 30, y, kind, x + 36, y + 4, what);
    x += 170;
  }
  return text;
}

}  // namespace

std::string curves_svg(const Fabric& fabric, int segments) {
  SimulateReport ignored;
  const ClothLaws line = make_laws(fabric, 1, ignored);
  const ClothLaws pieces = make_laws(fabric, segments, ignored);
  std::string text = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}' width='{0}' height='{1}' "
      "font-family='sans-serif' font-size='11'>\n<style>polyline,line{{fill:none}}"
      ".t{{font-size:13px;font-weight:bold}}.x{{text-anchor:middle}}.y{{text-anchor:end}}"
      ".g{{stroke:#ddd}}.load{{stroke:#0b5394;stroke-width:1.5}}"
      ".unload{{stroke:#0b5394;stroke-width:1;stroke-dasharray:4 3}}"
      ".line{{stroke:#e69138;stroke-width:1.5}}.pieces{{stroke:#cc0000;stroke-width:1.5}}"
      "circle{{fill:#cc0000}}</style>\n<rect width='{0}' height='{1}' fill='white'/>\n",
      3 * kWidth, 2 * kHeight + 60);
  text += fmt::format("<text x='{}' y='18' class='t'>{}, {:g} g/m2</text>\n", kLeft, fabric.name,
                      fabric.areal_density_kg_per_m2 / units::g_per_m2);
  static const char* const kDirections[2] = {"warp", "weft"};
  for (int d = 0; d < 2; ++d) {
    const Panel panels[3] = {
        {fmt::format("tensile {}", kDirections[d]), "strain (%)", "force (gf/cm)", units::percent,
         units::gf_per_cm, &fabric.tensile[d], &line.tensile[d], &pieces.tensile[d]},
        {fmt::format("shear {} (used: mean of warp and weft)", kDirections[d]), "angle (degrees)",
         "force (gf/cm)", units::deg, units::gf_per_cm, &fabric.shear[d], &line.shear,
         &pieces.shear},
        {fmt::format("bending {}", kDirections[d]), "curvature (1/cm)", "moment (gf cm/cm)",
         units::per_cm, units::gf_cm_per_cm, &fabric.bending[d], &line.bending[d],
         &pieces.bending[d]}};
    for (int k = 0; k < 3; ++k) {
      text += fmt::format("<g transform='translate({} {})'>\n{}</g>\n", k * kWidth,
                          28 + d * kHeight, Drawing(panels[k]).svg());
    }
  }
  return text + legend(segments, 2 * kHeight + 44) + "</svg>\n";
}

}  // namespace drape::simulate
