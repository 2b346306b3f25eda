// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/fabric.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/files/files.hpp"
#include "core/rules.hpp"
#include "core/units.hpp"
#include "simulate/fabric/plausible.hpp"
#include "simulate/fabric/points.hpp"

namespace drape::simulate {
namespace {

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

/// Throws if cloth returns more work than was done on it, within the noise of a test.
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
/// scale, so of two adjacent points the second may be lower by four standard deviations of that.
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

KawabataCurve read_curve(const std::filesystem::path& file, const TestKind& kind) {
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
void make_curves(const KawabataTest<Numbers>& test, const TestKind& kind,
                 const std::filesystem::path& file, KawabataCurve (&curves)[2]) {
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

}  // namespace

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

std::vector<std::filesystem::path> Fabric::files() const {
  std::vector<std::filesystem::path> all = {file};
  for (const auto* curve :
       {&tensile[0], &tensile[1], &shear[0], &shear[1], &bending[0], &bending[1]}) {
    if (curve->file != file) all.push_back(curve->file);  // otherwise made from numbers in the file
  }
  return all;
}

Fabric read_fabric(const std::filesystem::path& file) {
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
  for (const std::filesystem::path& file : fabric.files())
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

}  // namespace drape::simulate
