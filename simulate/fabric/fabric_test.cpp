// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/fabric/laws.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

SampledCurve sampled(double (*law)(double), double reach) {
  SampledCurve curve;
  for (int i = 0; i <= 200; ++i) {
    curve.x.push_back(reach * i / 200);
    curve.f.push_back(law(curve.x.back()));
  }
  return curve;
}

double tensile(double x) {
  return 85.6 * (std::exp(47.65 * x) - 1);
}

TEST(Curve, ALineIsReproducedWithoutHinges) {
  const SampledCurve line = sampled([](double x) { return 3.5 * x; }, 2.0);
  const FittedCurve five = fit_segments(line, 5);
  EXPECT_TRUE(five.curve.hinges.empty());
  EXPECT_NEAR(five.curve.slope, 3.5, 1e-12);
  EXPECT_NEAR(fit_line(line, 1.0).curve.slope, 3.5, 1e-12);
}

TEST(Curve, SegmentsMeetTheMeasurementAtTheirKnots) {
  const SampledCurve measured = sampled(tensile, 0.04);
  const FittedCurve fit = fit_segments(measured, 5);
  ASSERT_EQ(fit.curve.hinges.size(), 4u);
  for (const ForceCurve::Hinge& hinge : fit.curve.hinges) {
    EXPECT_NEAR(fit.curve.value(hinge.at), measured.at(hinge.at), 1e-9);
  }
  EXPECT_NEAR(fit.curve.value(0.04), measured.f.back(), 1e-9);
}

TEST(Curve, MoreSegmentsFitBetter) {
  const SampledCurve measured = sampled(tensile, 0.04);
  double before = fit_segments(measured, 1).rms_error;
  for (const int segments : {2, 3, 5, 8}) {
    const double now = fit_segments(measured, segments).rms_error;
    EXPECT_LT(now, before);
    before = now;
  }
}

TEST(Curve, KnotsAreTheBestOfAllChoices) {
  // Exhaustive search for the inner knot of two segments.
  const SampledCurve measured = sampled(tensile, 0.04);
  const FittedCurve fit = fit_segments(measured, 2);
  for (int k = 1; k < 100; ++k) {
    const double knot = 0.04 * k / 100;
    const double first = measured.at(knot) / knot;
    const double second = (measured.f.back() - measured.at(knot)) / (0.04 - knot);
    double sum = 0;
    for (int i = 0; i <= 100; ++i) {
      const double x = 0.04 * i / 100;
      const double f = x <= knot ? first * x : measured.at(knot) + second * (x - knot);
      sum += (f - measured.at(x)) * (f - measured.at(x));
    }
    EXPECT_GE(std::sqrt(sum / 101), fit.rms_error - 1e-9);
  }
}

/// Root mean square error in 0 .. reach, at points not used by the fit.
double rms_within(const ForceCurve& curve, const SampledCurve& measured, double reach) {
  double sum = 0;
  for (int i = 0; i < 1000; ++i) {
    const double x = reach * (i + 0.5) / 1000;
    sum += std::pow(curve.value(x) - measured.at(x), 2);
  }
  return std::sqrt(sum / 1000);
}

TEST(Curve, FiveSegmentsAreNeverFartherThanOneWhereTheClothLives) {
  for (const double bow : {-40.0, -5.0, 0.0, 5.0, 47.65, 200.0}) {
    for (const double reach : {1e-5, 4e-4, 3e-3, 0.02, 0.04, 1.0}) {
      SampledCurve measured;
      for (int i = 0; i <= 200; ++i) {
        const double x = 0.04 * i / 200;
        const double ripple = 1 + 0.02 * std::sin(3000 * x);  // like reading errors from a chart
        measured.x.push_back(x);
        measured.f.push_back(ripple * (bow == 0 ? 4000 * x : 4000 / bow * std::expm1(bow * x)));
      }
      const FittedCurve line = fit_reached(measured, 1, reach);
      const FittedCurve five = fit_reached(measured, 5, reach);
      EXPECT_TRUE(line.curve.hinges.empty());
      EXPECT_LE(five.curve.hinges.size(), 4U);
      EXPECT_EQ(five.range, line.range);
      const double noise = 1e-3 * std::abs(measured.at(five.range));
      EXPECT_LE(rms_within(five.curve, measured, five.range),
                rms_within(line.curve, measured, five.range) + noise)
          << bow << ", " << reach;
      EXPECT_NEAR(five.curve.value(0.04), measured.f.back(), 1e-9 * measured.f.back());
    }
  }
}

