// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <random>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/fabric/fabric.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

/// An elastic line with a friction stack, driven like a specimen.
struct Specimen {
  ForceCurve elastic;
  FrictionStack stack;
  std::vector<double> slip = std::vector<double>(stack.elements.size(), 0.0);
  double dissipated = 0;

  double go(double x) {
    dissipated += stack.settle(x, slip.data());
    return elastic.odd_value(x) + stack.force(x, slip.data());
  }
  [[nodiscard]] double stored(double x) const {
    double sum = elastic.energy(std::abs(x));
    for (std::size_t k = 0; k < slip.size(); ++k) sum += stack.elements[k].stored(x, slip[k]);
    return sum;
  }
};

/// KES numbers as the instrument reads them: from the second cycle between -range and range.
struct KesReading {
  double slope = 0;  ///< mean of both branches from `from` to `to`, and of both signs
  std::function<double(double)> width;
};
KesReading read_as_kes(Specimen specimen, double range, double from, double to) {
  const auto branch = [&](double start, const std::vector<double>& at) {
    for (const double x : {range, -range, range, -range, start}) specimen.go(x);
    std::vector<double> f;
    f.reserve(at.size());
    for (const double x : at) f.push_back(specimen.go(x));
    return f;
  };
  const std::vector<double> up = branch(-range, {-to, -from, from, to});
  const std::vector<double> down = branch(range, {to, from, -from, -to});
  const double rise = (up[3] - up[2]) + (up[1] - up[0]) + (down[0] - down[1]) + (down[2] - down[3]);
  return {rise / (4 * (to - from)), [=](double x) mutable {
            double sum = 0;
            for (const double at : {x, -x}) {
              Specimen lower = specimen, upper = specimen;
              for (const double turn : {range, -range}) lower.go(turn);
              for (const double turn : {-range, range}) upper.go(turn);
              sum += 0.5 * (lower.go(at) - upper.go(at));
            }
            return sum;
          }};
}

Fabric fabric_of(const std::string& shear, const std::string& bending) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "fabric.toml";
  write_durable(file,
                "schema = \"drapebench/fabric/1\"\nname = \"X\"\nareal_density_g_per_m2 = 124\n"
                "[shear]\nwarp_kes = " +
                    shear + "\nweft_kes = " + shear + "\n[bending]\nwarp_kes = " + bending +
                    "\nweft_kes = " + bending + "\n");
  return read_fabric(file);
}

TEST(Memory, GivesKesNumbersBack) {
  const Fabric fabric = fabric_of(
      "{ g_gf_per_cm_deg = 0.6, hg2_gf_per_cm = 0.5, "
      "hg5_gf_per_cm = 1.4 }",
      "{ b_gf_cm2_per_cm = 0.118, hb2_gf_cm_per_cm = 0.124 }");
  const ClothLaws laws = fit_laws(fabric, 5, {}, true).laws;
  ASSERT_TRUE(laws.friction);
  const double cm = units::per_cm, deg = units::deg;
  const KesReading bending =
      read_as_kes({laws.bending[0], laws.friction->bending[0]}, 2.5 * cm, 0.5 * cm, 1.5 * cm);
  EXPECT_NEAR(bending.slope / units::gf_cm2_per_cm, 0.118, 0.118e-10);
  EXPECT_NEAR(bending.width(1 * cm) / units::gf_cm_per_cm, 0.124, 0.124e-10);
  const KesReading shear =
      read_as_kes({laws.shear, laws.friction->shear}, 8 * deg, 0.5 * deg, 2.5 * deg);
  EXPECT_NEAR(shear.slope / units::gf_per_cm * deg, 0.6, 0.6e-10);
  EXPECT_NEAR(shear.width(0.5 * deg) / units::gf_per_cm, 0.5, 0.5e-10);
  EXPECT_NEAR(shear.width(5 * deg) / units::gf_per_cm, 1.4, 1.4e-10);
}

