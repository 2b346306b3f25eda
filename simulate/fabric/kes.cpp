// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/kes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/units.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {
namespace {

constexpr double kLargestTension = 500;  // gf/cm, KES-FB1
constexpr double kShearRange = 8;        // degrees, KES-FB1
constexpr double kBendingRange = 2.5;    // 1/cm, KES-FB2
constexpr double kSlipAngle = 0.5;       // default, degrees
constexpr double kSlipCurvature = 0.1;   // default, 1/cm; for both see slip()
constexpr double kAgreement = 0.03;      // largest difference between WT and LT with EMT
constexpr double kLeastShear = 0.02;     // gf/(cm deg), smallest of textiles
constexpr double kMostShear = 20;
constexpr int kPoints = 50;  // points per curve and sign

/// x = b EMT of the exponential law with the given linearity; negative for a linearity above 1, by
/// LT(-x) = 2 - LT(x).
double exponent_of(double linearity) {
  if (linearity > 1) return -exponent_of(2 - linearity);
  if (linearity >= 0.999) return 0;
  double low = 1e-3, high = 200;
  for (int i = 0; i < 80; ++i) {
    const double x = 0.5 * (low + high);
    (2 * (1 / x - 1 / std::expm1(x)) > linearity ? low : high) = x;
  }
  return 0.5 * (low + high);
}

/// Fraction of the largest force at a fraction of the largest strain.
double rise(double fraction, double exponent) {
  return exponent == 0 ? fraction : std::expm1(exponent * fraction) / std::expm1(exponent);
}

/// Makes both branches at half the loop's width from the centre line.
template <class Width>
KawabataCurve loop(const std::filesystem::path& file, double range, double slope, double x_unit,
                   double f_unit, const Width& width) {
  KawabataCurve curve;
  curve.file = file;
  for (int i = -kPoints; i <= kPoints; ++i) {
    const double x = range * i / kPoints;
    const double half = 0.5 * width(std::abs(x));
    curve.x.push_back(x * x_unit);
    curve.loading.push_back((slope * x + half) * f_unit);
    curve.unloading.push_back((slope * x - half) * f_unit);
  }
  return curve;
}

/// A unit that may have been used by mistake, with its factor relative to the correct one.
struct LikelyUnit {
  double factor;
  const char* unit;
};

/// Throws for a value outside least .. most; names a unit in which it would be usual.
void usual(Fields& f, std::string_view key, double value, double least, double most,
           const std::vector<LikelyUnit>& units) {
  std::string advice = "check the number and its unit";
  for (const LikelyUnit& other : units) {
    const double meant = value / other.factor;
    if (meant < least || meant > most) continue;
    advice = fmt::format("about {:.3g} times too {}: is it in {}? Then give {:.4g}",
                         other.factor > 1 ? other.factor : 1 / other.factor,
                         other.factor > 1 ? "large" : "small", other.unit, meant);
    break;
  }
  f.limit(value >= least && value <= most, key,
          fmt::format("{:g}; textiles have {:g} .. {:g}", value, least, most), advice);
}

void width(Fields& f, std::string_view key, std::optional<double>& value) {
  f.if_any({key, "full width of the loop", 1, 0}, value);
  if (value)
    f.limit(*value <= 20, key,
            fmt::format("the loop is {:g} wide; textiles have at most 20", *value),
            "is it in dyn/cm (980 times too large) instead of gf/cm?");
}

/// Distance over which friction builds up in a loop, which KES numbers do not state. It must be
/// complete where KES reads widths and slopes (0.5 1/cm and, after a reversal at 8 degrees, 5
/// degrees).
void slip(Fields& f, std::string_view key, std::optional<double>& value, double most) {
  f.if_any({key, "strain over which friction builds up", 1, above_zero}, value);
  if (value)
    f.limit(*value <= most, key,
            fmt::format("{:g}; KES reads the loop's width from {:g} on", *value, most),
            "give the strain over which the loop closes after a reversal, halved");
}

// WT = LT Fm EMT / 2.
double emt_of(const TensileNumbers& t) {
  return t.emt_percent ? *t.emt_percent : 100 * 2 * *t.wt_gf_cm_per_cm2 / (*t.lt * kLargestTension);
}
double lt_of(const TensileNumbers& t) {
  return t.lt ? *t.lt : 2 * *t.wt_gf_cm_per_cm2 / (kLargestTension * emt_of(t) / 100);
}

}  // namespace