TEST(Curve, WhereTheClothLivesTheFirstSlopeIsTheMeasuredOne) {
  // Loads of a drape are thousandths of the test's; the slope at the origin is 4079 N/m.
  const SampledCurve measured = sampled(tensile, 0.04);
  const double whole = fit_segments(measured, 5).curve.slope;
  const double reached = fit_reached(measured, 5, 4e-4).curve.slope;
  EXPECT_GT(whole / 4079, 1.1);
  EXPECT_NEAR(reached / 4079, 1, 0.02);
}

TEST(Curve, ALineThatFallsIsFittedFartherOut) {
  const SampledCurve noisy{{0, 0.001, 0.002, 0.003, 0.004}, {0, -0.1, 3, 6, 9}};
  const FittedCurve fit = fit_reached(noisy, 5, 1e-4);
  EXPECT_DOUBLE_EQ(fit.range, 0.002);
  EXPECT_GT(fit.curve.slope, 0);
}

TEST(Curve, EnergyIsTheIntegralOfTheForce) {
  const ForceCurve curve{2.0, {{0.1, 3.0}, {0.3, -1.0}}};
  double integral = 0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) integral += curve.value(0.5 * (i + 0.5) / kSteps) * 0.5 / kSteps;
  EXPECT_NEAR(curve.energy(0.5), integral, 1e-9);
  EXPECT_DOUBLE_EQ(curve.value(-0.2), -0.4);
  EXPECT_DOUBLE_EQ(curve.odd_value(-0.4), -curve.value(0.4));
  EXPECT_DOUBLE_EQ(curve.steepest_up_to(0.2), 5.0);
}

namespace fs = std::filesystem;

/// A copy of bench1's fabric A that a test can damage.
class SpoiledFabric : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::copy(test::source_root() / "rigs/bench1/fabrics", folder_.path(),
             fs::copy_options::recursive);
  }
  void replace(const std::string& file, const std::string& old, const std::string& now) {
    std::string text = read_text(folder_.path() / file);
    const auto place = text.find(old);
    ASSERT_NE(place, std::string::npos) << old;
    text.replace(place, old.size(), now);
    write_durable(folder_.path() / file, text);
  }
  Error error_of() {
    try {
      (void)read_fabric(folder_.path() / "A.toml");
    } catch (const Error& error) {
      return error;
    }
    ADD_FAILURE() << "the fabric was accepted";
    return internal_error("none");
  }
  test::TemporaryFolder folder_;
};

TEST(Fabric, Bench1HasItsMeasuredBendingStiffnessAndDensity) {
  const double stiffness[2] = {7.7e-6, 20.4e-6};
  const double density[2] = {0.138, 0.291};
  for (int k = 0; k < 2; ++k) {
    const Fabric fabric =
        read_fabric(test::source_root() / "rigs/bench1/fabrics" / (k == 0 ? "A.toml" : "B.toml"));
    EXPECT_DOUBLE_EQ(fabric.areal_density_kg_per_m2, density[k]);
    for (const int segments : {1, 5}) {
      const auto [laws, curves, warnings] = fit_laws(fabric, segments);
      for (const auto& bending : laws.bending) {
        EXPECT_NEAR(bending.slope, stiffness[k], 1e-3 * stiffness[k]);
        EXPECT_TRUE(bending.hinges.empty());
      }
      // The stiffness at 45 degrees is the same: J = 2 B.
      EXPECT_NEAR(laws.twist_n_m, 2 * stiffness[k], 4e-3 * stiffness[k]);
      EXPECT_NEAR(laws.shear.slope, 0.6 * units::gf_per_cm_deg, 1e-3 * 33.7);
      EXPECT_EQ(curves.size(), 5u);
    }
    EXPECT_THAT(fabric.stand_ins, ::testing::Contains("tensile curves"));
    EXPECT_THAT(fabric.warnings, ::testing::IsEmpty());
  }
}

