// SPDX-License-Identifier: Apache-2.0
// Elastic stick-slip (Romero et al. 2021): a strip clamped above the table and pressed onto it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/validation/test_exact.hpp"
#include "simulate/validation/test_forms.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kGamma = 20, kStrip = 0.25, kSpacing = kStrip / 50;  // m

/// The strip over a table with friction, approximately at rest.
FormRest pressed(const exact::PressedStrip& strip, double friction) {
  FormSheet sheet({kStrip, 2 * kSpacing}, kWeight * std::pow(kStrip, 3) / kGamma, kSpacing);
  sheet.laws.tensile[0].slope = sheet.laws.tensile[1].slope = 1e4 * kWeight * kStrip;
  const double height_m = kStrip * strip.at(1).drop;
  sheet.scene.table_z_m = 0;
  sheet.scene.friction = friction;
  sheet.options.descent.residual = 1e-3;
  sheet.clamp(0, {0, 0, height_m}, {0, 0, -1});
  return start_of(sheet, [&](double arc_m) -> Vector2d {
    const exact::PressedStrip::Place place = strip.at(arc_m / kStrip);
    return {kStrip * place.sideways, height_m - kStrip * place.drop};
  });
}

struct Stood {
  bool rests = false;
  double slipped = 0;  ///< of the tip, relative to the length
  double ratio = 0;    ///< tangential force of the table relative to its normal force
};

Stood stood(const exact::PressedStrip& strip, double friction) {
  FormRest rest = pressed(strip, friction);
  // Held at first; otherwise the tip slips until the table's normal force has grown.
  constexpr double kHeld = 10;
  rest.level->set_friction(kHeld);
  EXPECT_TRUE(rest.level->fall(rest.moment).at_rest);
  rest.level->set_friction(friction);
  const Vector3d before = rest.place(kStrip, kSpacing);
  const RestReport report = rest.level->fall(rest.moment);
  Stood found{report.at_rest, (rest.place(kStrip, kSpacing) - before).norm() / kStrip, 0};
  Vector3d sum = Vector3d::Zero();
  for (const ContactForce& force : rest.level->contact_forces(rest.moment))
    sum += force.force_in_world;
  found.ratio = sum.head<2>().norm() / sum.z();
  fmt::print("  friction {:.4f}: {}, tip moved by {:.2g} L, forces {:.4f}\n", friction,
             report.at_rest ? "rests" : report.why, found.slipped, found.ratio);
  return found;
}

TEST(StickSlip, OfAPressedStripIsCoulombs) {
  constexpr double kGoal = 1e-2, kFar = 1e-2;
  for (const double lowered : {0.05, 0.1, 0.2}) {
    const exact::PressedStrip strip = exact::pressed_strip(kGamma, 1e-4 / kGamma, lowered);
    const Stood held = stood(strip, 1.2 * strip.friction());
    EXPECT_TRUE(held.rests);
    expect_relative(fmt::format("strip pressed down by {:g} L: T/N", lowered), strip.friction(),
                    held.ratio, kGoal);
    const Stood more = stood(strip, (1 + kGoal) * strip.friction());
    EXPECT_TRUE(more.rests && more.slipped < kFar);
    // The farther a tip slips, the more friction it needs, so it does not stop nearby.
    const Stood less = stood(strip, (1 - kGoal) * strip.friction());
    EXPECT_TRUE(!less.rests || less.slipped > kFar);
  }
}

/// Gravity is tilted instead of the table.
TEST(StickSlip, OfASheetOnASlopeIsCoulombs) {
  constexpr double kFriction = 0.4, kMargin = 5e-3;
  for (const double part : {1 - kMargin, 1 + kMargin}) {
    FormSheet sheet({0.04, 0.04}, 1e-4, 5e-3);
    sheet.scene.table_z_m = 0;
    sheet.scene.friction = kFriction;
    sheet.options.descent.residual = 1e-3;
    sheet.options.descent.most_steps = 300;  // sliding does not stop
    sheet.options.motion.longest_s = 2;
    FormRest rest = start_of(sheet);
    ASSERT_TRUE(rest.level->fall(rest.moment).at_rest);
    const double angle = std::atan(part * kFriction);
    rest.level->set_gravity(kGravity * Vector3d(std::sin(angle), 0, -std::cos(angle)));
    const Vector3d before = rest.place(0.02, 0.02);
    const RestReport report = rest.level->fall(rest.moment);
    const double slid_m = (rest.place(0.02, 0.02) - before).norm();
    fmt::print("slope of {:g} of the friction: {}, slid by {:.2g} mm\n", part,
               report.at_rest ? "rests" : report.why, 1e3 * slid_m);
    if (part < 1) {
      EXPECT_TRUE(report.at_rest) << report.why;
      EXPECT_LT(slid_m, 1e-4);
    } else {
      EXPECT_TRUE(!report.at_rest || slid_m > 1e-3);
    }
  }
}

}  // namespace
}  // namespace drape::simulate