/// A certificate states one element or more for each curve.
TEST(Memory, StatesNoFrictionOfATestWithoutALoop) {
  const FittedLaws fitted =
      fit_laws(fabric_of("{ g_gf_per_cm_deg = 0.6 }", "{ b_gf_cm2_per_cm = 0.118 }"), 5, {}, true);
  ASSERT_TRUE(fitted.laws.friction);
  EXPECT_TRUE(fitted.laws.friction->shear.empty());
  EXPECT_EQ(fitted.curves.size(), 5U);
  for (const CurveReport& curve : fitted.curves) EXPECT_GE(curve.segments, 1) << curve.name;
}

/// Compares the stack's loop at the points of a curve with half the width and the stated fit error.
void expect_stated_error(const FrictionStack& stack, const HalfWidth& loop,
                         const CurveReport& stated) {
  const double range = loop.x.back();
  double largest = 0, squares = 0;
  for (std::size_t i = 0; i < loop.x.size(); ++i) {
    Specimen up{{}, stack}, down{{}, stack};
    for (const double x : {range, -range}) up.go(x);
    for (const double x : {range, -range, range}) down.go(x);
    const double error = 0.5 * (up.go(loop.x[i]) - down.go(loop.x[i])) - loop.h[i];
    largest = std::max(largest, std::abs(error));
    squares += error * error;
  }
  const double rms = std::sqrt(squares / static_cast<double>(loop.x.size()));
  EXPECT_NEAR(largest, stated.largest_error, 1e-9 * stated.half_hysteresis);
  EXPECT_NEAR(rms, stated.rms_error, 1e-9 * stated.half_hysteresis);
}

/// No measured loop is available: these are the benches' stand-ins, with straight ends.
TEST(Memory, FollowsLoopsFromFilesWithinTheStatedError) {
  for (const char* name : {"A", "B"}) {
    const Fabric fabric =
        read_fabric(test::source_root() / "rigs/bench1/fabrics" / (std::string(name) + ".toml"));
    const auto [laws, curves, warnings] = fit_laws(fabric, 5, {}, true);
    int seen = 0;
    for (const CurveReport& curve : curves) {
      if (!curve.name.starts_with("bending friction")) continue;
      const int d = curve.name.find("warp") != std::string::npos ? 0 : 1;
      expect_stated_error(laws.friction->bending[d], half_width(fabric.bending[d]), curve);
      EXPECT_LT(curve.rms_error, 0.05 * curve.half_hysteresis) << name << ' ' << curve.name;
      ++seen;
    }
    EXPECT_EQ(seen, 2);
  }
}

SlipElement any_element(std::mt19937& lot) {
  std::uniform_real_distribution<double> size(0.1, 2), fraction(-0.9, 0.9);
  const double stiffness = 5 * size(lot);
  return {stiffness, size(lot), fraction(lot) * std::min(1.0, stiffness)};
}

Specimen any_specimen(std::mt19937& lot) {
  FrictionStack stack;
  const int count = std::uniform_int_distribution<int>(1, 5)(lot);
  for (int k = 0; k < count; ++k) stack.elements.push_back(any_element(lot));
  return {{1.0, {}}, stack};
}

TEST(Memory, OneStepIsManyWithoutReversal) {
  std::mt19937 lot(1);
  std::uniform_real_distribution<double> x(-3, 3);
  for (int round = 0; round < 1000; ++round) {
    Specimen once = any_specimen(lot);
    for (int k = 0; k < 4; ++k) once.go(x(lot));
    Specimen often = once;
    const double from = x(lot), to = x(lot);
    once.go(from);
    often.go(from);
    double f = 0;
    for (int k = 1; k <= 37; ++k) f = often.go(from + (to - from) * k / 37);
    EXPECT_NEAR(once.go(to), f, 1e-9);
    EXPECT_NEAR(once.dissipated, often.dissipated, 1e-9 * (1 + often.dissipated));
    EXPECT_GE(once.dissipated, 0);
  }
}