TEST(Fabric, UnitConversionsAgreeWithTheReferenceTable) {
  const std::filesystem::path folder = drape::test::test_data("fabrics");
  const std::string table = read_text(folder / "unit_conversions.csv");
  const auto factor = [&table](const std::string& row) {
    const auto line = table.substr(table.find(row + ","));
    const auto end = line.find('\n');
    return std::stod(line.substr(line.rfind(',', end) + 1, end));
  };
  EXPECT_NEAR(units::gf_per_cm, factor("tension"), 1e-9);
  EXPECT_NEAR(units::gf_per_cm_deg, factor("G"), 1e-7);
  EXPECT_NEAR(units::gf_cm2_per_cm, factor("B"), 1e-12);
  EXPECT_NEAR(units::gf_cm_per_cm, factor("2HB"), 1e-9);
}

/// A file with one value, or all of it, replaced, and the expected error.
struct Spoiled {
  const char *file, *old, *now;  ///< an empty `old` replaces the whole file
  const char* in_file;
  std::optional<int> line;
  const char *field, *says;
};
const char kShearHead[] = "shear_angle_deg,loading_force_gf_per_cm,unloading_force_gf_per_cm\n";

TEST_F(SpoiledFabric, IsRefusedByItsPlaceAndTheLikelyMistake) {
  const std::string head = kShearHead;
  const std::string radians = head + "-0.14,-4.8,-4.8\n0,0.5,-0.5\n0.14,4.8,4.8\n",
                    cut = head + "-0.05,0.2,-0.2\n0,0.5,-0.5\n8,5,4.4\n";
  const char *density = "areal_density_g_per_m2", *shear = "A/shear_warp.csv";
  const std::vector<Spoiled> cases = {
      {"A/bending_warp.csv", "-2.4,-0.180944", "-2.4,nan", "bending_warp.csv", 5,
       "loading_moment_gf_cm_per_cm", ""},
      {"A.toml", "areal_density_g_per_m2 = 138", "areal_density_g_per_m2 = -138", "A.toml", 5,
       density, ""},
      {"A.toml", "areal_density_g_per_m2 = 138", "areal_density_g_per_m2 = 0.138", "A.toml", 5,
       density, "kg/m2"},
      {"A.toml", density, "areal_density_kg_per_m2", "A.toml", {}, nullptr, "areal_density"},
      {"A/shear_weft.csv", "shear_angle_deg", "shear_angle_rad", "shear_weft.csv", 2, nullptr,
       "shear_angle_deg"},
      {shear, "\n-7.5,", "\n-8.5,", "shear_warp.csv", 4, "shear_angle_deg", ""},
      {shear, nullptr, radians.c_str(), "shear_warp.csv", {}, nullptr, "rad"},
      {shear, nullptr, cut.c_str(), "shear_warp.csv", 2, nullptr, "the test ends at -0.05"},
      {"A.toml", "[tensile]", "[tensile]\nbias = \"x.csv\"", "A.toml", {}, nullptr, "bias"}};
  for (const Spoiled& one : cases) {
    const std::string good = read_text(folder_.path() / one.file);
    if (one.old != nullptr)
      replace(one.file, one.old, one.now);
    else
      write_durable(folder_.path() / one.file, one.now);
    const Error error = error_of();
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << one.now;
    EXPECT_THAT(error.where().file, ::testing::HasSubstr(one.in_file)) << one.now;
    EXPECT_THAT(error.what(), ::testing::HasSubstr(one.says)) << one.now;
    if (one.line) {
      EXPECT_EQ(error.where().line, one.line) << one.now;
    }
    if (one.field != nullptr) {
      EXPECT_EQ(error.where().field, one.field) << one.now;
    }
    write_durable(folder_.path() / one.file, good);
  }
}