void fields(Fields& f, TensileNumbers& t) {
  const char *emt_key = "emt_percent", *lt_key = "lt", *wt_key = "wt_gf_cm_per_cm2";
  f.if_any({emt_key, "extension under 500 gf/cm", 1, above_zero}, t.emt_percent);
  f.if_any({lt_key, "linearity of the loading curve", 1, above_zero}, t.lt);
  f.if_any({wt_key, "work of loading", 1, above_zero}, t.wt_gf_cm_per_cm2);
  f.if_any({"rt_percent", "work returned on unloading", 1, above_zero}, t.rt_percent);
  const int given = t.emt_percent.has_value() + t.lt.has_value() + t.wt_gf_cm_per_cm2.has_value();
  f.rule(given >= 2, t.emt_percent ? emt_key : lt_key, "a tensile test needs two of EMT, LT, WT",
         "give emt_percent and lt");
  if (given < 2) return;
  const double emt = emt_of(t), lt = lt_of(t);
  usual(f, t.emt_percent ? emt_key : wt_key, emt, 0.3, 100,
        {{0.01, "a fraction instead of percent"}});
  usual(f, t.lt ? lt_key : wt_key, lt, 0.2, 1.3, {{100, "percent instead of a fraction"}});
  const double work = lt * kLargestTension * emt / 100 / 2, wt = t.wt_gf_cm_per_cm2.value_or(work);
  f.limit(given < 3 || std::abs(wt - work) <= kAgreement * work, wt_key,
          fmt::format("WT is {:g}, but LT and EMT give {:.4g}", wt, work),
          "WT = LT * 500 gf/cm * EMT / 2; one of the three is wrong or of another load");
  if (t.rt_percent)
    usual(f, "rt_percent", *t.rt_percent, 5, 100, {{0.01, "a fraction instead of percent"}});
}

void fields(Fields& f, ShearNumbers& s) {
  const char* key = "g_gf_per_cm_deg";
  f({key, "shear stiffness G", 1, above_zero}, s.g_gf_per_cm_deg);
  usual(f, key, s.g_gf_per_cm_deg, kLeastShear, kMostShear,
        {{56.188, "N/(m rad)"}, {980.665, "dyn/(cm deg)"}, {1 / 57.296, "gf/(cm rad)"}});
  width(f, "hg2_gf_per_cm", s.hg2_gf_per_cm);
  width(f, "hg5_gf_per_cm", s.hg5_gf_per_cm);
  slip(f, "slip_angle_deg", s.slip_angle_deg, 1.5);
}

void fields(Fields& f, BendingNumbers& b) {
  const char* key = "b_gf_cm2_per_cm";
  f({key, "bending stiffness B", 1, above_zero}, b.b_gf_cm2_per_cm);
  usual(f, key, b.b_gf_cm2_per_cm, 5e-4, 20,
        {{980.665, "dyn cm2/cm"}, {98.0665, "uN m"}, {9.80665e-5, "N m"}});
  width(f, "hb2_gf_cm_per_cm", b.hb2_gf_cm_per_cm);
  slip(f, "slip_curvature_per_cm", b.slip_curvature_per_cm, 0.5);
}

KawabataCurve curve_of(const TensileNumbers& numbers, const std::filesystem::path& file) {
  KawabataCurve curve;
  curve.file = file;
  const double emt_percent = emt_of(numbers), lt = lt_of(numbers);
  const double loading = exponent_of(lt);
  const double unloading = exponent_of(lt * (0.01 * numbers.rt_percent.value_or(60)));
  for (int i = 0; i <= kPoints; ++i) {
    const double fraction = static_cast<double>(i) / kPoints;
    curve.x.push_back(fraction * emt_percent * units::percent);
    curve.loading.push_back(kLargestTension * rise(fraction, loading) * units::gf_per_cm);
    curve.unloading.push_back(kLargestTension * rise(fraction, unloading) * units::gf_per_cm);
  }
  return curve;
}

KawabataCurve curve_of(const ShearNumbers& numbers, const std::filesystem::path& file) {
  const double hg = numbers.hg2_gf_per_cm.value_or(0), hg5 = numbers.hg5_gf_per_cm.value_or(hg);
  KawabataCurve curve =
      loop(file, kShearRange, numbers.g_gf_per_cm_deg, units::deg, units::gf_per_cm,
           [&](double x) { return std::max(0.0, hg + (hg5 - hg) * (x - 0.5) / 4.5); });
  curve.slip = numbers.slip_angle_deg.value_or(kSlipAngle) * units::deg;
  return curve;
}

KawabataCurve curve_of(const BendingNumbers& numbers, const std::filesystem::path& file) {
  const double hb = numbers.hb2_gf_cm_per_cm.value_or(0);
  KawabataCurve curve = loop(file, kBendingRange, numbers.b_gf_cm2_per_cm, units::per_cm,
                             units::gf_cm_per_cm, [&](double) { return hb; });
  curve.slip = numbers.slip_curvature_per_cm.value_or(kSlipCurvature) * units::per_cm;
  return curve;
}

double shear_from_bias_extension(double eb5_percent, const Where& where) {
  const auto is_usual = [](double g) { return g >= kLeastShear && g <= kMostShear; };
  const double g = 5 * units::gf_per_cm / (4 * eb5_percent * units::percent) / units::gf_per_cm_deg;
  if (is_usual(g)) return g;
  throw bad_input(
      fmt::format("EB5 of {:g} % makes G {:.3g} gf/(cm deg); textiles have {:g} .. {:g}",
                  eb5_percent, g, kLeastShear, kMostShear),
      where,
      is_usual(g / 100) ? fmt::format("is it a fraction instead of percent? Then give "
                                      "{:g}",
                                      100 * eb5_percent)
                        : "give the extension at 45 degrees under 5 gf/cm, in percent");
}

}  // namespace drape::simulate
