// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/laws.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace drape::simulate