TEST_F(SpoiledFabric, ARecordersZeroThatIsOffIsNamed) {
  const auto write = [&](double shift) {
    std::string text = kShearHead;
    for (const double x : {-8.0, -4.0, 0.0, 4.0, 8.0})
      text += std::to_string(x) + "," + std::to_string(0.6 * x + shift + 0.5) + "," +
              std::to_string(0.6 * x + shift - 0.5) + "\n";
    write_durable(folder_.path() / "A/shear_warp.csv", text);
  };
  write(0.4);  // its branches are still on both sides
  EXPECT_NO_THROW((void)read_fabric(folder_.path() / "A.toml"));
  write(1.5);
  const Error error = error_of();
  EXPECT_EQ(error.where().line, 4);
  EXPECT_THAT(error.what_to_do(), ::testing::HasSubstr("zero off both branches"));
}

TEST_F(SpoiledFabric, HashCoversTheCurves) {
  const std::string before = fabric_sha256(read_fabric(folder_.path() / "A.toml"));
  replace("A/tensile_weft.csv", "STAND-IN", "stand-in");
  EXPECT_NE(fabric_sha256(read_fabric(folder_.path() / "A.toml")), before);
}

TEST(Merging, LoopsBecomeTheMeanOfTheirBranches) {
  KawabataCurve loop{"", {-2, -1, 0, 1, 2}, {-2, -0.8, 0.2, 1.2, 2}, {-2, -1.2, -0.2, 0.8, 2}};
  const SampledCurve merged = merged_loop(loop);
  for (const double x : {0.0, 0.5, 1.0, 2.0}) EXPECT_NEAR(merged.at(x), x, 1e-12);
  EXPECT_NEAR(half_hysteresis(loop), 0.2, 1e-12);
}

/// A rising loop at the given points.
KawabataCurve loop_on(std::vector<double> x, double slope, double width) {
  KawabataCurve loop{"", std::move(x), {}, {}};
  for (const double at : loop.x) {
    const double mean = slope * at * (1 + 0.3 * std::abs(at) + (at > 0 ? 0.2 * at : 0));
    const double half = 0.5 * width * (1 + std::abs(at)) * (at < loop.x.back());
    loop.loading.push_back(mean + half);
    loop.unloading.push_back(mean - half);
  }
  return loop;
}

KawabataCurve turned_over(const KawabataCurve& loop) {
  KawabataCurve turned = loop;
  for (std::size_t i = 0; i < loop.x.size(); ++i) {
    const std::size_t other = loop.x.size() - 1 - i;
    turned.x[i] = -loop.x[other];
    turned.loading[i] = -loop.unloading[other];
    turned.unloading[i] = -loop.loading[other];
  }
  return turned;
}

TEST(Merging, NoPointOfEitherSideIsLost) {
  const KawabataCurve fine = loop_on({-2.5, -2, -1.5, -1, -0.5, 0, 2.5}, 1, 0.1);
  EXPECT_EQ(merged_loop(fine).x, (std::vector<double>{0, 0.5, 1, 1.5, 2, 2.5}));
  EXPECT_EQ(half_width(fine).x, merged_loop(fine).x);
  // The nearer end is between two points of the farther side.
  for (const auto& x : {std::vector<double>{-8, -4, -2, -1, 0, 1, 2, 4, 8.01}, {-8, -4, 0, 8.01}}) {
    const SampledCurve merged = merged_loop(loop_on(x, 1, 0.1));
    EXPECT_EQ(merged.x.back(), 8);
    for (std::size_t i = 1; i < merged.x.size(); ++i) EXPECT_GT(merged.f[i], merged.f[i - 1]);
  }
}

TEST(Merging, ClothTurnedOverHasTheSameCurves) {
  for (const auto& x : {std::vector<double>{-2.5, -1.7, -1, -0.2, 0.1, 2.4},
                        {-3, -0.3, 0, 0.1, 5},
                        {-2, -1, -0.1, 0.1, 1, 2}}) {
    const KawabataCurve loop = loop_on(x, 2, 0.3), turned = turned_over(loop);
    EXPECT_EQ(merged_loop(loop).x, merged_loop(turned).x);
    EXPECT_THAT(merged_loop(turned).f,
                testing::Pointwise(testing::DoubleNear(1e-12), merged_loop(loop).f));
    EXPECT_THAT(half_width(turned).h,
                testing::Pointwise(testing::DoubleNear(1e-12), half_width(loop).h));
  }
}

