// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/kes.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/units.hpp"

namespace drape::simulate {
namespace {

constexpr double kLargestTension = 500;  // gf/cm, KES-FB1
constexpr double kShearRange = 8;        // degrees, KES-FB1
constexpr double kBendingRange = 2.5;    // 1/cm, KES-FB2
constexpr double kSlipAngle = 0.5;       // degrees, and
constexpr double kSlipCurvature = 0.1;   // 1/cm: stand-ins, see slip_of()
constexpr double kAgreement = 0.03;      // of WT against LT and EMT
constexpr double kLeastShear = 0.02;     // gf/(cm deg), of textiles
constexpr double kMostShear = 20;
constexpr int kPoints = 50;  // per curve and sign

/// x = b EMT of the exponential law with the given linearity; below 0 for one above 1, by
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

KawabataCurve tensile_curve(const std::filesystem::path& file, double emt_percent, double lt,
                            double rt) {
  KawabataCurve curve;
  curve.file = file;
  const double loading = exponent_of(lt);
  const double unloading = exponent_of(lt * rt);
  for (int i = 0; i <= kPoints; ++i) {
    const double fraction = static_cast<double>(i) / kPoints;
    curve.x.push_back(fraction * emt_percent * units::percent);
    curve.loading.push_back(kLargestTension * rise(fraction, loading) * units::gf_per_cm);
    curve.unloading.push_back(kLargestTension * rise(fraction, unloading) * units::gf_per_cm);
  }
  return curve;
}

/// Both branches at half the loop's width from the middle line.
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

double width_of(const TomlTable& table, const std::string& key, double otherwise) {
  if (!table.has(key)) return otherwise;
  const double width = table.not_negative(key);
  if (width > 20) {
    table.reject(key, fmt::format("the loop is {:g} wide; textiles have at most 20", width),
                 "is it in dyn/cm (980 times too large) instead of gf/cm?");
  }
  return width;
}

/// How far a loop is driven until friction is built up, which KES numbers do not tell. It must be
/// done where KES begins to read widths and slopes (0.5 1/cm and, after a reversal at 8 degrees,
/// 5).
double slip_of(const TomlTable& table, const std::string& key, double otherwise, double most) {
  if (!table.has(key)) return otherwise;
  const double slip = table.positive(key);
  if (slip > most)
    table.reject(key, fmt::format("{:g}; KES reads the loop's width from {:g} on", slip, most),
                 "give the strain over which the loop closes after a reversal, halved");
  return slip;
}

}  // namespace

void check_usual(const TomlTable& table, const std::string& key, double value, double least,
                 double most, const std::vector<LikelyUnit>& units) {
  if (value >= least && value <= most) return;
  std::string advice = "check the number and its unit";
  for (const LikelyUnit& other : units) {
    const double meant = value / other.factor;
    if (meant < least || meant > most) continue;
    advice = fmt::format("about {:.3g} times too {}: is it in {}? Then give {:.4g}",
                         other.factor > 1 ? other.factor : 1 / other.factor,
                         other.factor > 1 ? "large" : "small", other.unit, meant);
    break;
  }
  table.reject(key, fmt::format("{:g}; textiles have {:g} .. {:g}", value, least, most), advice);
}

KawabataCurve tensile_from_kes(const TomlTable& table) {
  const std::string emt_key = "emt_percent", lt_key = "lt", wt_key = "wt_gf_cm_per_cm2";
  const int given = table.has(emt_key) + table.has(lt_key) + table.has(wt_key);
  if (given < 2) {
    table.reject(table.has(emt_key) ? emt_key : lt_key, "a tensile test needs two of EMT, LT, WT",
                 "give emt_percent and lt");
  }
  double emt = table.has(emt_key) ? table.positive(emt_key) : 0;
  double lt = table.has(lt_key) ? table.positive(lt_key) : 0;
  const double wt = table.has(wt_key) ? table.positive(wt_key) : 0;
  // WT = LT Fm EMT / 2.
  if (emt == 0) emt = 100 * 2 * wt / (lt * kLargestTension);
  if (lt == 0) lt = 2 * wt / (kLargestTension * emt / 100);
  check_usual(table, table.has(emt_key) ? emt_key : wt_key, emt, 0.3, 100,
              {{0.01, "a fraction instead of percent"}});
  check_usual(table, table.has(lt_key) ? lt_key : wt_key, lt, 0.2, 1.3,
              {{100, "percent instead of a fraction"}});
  const double work = lt * kLargestTension * emt / 100 / 2;
  if (given == 3 && std::abs(wt - work) > kAgreement * work) {
    table.reject(wt_key, fmt::format("WT is {:g}, but LT and EMT give {:.4g}", wt, work),
                 "WT = LT * 500 gf/cm * EMT / 2; one of the three is wrong or of another load");
  }
  double rt = 60;
  if (table.has("rt_percent")) rt = table.positive("rt_percent");
  check_usual(table, "rt_percent", rt, 5, 100, {{0.01, "a fraction instead of percent"}});
  return tensile_curve(table.file(), emt, lt, 0.01 * rt);
}

KawabataCurve shear_from_kes(const TomlTable& table) {
  const std::string key = "g_gf_per_cm_deg";
  const double g = table.positive(key);
  check_usual(table, key, g, kLeastShear, kMostShear,
              {{56.188, "N/(m rad)"}, {980.665, "dyn/(cm deg)"}, {1 / 57.296, "gf/(cm rad)"}});
  const double hg = width_of(table, "hg2_gf_per_cm", 0);
  const double hg5 = width_of(table, "hg5_gf_per_cm", hg);
  KawabataCurve curve =
      loop(table.file(), kShearRange, g, units::deg, units::gf_per_cm,
           [&](double x) { return std::max(0.0, hg + (hg5 - hg) * (x - 0.5) / 4.5); });
  curve.slip = slip_of(table, "slip_angle_deg", kSlipAngle, 1.5) * units::deg;
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

KawabataCurve bending_from_kes(const TomlTable& table) {
  const std::string key = "b_gf_cm2_per_cm";
  const double b = table.positive(key);
  check_usual(table, key, b, 5e-4, 20,
              {{980.665, "dyn cm2/cm"}, {98.0665, "uN m"}, {9.80665e-5, "N m"}});
  const double hb = width_of(table, "hb2_gf_cm_per_cm", 0);
  KawabataCurve curve = loop(table.file(), kBendingRange, b, units::per_cm, units::gf_cm_per_cm,
                             [&](double) { return hb; });
  curve.slip = slip_of(table, "slip_curvature_per_cm", kSlipCurvature, 0.5) * units::per_cm;
  return curve;
}

KawabataCurve usual_tensile(const std::filesystem::path& file) {
  return tensile_curve(file, 3, 0.7, 0.6);
}

}  // namespace drape::simulate
