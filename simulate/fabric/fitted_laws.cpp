// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/fitted_laws.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/fabric/points.hpp"

namespace drape::simulate {
namespace {

// Range of a single line (paper section 5): shear +-5 degrees, bending +-1.5 1/cm; the tensile
// slope near the origin is taken over the first half per cent of strain.
constexpr double kShearLine = 5 * units::deg;
constexpr double kBendingLine = 1.5 * units::per_cm;
constexpr double kTensileLine = 0.5 * units::percent;

// Median of J / (2 sqrt(Bwarp Bweft)) of 618 woven and knitted fabrics (after Feng et al. 2022).
constexpr double kUsualTwistRatio = 0.86;

/// Range of a fit: up to `reach`, or the whole measurement, but up to `line` for a single
/// line.
struct FitRange {
  double line = 0;
  std::optional<double> reach;
};

FitRange tensile_range(const std::optional<CurveReach>& reach, int direction) {
  return {kTensileLine, reach ? std::optional(reach->tensile[direction]) : std::nullopt};
}
FitRange shear_range(const std::optional<CurveReach>& reach) {
  return {kShearLine, reach ? std::optional(reach->shear_rad) : std::nullopt};
}
FitRange bending_range(const std::optional<CurveReach>& reach) {
  return {kBendingLine, reach ? std::optional(reach->curvature_per_m) : std::nullopt};
}

FittedCurve fitted(const SampledCurve& merged, int segments, const FitRange& range) {
  if (range.reach) return fit_reached(merged, segments, *range.reach);
  return segments == 1 ? fit_line(merged, range.line) : fit_segments(merged, segments);
}

/// Mean of the warp and weft shear curves on the points of both.
SampledCurve mean_of(const SampledCurve& a, const SampledCurve& b) {
  SampledCurve mean{points_of_both(a.x, b.x), {}};
  for (const double x : mean.x) mean.f.push_back(0.5 * (a.at(x) + b.at(x)));
  return mean;
}

/// Data for a law: mean curve and width of the loop, and what merging its branches omits.
struct Loop {
  SampledCurve mean;
  HalfWidth width;
  double half_hysteresis = 0;
  std::optional<double> slip;
  std::filesystem::path file;
};

Loop loop_of(const KawabataCurve& curve) {
  return {merged_loop(curve), half_width(curve), half_hysteresis(curve), curve.slip, curve.file};
}

/// Mean of warp and weft; a slip made from KES numbers is used only if both loops have one.
Loop shear_loop(const Fabric& fabric) {
  const Loop warp = loop_of(fabric.shear[0]), weft = loop_of(fabric.shear[1]);
  const SampledCurve width = mean_of({warp.width.x, warp.width.h}, {weft.width.x, weft.width.h});
  Loop mean{mean_of(warp.mean, weft.mean),
            {width.x, width.f},
            0.5 * (warp.half_hysteresis + weft.half_hysteresis),
            std::nullopt,
            warp.file};
  if (warp.slip && weft.slip) mean.slip = 0.5 * (*warp.slip + *weft.slip);
  return mean;
}

ForceCurve law_of(const Loop& loop, const std::string& name, int segments, const FitRange& range,
                  std::vector<CurveReport>& curves) {
  const FittedCurve fit = fitted(loop.mean, segments, range);
  if (!fit.curve.rises())
    throw bad_input(fmt::format("the {} curve does not rise everywhere", name),
                    {.file = loop.file.string()},
                    "a cloth that gets weaker under load has no stable rest; check the points");
  curves.push_back({name, 1 + static_cast<int>(fit.curve.hinges.size()), fit.curve.slope, fit.range,
                    fit.rms_error, fit.largest_error, loop.half_hysteresis});
  return fit.curve;
}

/// Name of a friction curve: "bending warp" becomes "bending friction warp".
std::string friction_name(const std::string& curve) {
  const std::size_t space = curve.find(' ');
  return curve.substr(0, space) + " friction" + curve.substr(space);
}

/// The curve up to its last point within `range`; up to `range` if there is none.
SampledCurve cut_at(const SampledCurve& curve, double range) {
  SampledCurve cut;
  for (std::size_t i = 0; i < curve.x.size() && curve.x[i] <= range * (1 + 1e-9); ++i) {
    cut.x.push_back(curve.x[i]);
    cut.f.push_back(curve.f[i]);
  }
  if (cut.x.size() < 2) cut = {{0, range}, {0, curve.at(range)}};
  return cut;
}

/// Splits the loops of bending and shear into an elastic curve and friction elements. Tension keeps
/// its loading branch: under a drape's own weight its loop stores negligible energy. Twist, for
/// which KES measures no loop, stays elastic.
ClothFriction split_loops(const Fabric& fabric, int segments,
                          const std::optional<CurveReach>& reach, FittedLaws& fitted) {
  const auto split = [&](Loop loop, const std::string& name, const FitRange& range,
                         ForceCurve& elastic) {
    const FittedFriction fit =
        loop.slip ? friction_of_numbers(loop.width, *loop.slip) : friction_of_loop(loop.width);
    std::vector<CurveReport> refit;
    loop.mean = cut_at(loop.mean, fit.elastic_range);
    elastic = law_of(loop, name, segments, range, refit);
    for (CurveReport& known : fitted.curves)
      if (known.name == name) known = refit.front();
    fitted.curves.push_back({friction_name(name), static_cast<int>(fit.stack.elements.size()),
                             fit.stack.stiffness(), loop.width.x.back(), fit.rms_error,
                             fit.largest_error, loop.half_hysteresis});
    return fit.stack;
  };
  ClothFriction friction;
  for (int d = 0; d < 2; ++d)
    friction.bending[d] =
        split(loop_of(fabric.bending[d]), d == 0 ? "bending warp" : "bending weft",
              bending_range(reach), fitted.laws.bending[d]);
  friction.shear = split(shear_loop(fabric), "shear (mean of warp and weft)", shear_range(reach),
                         fitted.laws.shear);
  return friction;
}

}  // namespace

FittedLaws fit_laws(const Fabric& fabric, int segments, const std::optional<CurveReach>& reach,
                    bool internal_friction) {
  static const char* const kDirections[2] = {"warp", "weft"};
  FittedLaws fitted;
  fitted.warnings = fabric.warnings;
  ClothLaws& laws = fitted.laws;
  laws.density_kg_per_m2 = fabric.areal_density_kg_per_m2;
  for (int d = 0; d < 2; ++d) {
    const KawabataCurve& tensile = fabric.tensile[d];
    laws.tensile[d] =
        law_of({merged_tensile(tensile), {}, half_hysteresis(tensile), std::nullopt, tensile.file},
               fmt::format("tensile {}", kDirections[d]), segments, tensile_range(reach, d),
               fitted.curves);
    laws.bending[d] = law_of(loop_of(fabric.bending[d]), fmt::format("bending {}", kDirections[d]),
                             segments, bending_range(reach), fitted.curves);
  }
  laws.shear = law_of(shear_loop(fabric), "shear (mean of warp and weft)", segments,
                      shear_range(reach), fitted.curves);
  const double warp = laws.bending[0].slope;
  const double weft = laws.bending[1].slope;
  laws.twist_n_m = fabric.bias_bending_n_m ? 4 * *fabric.bias_bending_n_m - warp - weft
                                           : kUsualTwistRatio * 2 * std::sqrt(warp * weft);
  if (!fabric.bias_bending_n_m) {
    fitted.warnings.push_back(
        fmt::format("no bias bending stiffness in the fabric: the twist stiffness is {:.2f} times "
                    "2 sqrt(B_warp B_weft), the median of 618 fabrics",
                    kUsualTwistRatio));
  } else if (laws.twist_n_m < 0) {
    laws.twist_n_m = 0;
    fitted.warnings.emplace_back(
        "4 B_bias - B_warp - B_weft is negative; the twist stiffness is set to 0");
  }
  if (internal_friction) laws.friction = split_loops(fabric, segments, reach, fitted);
  return fitted;
}

}  // namespace drape::simulate