TEST(Merging, ShearIsTheSameWithWarpAndWeftExchanged) {
  std::vector<double> fine;
  for (int k = -79; k <= 79; ++k) fine.push_back(0.1 * k);
  for (const bool numbers : {false, true}) {
    Fabric fabric;
    fabric.shear[0] = loop_on({-8, -4, 0, 4, 8}, 1, 0.5);
    fabric.shear[1] = loop_on(fine, 2, 0.1);
    if (numbers) fabric.shear[0].slip = 0.5;
    for (int d = 0; d < 2; ++d) {
      fabric.tensile[d] = {"", {0, 0.01, 0.02}, {0, 1, 3}, {0, 1, 3}};
      fabric.bending[d] = loop_on({-2, -1, 0, 1, 2}, 1, 0.1);
    }
    Fabric exchanged = fabric;
    std::swap(exchanged.shear[0], exchanged.shear[1]);
    const FittedLaws own = fit_laws(fabric, 5, {}, true), other = fit_laws(exchanged, 5, {}, true);
    const ClothLaws &laws = own.laws, &swapped = other.laws;
    for (const double x : {0.5, 2.0, 5.0, 7.9})
      EXPECT_DOUBLE_EQ(laws.shear.value(x), swapped.shear.value(x)) << x;
    EXPECT_DOUBLE_EQ(laws.friction->shear.stiffness(), swapped.friction->shear.stiffness());
    for (std::size_t k = 0; k < own.curves.size(); ++k)
      EXPECT_DOUBLE_EQ(own.curves[k].half_hysteresis, other.curves[k].half_hysteresis);
  }
}