TEST(Memory, ClosesLoopsForgetsReversalsAndDissipatesTheirArea) {
  std::mt19937 lot(2);
  for (int round = 0; round < 1000; ++round) {
    Specimen specimen = any_specimen(lot);
    std::uniform_real_distribution<double> any(-3, 3);
    for (int k = 0; k < 6; ++k) specimen.go(any(lot));
    const double outer = 3, inner = any(lot);
    specimen.go(-outer);
    const double f0 = specimen.go(inner);
    const Specimen unturned = specimen;
    // A loop from `inner` and back closes, and its area equals its dissipation.
    const double turn = -outer + (inner + outer) * 0.3;
    const double before = specimen.dissipated, stored = specimen.stored(inner);
    double area = 0, at = inner, f = f0;
    constexpr int kSteps = 400;
    for (int k = 1; k <= 2 * kSteps; ++k) {
      const double fraction = k <= kSteps ? 1.0 * k / kSteps : 2 - 1.0 * k / kSteps;
      const double x = inner + (turn - inner) * fraction;
      const SlipElement* element = specimen.stack.elements.data();
      // Exact work of the step: potentials of the elastic line and the elements.
      area += specimen.elastic.energy(std::abs(x)) - specimen.elastic.energy(std::abs(at));
      for (std::size_t e = 0; e < specimen.slip.size(); ++e)
        area += element[e].potential(x, specimen.slip[e]) - element[e].stored(at, specimen.slip[e]);
      f = specimen.go(x);
      at = x;
    }
    EXPECT_NEAR(f, f0, 1e-9);
    EXPECT_NEAR(specimen.stored(inner), stored, 1e-9);
    EXPECT_NEAR(specimen.dissipated - before, area, 1e-9 * (1 + area));
    // Beyond the loop the state is as if the loop had not occurred.
    Specimen other = unturned;
    const double x = inner + (outer - inner) * 0.5;
    EXPECT_NEAR(specimen.go(x), other.go(x), 1e-9);
  }
}

/// The work of a loop without using potentials: Gauss's rule with two points between the kinks of
/// the law is exact, and a fine trapezoidal rule needs no kinks.
TEST(Memory, LoopAreaEqualsThatOfTheTrapezoid) {
  Specimen specimen{{2.0, {}}, {{{40, 1, 0.3}, {10, 0.5, 0}, {5, 0, 0.4}}}};
  for (const double x : {2.0, -2.0}) specimen.go(x);
  const double before = specimen.dissipated;
  double area = 0, last = specimen.go(-2);
  constexpr int kSteps = 200000;
  for (int k = 1; k <= 2 * kSteps; ++k) {
    const double x = k <= kSteps ? -2 + 4.0 * k / kSteps : 6 - 4.0 * k / kSteps;
    const double f = specimen.go(x);
    area += 0.5 * (f + last) * (k <= kSteps ? 4.0 : -4.0) / kSteps;
    last = f;
  }
  EXPECT_NEAR(specimen.dissipated - before, area, 1e-9 * area);
}

TEST(Memory, ForceIsThePotentialsSlopeAndTangentTheForces) {
  std::mt19937 lot(3);
  std::uniform_real_distribution<double> any(-3, 3);
  const double h = 1e-6;
  int checked = 0;
  for (int round = 0; round < 3000; ++round) {
    const SlipElement e = any_element(lot);
    const double slip = e.settled(any(lot), any(lot)), x = any(lot);
    EXPECT_NEAR((e.potential(x + h, slip) - e.potential(x - h, slip)) / (2 * h), e.force(x, slip),
                1e-5);
    if (e.tangent(x + h, slip) != e.tangent(x - h, slip)) continue;  // a kink
    EXPECT_NEAR((e.force(x + h, slip) - e.force(x - h, slip)) / (2 * h), e.tangent(x, slip), 1e-5);
    ++checked;
  }
  EXPECT_GT(checked, 2900);
}

}  // namespace
}  // namespace drape::simulate
