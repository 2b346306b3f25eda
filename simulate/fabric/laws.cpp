// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {
namespace {

// Where a single line is fitted (paper section 5): shear +-5 degrees, bending +-1.5 1/cm; the
// tensile slope near the origin is taken over the first half percent of strain.
constexpr double kShearLine = 5 * units::deg;
constexpr double kBendingLine = 1.5 * units::per_cm;
constexpr double kTensileLine = 0.5 * units::percent;

// Median of J / (2 sqrt(Bwarp Bweft)) of 618 woven and knitted fabrics (after Feng et al. 2022).
constexpr double kUsualTwistRatio = 0.86;

/// Where a curve is fitted: up to `reach`, or wherever it is measured, but a single line up to
/// `line`.
struct FitRange {
  double line = 0;
  std::optional<double> reach;
};

FitRange tensile_range(const std::optional<CurveReach>& reach, int direction) {
  if (!reach) return {kTensileLine, std::nullopt};
  return {kTensileLine, reach->tensile[direction]};
}

FitRange shear_range(const std::optional<CurveReach>& reach) {
  if (!reach) return {kShearLine, std::nullopt};
  return {kShearLine, reach->shear_rad};
}

FitRange bending_range(const std::optional<CurveReach>& reach) {
  if (!reach) return {kBendingLine, std::nullopt};
  return {kBendingLine, reach->curvature_per_m};
}

FittedCurve fitted(const SampledCurve& merged, int segments, const FitRange& range) {
  if (range.reach) return fit_reached(merged, segments, *range.reach);
  return segments == 1 ? fit_line(merged, range.line) : fit_segments(merged, segments);
}

CurveReport report_of(const std::string& name, const std::string& unit, const FittedCurve& fit,
                      double half_hysteresis) {
  return {name,
          unit,
          1 + static_cast<int>(fit.curve.hinges.size()),
          fit.curve.slope,
          fit.range,
          fit.rms_error,
          fit.largest_error,
          half_hysteresis};
}

ForceCurve law_of(const KawabataCurve& curve, const SampledCurve& merged, const std::string& name,
                  const std::string& unit, int segments, const FitRange& range,
                  SimulateReport& report) {
  const FittedCurve fit = fitted(merged, segments, range);
  double slope = fit.curve.slope;
  bool rising = slope > 0;
  for (const auto& hinge : fit.curve.hinges) rising = rising && (slope += hinge.change) > 0;
  if (!rising) {
    throw bad_input(fmt::format("the {} curve does not rise everywhere", name),
                    {.file = curve.file.string()},
                    "a cloth that gets weaker under load has no stable rest; check the points");
  }
  report.curves.push_back(report_of(name, unit, fit, half_hysteresis(curve)));
  return fit.curve;
}

/// "bending warp" becomes "bending friction warp".
std::string friction_name(const std::string& curve) {
  const std::size_t space = curve.find(' ');
  return curve.substr(0, space) + " friction" + curve.substr(space);
}

/// The curve up to `range`.
SampledCurve cut_at(const SampledCurve& curve, double range) {
  SampledCurve cut;
  for (std::size_t i = 0; i < curve.x.size() && curve.x[i] <= range * (1 + 1e-9); ++i) {
    cut.x.push_back(curve.x[i]);
    cut.f.push_back(curve.f[i]);
  }
  return cut;
}

/// Mean of the warp and weft shear curves on the points of both.
SampledCurve mean_of(const SampledCurve& a, const SampledCurve& b) {
  SampledCurve mean;
  const double reach = std::min(a.x.back(), b.x.back());
  for (const double x : a.x) {
    if (x > reach) break;
    mean.x.push_back(x);
    mean.f.push_back(0.5 * (a.at(x) + b.at(x)));
  }
  return mean;
}

}  // namespace

ClothLaws make_laws(const Fabric& fabric, int segments, SimulateReport& report,
                    const std::optional<CurveReach>& reach) {
  static const char* const kDirections[2] = {"warp", "weft"};
  ClothLaws laws;
  laws.density_kg_per_m2 = fabric.areal_density_kg_per_m2;
  for (int d = 0; d < 2; ++d) {
    laws.tensile[d] = law_of(fabric.tensile[d], merged_tensile(fabric.tensile[d]),
                             fmt::format("tensile {}", kDirections[d]), "gf/cm", segments,
                             tensile_range(reach, d), report);
    laws.bending[d] = law_of(fabric.bending[d], merged_loop(fabric.bending[d]),
                             fmt::format("bending {}", kDirections[d]), "gf cm/cm", segments,
                             bending_range(reach), report);
  }
  const SampledCurve shear = mean_of(merged_loop(fabric.shear[0]), merged_loop(fabric.shear[1]));
  laws.shear = law_of(fabric.shear[0], shear, "shear (mean of warp and weft)", "gf/cm", segments,
                      shear_range(reach), report);
  const double warp = laws.bending[0].slope;
  const double weft = laws.bending[1].slope;
  laws.twist_n_m = fabric.bias_bending_n_m ? 4 * *fabric.bias_bending_n_m - warp - weft
                                           : kUsualTwistRatio * 2 * std::sqrt(warp * weft);
  if (!fabric.bias_bending_n_m) {
    report.warnings.push_back(
        fmt::format("no bias bending stiffness in the fabric: the twist stiffness is {:.2f} times "
                    "2 sqrt(B_warp B_weft), the median of 618 fabrics",
                    kUsualTwistRatio));
  } else if (laws.twist_n_m < 0) {
    laws.twist_n_m = 0;
    report.warnings.emplace_back(
        "4 B_bias - B_warp - B_weft is negative; the twist stiffness is set to 0");
  }
  report.twist_n_m = laws.twist_n_m;
  return laws;
}

void add_internal_friction(const Fabric& fabric, int segments, ClothLaws& laws,
                           SimulateReport& report, const std::optional<CurveReach>& reach) {
  const auto split = [&](const KawabataCurve& curve, const SampledCurve& mean,
                         const HalfWidth& width, const std::string& name, const std::string& unit,
                         const FitRange& range, ForceCurve& elastic) {
    const FittedFriction fit =
        curve.slip ? friction_of_numbers(width, *curve.slip) : friction_of_loop(width);
    SimulateReport refit;
    elastic = law_of(curve, cut_at(mean, fit.elastic_range), name, unit, segments, range, refit);
    for (CurveReport& known : report.curves)
      if (known.name == name) known = refit.curves.front();
    report.curves.push_back({friction_name(name), unit, static_cast<int>(fit.stack.elements.size()),
                             fit.stack.stiffness(), width.x.back(), fit.rms_error,
                             fit.largest_error, half_hysteresis(curve)});
    return fit.stack;
  };
  ClothFriction friction;
  for (int d = 0; d < 2; ++d) {
    const KawabataCurve& curve = fabric.bending[d];
    friction.bending[d] = split(curve, merged_loop(curve), half_width(curve),
                                d == 0 ? "bending warp" : "bending weft", "gf cm/cm",
                                bending_range(reach), laws.bending[d]);
  }
  const SampledCurve shear = mean_of(merged_loop(fabric.shear[0]), merged_loop(fabric.shear[1]));
  const HalfWidth warp = half_width(fabric.shear[0]), weft = half_width(fabric.shear[1]);
  const SampledCurve widths = mean_of({warp.x, warp.h}, {weft.x, weft.h});
  friction.shear = split(fabric.shear[0], shear, {widths.x, widths.f},
                         "shear (mean of warp and weft)", "gf/cm", shear_range(reach), laws.shear);
  laws.friction = friction;
}

}  // namespace drape::simulate