/// A fabric of KES numbers alone; tests change single lines.
class KesNumbers : public ::testing::Test {
 protected:
  Fabric read(const std::string& tensile, const std::string& shear, const std::string& bending) {
    const fs::path file = folder_.path() / "kes.toml";
    write_durable(file,
                  "schema = \"drapebench/fabric/1\"\nname = \"kes\"\n"
                  "areal_density_g_per_m2 = 150\n" +
                      tensile + "[shear]\nwarp_kes = { " + shear + " }\nweft_kes = { " + shear +
                      " }\n" + "[bending]\nwarp_kes = { " + bending + " }\nweft_kes = { " +
                      bending + " }\n");
    return read_fabric(file);
  }
  std::string advice(const std::string& tensile, const std::string& shear,
                     const std::string& bending) {
    try {
      (void)read(tensile, shear, bending);
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  }
  const std::string tensile_ =
      "[tensile]\nwarp_kes = { emt_percent = 4, lt = 0.7, wt_gf_cm_per_cm2 = 7.0, rt_percent = 55 "
      "}\nweft_kes = { emt_percent = 8, lt = 0.6 }\n";
  const std::string shear_ = "g_gf_per_cm_deg = 0.6, hg2_gf_per_cm = 0.5, hg5_gf_per_cm = 1.4";
  const std::string bending_ = "b_gf_cm2_per_cm = 0.088, hb2_gf_cm_per_cm = 0.04";
  test::TemporaryFolder folder_;
};

TEST_F(KesNumbers, GiveCurvesThatGiveTheNumbersBack) {
  const Fabric fabric = read(tensile_, shear_, bending_);
  EXPECT_EQ(fabric.files().size(), 1U);
  const KawabataCurve& warp = fabric.tensile[0];
  EXPECT_NEAR(warp.x.back(), 0.04, 1e-15);
  EXPECT_NEAR(warp.loading.back(), 500 * units::gf_per_cm, 1e-9);
  double loading = 0, unloading = 0;
  for (std::size_t i = 1; i < warp.x.size(); ++i) {
    const double step = 0.5 * (warp.x[i] - warp.x[i - 1]);
    loading += step * (warp.loading[i] + warp.loading[i - 1]);
    unloading += step * (warp.unloading[i] + warp.unloading[i - 1]);
  }
  EXPECT_NEAR(loading, 7.0 * units::gf_per_cm, 2e-3 * loading);  // WT; trapezoids of 50 points
  EXPECT_NEAR(unloading / loading, 0.55, 3e-3);                  // RT
  const ClothLaws laws = fit_laws(fabric, 1).laws;
  EXPECT_NEAR(laws.shear.slope, 0.6 * units::gf_per_cm_deg, 1e-9);
  EXPECT_NEAR(laws.bending[0].slope, 0.088 * units::gf_cm2_per_cm, 1e-15);
  EXPECT_NEAR(half_hysteresis(fabric.bending[0]), 0.02 * units::gf_cm_per_cm, 1e-12);
}

/// A curve that is concave contains more work than its triangle.
TEST_F(KesNumbers, ALinearityAboveOneKeepsItsWork) {
  const std::string numbers = "{ emt_percent = 4, lt = 1.25, wt_gf_cm_per_cm2 = 12.5 }\n";
  const Fabric fabric =
      read("[tensile]\nwarp_kes = " + numbers + "weft_kes = " + numbers, shear_, bending_);
  const KawabataCurve& warp = fabric.tensile[0];
  double work = 0;
  for (std::size_t i = 1; i < warp.x.size(); ++i)
    work += 0.5 * (warp.x[i] - warp.x[i - 1]) * (warp.loading[i] + warp.loading[i - 1]);
  EXPECT_NEAR(work, 12.5 * units::gf_per_cm, 2e-3 * work);
}

TEST_F(KesNumbers, BAndGAloneAreEnoughAndTheRestIsMarked) {
  const Fabric fabric = read("", "g_gf_per_cm_deg = 0.6", "b_gf_cm2_per_cm = 0.088");
  EXPECT_THAT(fabric.stand_ins, testing::Contains(testing::HasSubstr("tensile curves")));
  EXPECT_GT(fit_laws(fabric, 5).laws.tensile[0].slope, 1000);
}

TEST_F(KesNumbers, WrongUnitsAreNamed) {
  using testing::HasSubstr;
  EXPECT_THAT(advice(tensile_, shear_, "b_gf_cm2_per_cm = 86.3"),
              testing::AllOf(HasSubstr("981 times too large"), HasSubstr("dyn cm2/cm")));
  EXPECT_THAT(advice(tensile_, shear_, "b_gf_cm2_per_cm = 8.6e-6"), HasSubstr("in N m?"));
  EXPECT_THAT(advice(tensile_, "g_gf_per_cm_deg = 33.7", bending_), HasSubstr("N/(m rad)"));
  EXPECT_THAT(advice("[tensile]\nwarp_kes = { emt_percent = 0.04, lt = 0.7 }\n"
                     "weft_kes = { emt_percent = 4, lt = 0.7 }\n",
                     shear_, bending_),
              HasSubstr("a fraction instead of percent"));
  EXPECT_THAT(advice("[tensile]\nwarp_kes = { emt_percent = 4, lt = 0.7, wt_gf_cm_per_cm2 = 9 }\n"
                     "weft_kes = { emt_percent = 4, lt = 0.7 }\n",
                     shear_, bending_),
              HasSubstr("LT and EMT give 7"));
  EXPECT_THAT(
      advice("[tensile]\nwarp_kes = { lt = 0.7 }\nweft_kes = { lt = 0.7 }\n", shear_, bending_),
      HasSubstr("two of EMT, LT, WT"));
}

TEST_F(KesNumbers, ASheetThatIsNoTextileIsSimulatedWithAWarning) {
  const Fabric board = read(tensile_, shear_, "b_gf_cm2_per_cm = 8.6");  // 0.088 in uN m
  EXPECT_THROW(require_textile(board), Error);
  EXPECT_THAT(
      fit_laws(board, 1).warnings,
      testing::Contains(testing::AllOf(testing::HasSubstr("bending.warp_kes.b_gf_cm2_per_cm"),
                                       testing::HasSubstr("uN m"))));
}

TEST_F(KesNumbers, ThePlotShowsEveryCurveWithItsApproximation) {
  const std::string svg = curves_svg(read(tensile_, shear_, bending_), 5);
  for (const char* what :
       {"tensile warp", "tensile weft", "shear warp", "shear weft", "bending warp", "bending weft",
        "strain (%)", "angle (degrees)", "curvature (1/cm)", "5 segments"}) {
    EXPECT_THAT(svg, testing::HasSubstr(what));
  }
  EXPECT_THAT(svg, testing::Not(testing::HasSubstr("nan")));
}

}  // namespace
}  // namespace drape::simulate
