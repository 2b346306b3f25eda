// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "core/files/files.hpp"
#include "simulate/validation/test_exact.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

TEST(Exact, CantileverIsTheReferenceCurve) {
  const std::filesystem::path folder = drape::test::test_data("physics");
  const Csv curve =
      read_csv(folder / "cantilever_master_curve.csv",
               {"Gamma", "W_over_L", "H_over_L", "H_over_W", "theta_tip_rad", "M_clamp_L_over_B"});
  for (std::size_t i = 0; i < curve.lines.size(); i += 12) {
    const exact::Cantilever shape = exact::cantilever(curve.columns[0][i]);
    EXPECT_NEAR(shape.height / shape.width / curve.columns[3][i], 1, 1e-6);
    EXPECT_NEAR(shape.tip_rad, curve.columns[4][i], 1e-6);
  }
  EXPECT_NEAR(exact::cantilever_at_chord_angle(41.5 * 3.14159265358979 / 180).gamma, 8.0042, 1e-4);
}

TEST(Exact, LoopChainAndStrutAreTheReferenceCurves) {
  const std::filesystem::path folder = drape::test::test_data("physics");
  const Csv heart = read_csv(
      folder / "heart_loop_curve.csv",
      {"Gamma=rho*g*L^3/B", "height_over_L", "P_L2_over_B", "top_rise_over_L", "width_over_L"});
  for (std::size_t i = 0; i < heart.lines.size(); i += 10)
    EXPECT_NEAR(exact::heart_loop_height(heart.columns[0][i]), heart.columns[1][i], 1e-7);
  const Csv chain = read_csv(folder / "catenary_sag.csv", {"chord_over_length", "sag_over_length",
                                                           "a_over_length", "H_over_(w*L)"});
  for (std::size_t i = 0; i < chain.lines.size(); ++i)
    EXPECT_NEAR(exact::catenary_sag(chain.columns[0][i]), chain.columns[1][i], 1e-8);
  const Csv strut =
      read_csv(folder / "euler_elastica.csv",
               {"alpha_deg", "P_over_Pc", "end_distance_over_L", "mid_deflection_over_L"});
  for (std::size_t i = 0; i < strut.lines.size(); ++i) {
    const exact::Elastica found = exact::elastica(strut.columns[0][i] * 3.14159265358979 / 180);
    EXPECT_NEAR(found.load, strut.columns[1][i], 1e-8);
    EXPECT_NEAR(found.chord, strut.columns[2][i], 1e-8);
  }
}

TEST(Exact, PressedStripIsInEquilibrium) {
  // Hardly lowered: Euler's load of a strut clamped at one end and pinned at the other, tan(k) = k.
  const exact::PressedStrip straight = exact::pressed_strip(0, 0, 1e-4);
  EXPECT_NEAR(straight.normal, 20.1907, 1e-2);
  EXPECT_NEAR(straight.tangential / straight.curvature, 1, 1e-3);
  const exact::PressedStrip strip = exact::pressed_strip(20, 5e-6, 0.2);
  EXPECT_NEAR(strip.at(1).sideways, 0, 1e-9);
  EXPECT_NEAR(strip.at(1).drop, 0.8, 1e-9);
  // Moments about the clamp: force of the table times the drop, weights times their positions.
  double moment = strip.tangential * strip.at(1).drop;
  constexpr int kPieces = 1000;
  for (int i = 0; i < kPieces; ++i)
    moment -= strip.gamma / kPieces * strip.at((i + 0.5) / kPieces).sideways;
  EXPECT_NEAR(strip.curvature, moment, 1e-4 * strip.curvature);
}

}  // namespace
}  // namespace drape::simulate
