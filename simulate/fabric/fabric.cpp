// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/fabric.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/drawing/svg.hpp"
#include "core/files/files.hpp"
#include "core/scene.hpp"
#include "core/units.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;

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
KawabataCurve loop(const fs::path& file, double range, double slope, double x_unit, double f_unit,
                   const Width& width) {
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

/// Distance over which friction builds up in a loop; KES numbers do not state it. Friction must be
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

/// Range of a value in file units for textiles, with the likely cause of other values.
struct Usual {
  double unit, least, most;
  const char* mistake;
};

/// One kind of Kawabata test.
struct TestKind {
  std::vector<std::string> columns;
  Usual x;         ///< for the largest abscissa
  Usual f;         ///< for the slope of the chord to it
  bool one_sided;  ///< true if the test starts at the origin
};
const TestKind kTensileTest = {
    {"strain_percent", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"},
    {units::percent, 0.3, 100, "is the strain a fraction instead of percent?"},
    {units::gf_per_cm, 0.5, 3000, "is the force in N/m or N instead of gf/cm?"},
    true};
const TestKind kShearTest = {
    {"shear_angle_deg", "loading_force_gf_per_cm", "unloading_force_gf_per_cm"},
    {units::deg, 1.5, 60, "is the angle in rad instead of degrees?"},
    {units::gf_per_cm, 0.02, 20,
     "is the force in N/m instead of gf/cm, or divided by the angle in rad?"},
    false};
const TestKind kBendingTest = {
    {"curvature_per_cm", "loading_moment_gf_cm_per_cm", "unloading_moment_gf_cm_per_cm"},
    {units::per_cm, 0.2, 20, "is the curvature in 1/m or 1/mm instead of 1/cm?"},
    {units::gf_cm_per_cm, 5e-4, 20, "is the moment in N or uN instead of gf cm/cm?"},
    false};

void check_abscissae(const Csv& csv, const TestKind& kind) {
  const std::vector<double>& x = csv.columns[0];
  if (x.size() < 3) {
    throw bad_input(fmt::format("{} points in the curve", x.size()), {.file = csv.file.string()},
                    "give at least three");
  }
  for (std::size_t i = 1; i < x.size(); ++i) {
    if (x[i] <= x[i - 1]) {
      throw bad_input(fmt::format("{} follows {}: the column does not increase", x[i], x[i - 1]),
                      {.file = csv.file.string(), .line = csv.lines[i], .field = kind.columns[0]},
                      "order the points; both branches stand in the same row");
    }
  }
  if (kind.one_sided && x.front() != 0.0) {
    throw bad_input(
        fmt::format("the curve starts at {}", x.front()),
        {.file = csv.file.string(), .line = csv.lines.front(), .field = kind.columns[0]},
        "a tensile test starts at strain 0");
  }
  if (!kind.one_sided && (x.front() >= 0.0 || x.back() <= 0.0)) {
    throw bad_input("the curve lies on one side of 0",
                    {.file = csv.file.string(), .field = kind.columns[0]},
                    "give both signs: the test swings from one side to the other");
  }
}

void check_range(const Csv& csv, const TestKind& kind) {
  const double reach = csv.columns[0].back();
  const Where last{.file = csv.file.string(), .line = csv.lines.back(), .field = kind.columns[0]};
  const auto check_end = [&](double end, const Where& where, const char* sign) {
    if (end >= kind.x.least && end <= kind.x.most) return;
    throw bad_input(fmt::format("the test ends at {}{}; textiles are tested to {}{} .. {}{}", sign,
                                end, sign, kind.x.least, sign, kind.x.most),
                    where, kind.x.mistake);
  };
  check_end(reach, last, "");
  if (!kind.one_sided)
    check_end(-csv.columns[0].front(),
              {.file = last.file, .line = csv.lines.front(), .field = last.field}, "-");
  const double first = kind.one_sided ? 0.0 : csv.columns[1].front();
  const double span = kind.one_sided ? reach : reach - csv.columns[0].front();
  const double slope = (csv.columns[1].back() - first) / span;
  if (!(slope >= kind.f.least && slope <= kind.f.most)) {
    throw bad_input(fmt::format("the mean slope is {:.4g}; textiles have {} .. {}", slope,
                                kind.f.least, kind.f.most),
                    {.file = last.file, .line = last.line, .field = kind.columns[1]},
                    kind.f.mistake);
  }
}

/// Throws if the zero was off: at 0 one branch must be above and one below, or both near it.
void check_zero(const Csv& csv, const TestKind& kind) {
  constexpr double kNear = 0.1;  // relative to the largest value: the two faces of cloth differ
  if (kind.one_sided) return;
  const std::vector<double>& x = csv.columns[0];
  const auto after = std::lower_bound(x.begin(), x.end(), 0.0) - x.begin();
  const double part = -x[after - 1] / (x[after] - x[after - 1]);
  double at_zero[2], most = 0;
  for (const int branch : {0, 1}) {
    const std::vector<double>& f = csv.columns[branch + 1];
    at_zero[branch] = f[after - 1] + part * (f[after] - f[after - 1]);
    for (const double value : f) most = std::max(most, std::abs(value));
  }
  const double least = std::min(std::abs(at_zero[0]), std::abs(at_zero[1]));
  if (at_zero[0] * at_zero[1] <= 0 || least <= kNear * most) return;
  throw bad_input(
      fmt::format("at 0 both branches lie on one side, at {:g} and {:g}", at_zero[0], at_zero[1]),
      {.file = csv.file.string(), .line = csv.lines[after], .field = kind.columns[1]},
      "take the recorder's zero off both branches");
}

/// Throws if the cloth returns more work than was done on it, within the noise of a test.
void check_branches(const Csv& csv, const TestKind& kind) {
  // relative to the work: a hundredth of full scale, as charts are read
  constexpr double kNoise = 0.01;
  double work = 0, lost = 0;
  for (std::size_t i = 1; i < csv.lines.size(); ++i) {
    const double step = 0.5 * (csv.columns[0][i] - csv.columns[0][i - 1]);
    for (const std::size_t k : {i - 1, i}) {
      work += step * std::abs(csv.columns[1][k]);
      lost += step * (csv.columns[1][k] - csv.columns[2][k]);
    }
  }
  if (lost >= -kNoise * work) return;
  throw bad_input(
      fmt::format("unloading gives back {:.0f} % more work than loading takes", -100 * lost / work),
      {.file = csv.file.string(), .field = kind.columns[1]},
      "are loading and unloading exchanged? Rising values are loading");
}

/// Throws unless both branches rise with the abscissa. Charts are read to a hundredth of full
/// scale: the second of two adjacent points may be lower by four standard deviations of that.
void check_rise(const Csv& csv, const TestKind& kind) {
  constexpr double kMostFall = 4 * 1.4142 * 0.01;
  for (const std::size_t branch : {1, 2}) {
    const std::vector<double>& f = csv.columns[branch];
    const auto [least, most] = std::minmax_element(f.begin(), f.end());
    for (std::size_t i = 1; i < f.size(); ++i) {
      if (f[i - 1] - f[i] <= kMostFall * (*most - *least)) continue;
      throw bad_input(
          fmt::format("{:g} follows {:g}: the curve falls by {:.0f} % of its range", f[i], f[i - 1],
                      100 * (f[i - 1] - f[i]) / (*most - *least)),
          {.file = csv.file.string(), .line = csv.lines[i], .field = kind.columns[branch]},
          "cloth that is strained further pulls harder: correct this point or the one before it");
    }
  }
}

KawabataCurve read_curve(const fs::path& file, const TestKind& kind) {
  const Csv csv = read_csv(file, kind.columns);
  check_abscissae(csv, kind);
  check_range(csv, kind);
  check_zero(csv, kind);
  check_rise(csv, kind);
  check_branches(csv, kind);
  KawabataCurve curve{file, csv.columns[0], csv.columns[1], csv.columns[2]};
  for (double& x : curve.x) x *= kind.x.unit;
  for (double& f : curve.loading) f *= kind.f.unit;
  for (double& f : curve.unloading) f *= kind.f.unit;
  return curve;
}

constexpr const char* kDirections[2] = {"warp", "weft"};
constexpr const char* kNumbers[2] = {"warp_kes", "weft_kes"};

/// Makes a curve per direction from its CSV or its numbers.
template <class Numbers>
void make_curves(const KawabataTest<Numbers>& test, const TestKind& kind, const fs::path& file,
                 KawabataCurve (&curves)[2]) {
  for (int d = 0; d < 2; ++d)
    curves[d] =
        test.numbers[d] ? curve_of(*test.numbers[d], file) : read_curve(*test.curve[d], kind);
}

/// |x| of the points on both sides, up to the nearer end.
std::vector<double> points_of_both_signs(const std::vector<double>& x) {
  std::vector<double> plus, minus;
  for (const double at : x) {
    if (at > 0) plus.push_back(at);
    if (at < 0) minus.insert(minus.begin(), -at);
  }
  return points_of_both(plus, minus);
}

/// Areal density (g/m2) and bending stiffness (gf cm2/cm) of 618 fabrics measured on a cantilever
/// (after Feng et al. 2022): in each bin 5 % lie below the first stiffness and 5 % above the
/// second, for the smaller and the larger of warp and weft.
struct DensityBin {
  double from, to, least_b, most_b;
};
constexpr std::array<DensityBin, 8> kFabrics{{{0, 60, 0.0046591, 0.11028},
                                              {60, 110, 0.0054912, 0.27147},
                                              {110, 165, 0.015967, 0.59069},
                                              {165, 220, 0.016561, 0.62418},
                                              {220, 262, 0.014392, 0.68584},
                                              {262, 320, 0.039686, 0.94155},
                                              {320, 420, 0.063295, 1.8732},
                                              {420, 900, 0.15424, 2.6756}}};
constexpr double kLightest = 15.77, kHeaviest = 758.4;  // 5 % of the lightest and heaviest bin
constexpr double kOtherUnit = 10;  // factor beyond the quantiles where no fabric was measured

constexpr const char* kWeigh =
    "weigh a piece of known area; is a decimal point lost, or is it mg/cm2, kg/m2 or oz/yd2?";

class Judge {
 public:
  explicit Judge(const Fabric& fabric)
      : fabric_(fabric), density_(fabric.areal_density_kg_per_m2 / units::g_per_m2) {}

  void density() {
    const std::string key = "areal_density_g_per_m2";
    const std::string what =
        fmt::format("an areal density of {:g} g/m2; fabrics have {:.0f} to {:.0f}", density_,
                    kLightest, kHeaviest);
    if (density_ > kFabrics.back().to)
      problem(key, what, kWeigh);
    else if (density_ < kLightest || density_ > kHeaviest)
      warning(key, what);
  }

  void bending(int direction) {
    const KawabataCurve& curve = fabric_.bending[direction];
    const double stiffness = stiffness_of(curve);
    const UsualBending usual = usual_bending(density_);
    const std::string what = fmt::format(
        "bending stiffness {:.3g} gf cm2/cm at {:g} g/m2; nine of ten fabrics of {:g} to {:g} g/m2 "
        "have {:.2g} to {:.2g}",
        stiffness, density_, usual.from, usual.to, usual.least, usual.most);
    const std::string key = direction == 0 ? "bending.warp" : "bending.weft";
    if (stiffness < usual.least_possible || stiffness > usual.most_possible) {
      problem(curve.file == fabric_.file ? key + "_kes.b_gf_cm2_per_cm" : key, what,
              "is it in uN m (98 times as large), in dyn cm2/cm (981 times) or in gf cm (per "
              "sample)?");
    } else if (stiffness < usual.least || stiffness > usual.most) {
      warning(key, what);
    }
  }

  /// Checks the bias stiffness: cloth bends at 45 degrees about as along its threads. In the
  /// published fabrics (rigs/fabrics/published.csv) it stays within twice the range of both.
  void bias() {
    constexpr double kBeyond = 5;  // half of a misplaced decimal point
    if (!fabric_.bias_bending_n_m) return;
    const double bias = *fabric_.bias_bending_n_m / units::gf_cm2_per_cm;
    const double warp = stiffness_of(fabric_.bending[0]), weft = stiffness_of(fabric_.bending[1]);
    if (bias >= std::min(warp, weft) / kBeyond && bias <= std::max(warp, weft) * kBeyond) return;
    problem("bending.bias_stiffness_gf_cm2_per_cm",
            fmt::format("{:g} gf cm2/cm at 45 degrees, {:.3g} and {:.3g} along warp and weft", bias,
                        warp, weft),
            "is a decimal point lost, or is it in uN m (98 times as large)?");
  }

  /// Checks the loops: the unloading branch must be positive at the largest strain of KES, and a
  /// shear loop at least as wide at 5 degrees as at 0.5.
  void loops() {
    for (const int direction : {0, 1}) {
      const std::string key = direction == 0 ? "warp" : "weft";
      for (const auto& [kind, curve, width, slope] :
           {std::tuple{"bending", &fabric_.bending[direction], "2HB", "B"},
            std::tuple{"shear", &fabric_.shear[direction], "2HG5", "G"}})
        if (curve->file == fabric_.file && curve->unloading.back() < 0)
          warning(fmt::format("{}.{}_kes", kind, key),
                  fmt::format("let go at the largest strain of the test the cloth would not go "
                              "back: {} is too large or {} too small",
                              width, slope));
      const auto& numbers = fabric_.stated.shear.numbers[direction];
      if (numbers && numbers->hg2_gf_per_cm && numbers->hg5_gf_per_cm &&
          *numbers->hg2_gf_per_cm > *numbers->hg5_gf_per_cm)
        warning(fmt::format("shear.{}_kes", key),
                fmt::format("2HG {:g} gf/cm is above 2HG5 {:g}: are the two exchanged?",
                            *numbers->hg2_gf_per_cm, *numbers->hg5_gf_per_cm));
    }
  }

  [[nodiscard]] Plausibility result() && { return std::move(result_); }

 private:
  /// Mean slope in gf cm2/cm between the ends of the curve.
  static double stiffness_of(const KawabataCurve& curve) {
    return (curve.loading.back() - curve.loading.front()) / (curve.x.back() - curve.x.front()) /
           units::gf_cm2_per_cm;
  }
  void problem(const std::string& key, const std::string& what, const char* advice) {
    result_.problems.push_back(bad_input(what, fabric_.stated.document.where(key), advice));
  }
  void warning(const std::string& field, const std::string& what) {
    result_.warnings.push_back(fmt::format("{}, {}: {}", fabric_.file.string(), field, what));
  }

  const Fabric& fabric_;
  double density_;
  Plausibility result_;
};

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

/// Data for a law: mean curve and width of the loop, and the part omitted by merging its branches.
struct Loop {
  SampledCurve mean;
  HalfWidth width;
  double half_hysteresis = 0;
  std::optional<double> slip;
  fs::path file;
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
    if (!fit.stack.empty())
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

KawabataCurve curve_of(const TensileNumbers& numbers, const fs::path& file) {
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

KawabataCurve curve_of(const ShearNumbers& numbers, const fs::path& file) {
  const double hg = numbers.hg2_gf_per_cm.value_or(0), hg5 = numbers.hg5_gf_per_cm.value_or(hg);
  KawabataCurve curve =
      loop(file, kShearRange, numbers.g_gf_per_cm_deg, units::deg, units::gf_per_cm,
           [&](double x) { return std::max(0.0, hg + (hg5 - hg) * (x - 0.5) / 4.5); });
  curve.slip = numbers.slip_angle_deg.value_or(kSlipAngle) * units::deg;
  return curve;
}

KawabataCurve curve_of(const BendingNumbers& numbers, const fs::path& file) {
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

template <class Numbers>
void fields(Fields& f, KawabataTest<Numbers>& test) {
  for (int d = 0; d < 2; ++d) {
    f.if_any({kDirections[d], "CSV of the test"}, test.curve[d]);
    f.if_any({kNumbers[d], "numbers of the test, where there is no CSV"}, test.numbers[d]);
    f.rule(!test.curve[d] || !test.numbers[d], kNumbers[d],
           fmt::format("`{}` gives the same curve as a file", kDirections[d]),
           "keep one of the two");
    f.rule(test.curve[d] || test.numbers[d], kDirections[d],
           fmt::format("`{}` is missing", kDirections[d]),
           fmt::format("name its CSV, or give `{}`", kNumbers[d]));
  }
}

void fields(Fields& f, BendingTest& test) {
  fields(f, static_cast<KawabataTest<BendingNumbers>&>(test));
  f.if_any({"bias_stiffness_gf_cm2_per_cm", "bending stiffness at 45 degrees", units::gf_cm2_per_cm,
            above_zero},
           test.bias_bending_n_m);
}

void fields(Fields& f, FabricFile& fabric) {
  const char* density = "areal_density_g_per_m2";
  f({"name", "name of the fabric"}, fabric.name);
  f({density, "mass per area", 1, above_zero}, fabric.areal_density_g_per_m2);
  const std::string weighs =
      fmt::format("no textile weighs {} g/m2", fabric.areal_density_g_per_m2);
  f.limit(fabric.areal_density_g_per_m2 >= 5, density, weighs,
          "is it in kg/m2 (1000 g/m2 each) or oz/yd2 (33.9)?");
  f.limit(fabric.areal_density_g_per_m2 <= 3000, density, weighs,
          "is it the density per volume, or in mg/m2?");
  f.if_any({"stand_ins", "assumed values that were not measured"}, fabric.stand_ins);
  f.if_any({"tensile", "force over strain"}, fabric.tensile);
  f({"shear", "force over angle"}, fabric.shear);
  f({"bending", "moment over curvature"}, fabric.bending);
}

std::vector<fs::path> Fabric::files() const {
  std::vector<fs::path> all = {file};
  for (const auto* curve :
       {&tensile[0], &tensile[1], &shear[0], &shear[1], &bending[0], &bending[1]}) {
    if (curve->file != file) all.push_back(curve->file);  // otherwise made from numbers in the file
  }
  return all;
}

Fabric read_fabric(const fs::path& file) {
  Fabric fabric;
  fabric.stated = read_record<FabricFile>(file);
  throw_if_any(faults_of_stand_ins(
      fabric.stated.document, {"all", "areal density", "tensile curves", "tensile", "shear curves",
                               "shear", "bending curves", "bending", "twist", "bias"}));
  const FabricFile& stated = fabric.stated;
  fabric.file = file;
  fabric.name = stated.name;
  fabric.areal_density_kg_per_m2 = stated.areal_density_g_per_m2 * units::g_per_m2;
  fabric.stand_ins = stated.stand_ins;
  fabric.bias_bending_n_m = stated.bending.bias_bending_n_m;
  make_curves(stated.bending, kBendingTest, file, fabric.bending);
  if (stated.tensile) {
    make_curves(*stated.tensile, kTensileTest, file, fabric.tensile);
  } else {
    fabric.tensile[0] = fabric.tensile[1] = curve_of(kUsualTensile, file);
    fabric.stand_ins.emplace_back("tensile curves: EMT 3 %, LT 0.7, RT 60 %");
  }
  make_curves(stated.shear, kShearTest, file, fabric.shear);
  const Plausibility plausibility = judge(fabric);
  fabric.warnings = plausibility.warnings;
  for (const Error& problem : plausibility.problems)
    fabric.warnings.push_back(fmt::format("{}: {}; {}", problem.where().describe(),
                                          problem.what_failed(), problem.what_to_do()));
  return fabric;
}

std::string fabric_sha256(const Fabric& fabric) {
  std::string all;
  for (const fs::path& file : fabric.files())
    all += (file == fabric.file ? fabric.stated.document.sha256() : sha256_of_file(file)) + "\n";
  return sha256_of(all);
}

SampledCurve merged_tensile(const KawabataCurve& curve) {
  SampledCurve merged{curve.x, curve.loading};
  const double offset = merged.f.front();
  for (double& f : merged.f) f -= offset;
  return merged;
}

SampledCurve merged_loop(const KawabataCurve& curve) {
  SampledCurve mean{curve.x, {}};
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    mean.f.push_back(0.5 * (curve.loading[i] + curve.unloading[i]));
  }
  SampledCurve odd{points_of_both_signs(curve.x), {0.0}};
  for (std::size_t i = 1; i < odd.x.size(); ++i)
    odd.f.push_back(0.5 * (mean.at(odd.x[i]) - mean.at(-odd.x[i])));
  return odd;
}

HalfWidth half_width(const KawabataCurve& curve) {
  SampledCurve width{curve.x, {}};
  for (std::size_t i = 0; i < curve.x.size(); ++i)
    width.f.push_back(curve.loading[i] - curve.unloading[i]);
  HalfWidth half{points_of_both_signs(curve.x), {}};
  for (const double x : half.x) half.h.push_back(0.25 * (width.at(x) + width.at(-x)));
  return half;
}

double half_hysteresis(const KawabataCurve& curve) {
  const double middle = 0.5 * (curve.x.front() + curve.x.back());
  const double quarter = 0.25 * (curve.x.back() - curve.x.front());
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (std::abs(curve.x[i] - middle) > quarter) continue;
    sum += 0.5 * std::abs(curve.loading[i] - curve.unloading[i]);
    ++count;
  }
  return count == 0 ? 0.0 : sum / count;
}

UsualBending usual_bending(double density_g_per_m2) {
  const auto bin = std::find_if(kFabrics.begin(), kFabrics.end() - 1,
                                [&](const DensityBin& one) { return density_g_per_m2 < one.to; });
  return {bin->from,
          bin->to,
          bin->least_b,
          bin->most_b,
          bin->least_b / kOtherUnit,
          bin->most_b * kOtherUnit};
}

Plausibility judge(const Fabric& fabric) {
  Judge judge(fabric);
  judge.density();
  for (const int direction : {0, 1}) judge.bending(direction);
  judge.bias();
  judge.loops();
  return std::move(judge).result();
}

void require_textile(const Fabric& fabric) {
  const Plausibility plausibility = judge(fabric);
  if (!plausibility.problems.empty()) throw plausibility.problems.front();
}

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
