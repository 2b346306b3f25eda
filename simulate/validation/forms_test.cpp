// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <Eigen/Sparse>
#include <cmath>

#include "core/files/files.hpp"
#include "simulate/validation/test_exact.hpp"
#include "simulate/validation/test_forms.hpp"
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

// ----
// Closed forms of strips and sheets without contact: cantilevers, loops, struts, chains, buckling,
// order of convergence.

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Bending stiffness (N m) of a strip of given length from its rho g L^3 / B.
double bending_of(double gamma, double length_m = kLength) {
  return kWeight * std::pow(length_m, 3) / gamma;
}

/// A strip clamped horizontally at warp 0.
FormSheet cantilever(double gamma, double spacing_m, double width_m) {
  FormSheet strip({kLength, width_m}, bending_of(gamma), spacing_m);
  strip.clamp_flat(0);
  return strip;
}

/// Its tip relative to the clamp, in units of the length: horizontally, and down.
Vector2d tip_of(const FormRest& rest, double warp_m = kLength) {
  const Vector2d size = rest.drape->print.patch_m;
  const Vector3d tip = rest.place(warp_m, size.y() / 2);
  return Vector2d(size.x() / 2 - tip.y(), -tip.z()) / kLength;
}

/// Up to Gamma 1000: a mesh of 0.2 mm, fine enough for more, stops descending at forces of some
/// hundredths of a point's weight.
TEST(Cantilever, LiesOnTheMasterCurve) {
  for (int k = -4; k <= 4; ++k) {
    const double gamma = std::pow(10.0, 0.5 * k);
    const exact::Cantilever shape = exact::cantilever(gamma);
    // The bend at the clamp is (B / rho g)^(1/3) long; the less the strip reaches out, the more H /
    // W weights the remaining error there.
    const double spacing_m = std::min(1.0 / 40, 1 / (24 * std::cbrt(gamma))) * kLength;
    const FormRest rest =
        rest_of(cantilever(gamma, spacing_m, 2 * spacing_m), [&](double arc_m) -> Vector2d {
          return kLength * (shape.at(arc_m / kLength) - Vector2d(0.5, 0));
        });
    const Vector2d tip = tip_of(rest);
    expect_relative(fmt::format("cantilever H/W, Gamma {:.4g}", gamma), shape.height / shape.width,
                    tip.y() / tip.x(), 1e-3);
    const Vector2d last = tip - tip_of(rest, kLength - spacing_m);
    if (k % 4 == 0)
      expect_relative(fmt::format("cantilever tip angle (rad), Gamma {:.4g}", gamma), shape.tip_rad,
                      std::atan2(last.y(), last.x()), 1e-2);
  }
}

TEST(Cantilever, FallsFromFlatOnToTheCurve) {
  for (const double gamma : {1.0, 10.0, 100.0}) {
    const exact::Cantilever shape = exact::cantilever(gamma);
    FormSheet strip = cantilever(gamma, 1.25e-3, 0.02);
    strip.options.coarsest_m = 5e-3;
    const FormRest flat = start_of(strip);
    const Drape drape = drape_cloth(*flat.drape, strip.options);
    ASSERT_TRUE(drape.at_rest()) << drape.levels.back().rest.why;
    const Vector3d tip = drape.level->places(drape.rest, {{kLength, 0.01}}).row(0).transpose();
    expect_relative(fmt::format("cantilever H/W in levels from flat, Gamma {:g}", gamma),
                    shape.height / shape.width, -tip.z() / (kLength / 2 - tip.y()), 1e-3);
  }
}

/// An operator reads B = rho g L^3 / Gamma at the length whose chord hangs at 41.5 degrees (Peirce
/// 1930): a strip with B must hang between those with 0.1 % more and less.
TEST(Cantilever, OfPeirceGivesBackTheStiffness) {
  constexpr double kPeirce = 8.0042;  // Gamma at that angle
  const Vector2d tip = tip_of(rest_of(cantilever(kPeirce, 2.5e-3, 5e-3)));
  expect_relative("chord of Peirce's cantilever (deg)", 41.5,
                  std::atan2(tip.y(), tip.x()) * 180 / kPi, 1e-3);
  const exact::Cantilever less = exact::cantilever(0.999 * kPeirce),
                          more = exact::cantilever(1.001 * kPeirce);
  EXPECT_GT(tip.y() / tip.x(), less.height / less.width);
  EXPECT_LT(tip.y() / tip.x(), more.height / more.width);
}

/// Clamped upwards from flat: after refinement it must not stay bent back at the clamp.
TEST(Clamp, HoldsTheSideOfTheClothToo) {
  for (const Vector3d& direction : {Vector3d(0, 0, 1), Vector3d(0, 0.6, 0.8)}) {
    FormSheet strip({kLength, 5e-3}, bending_of(2), 2.5e-3);  // Gamma 2: upright or nearly so
    strip.clamp(0, strip.flat_place({0, 2.5e-3}), direction);
    const FormRest rest = rest_of(strip);
    const Vector3d edge = rest.place(2e-3, 2.5e-3) - rest.place(0, 2.5e-3);
    EXPECT_GT(edge.normalized().dot(direction), 0.99) << direction.transpose();
  }
}

/// The clamp divides the cloth: a strip of half the length hangs on each side.
TEST(Clamp, ALineInsideHoldsBothSides) {
  FormSheet both({2 * kLength, 0.01}, bending_of(10), 2.5e-3);
  both.clamp_flat(kLength);
  const FormRest rest = rest_of(both);
  const exact::Cantilever shape = exact::cantilever(10);
  for (const double warp_m : {0.0, 2 * kLength}) {
    const Vector3d tip = rest.place(warp_m, 5e-3) / kLength;
    expect_at_most(fmt::format("tip at warp {:g} m beside the elastica, over its length", warp_m),
                   std::hypot(std::abs(tip.y()) - shape.width, tip.z() + shape.height), 2e-4);
  }
}

/// Mean error of the tip over meshes of the same spacing.
template <class Error>
double order_of(double coarse_m, const Error& error) {
  double sums[2] = {0, 0};
  for (const unsigned seed : {1U, 2U, 3U})
    for (const int k : {0, 1}) sums[k] += error(coarse_m / (1 + k), seed);
  return std::log2(sums[0] / sums[1]);
}

TEST(Order, OfAHeavyStripFromItsClampIsTwo) {
  const exact::Cantilever shape = exact::cantilever(10);
  for (const double coarse_m : {10e-3, 5e-3}) {
    const double order = order_of(coarse_m, [&](double spacing_m, unsigned seed) {
      FormSheet strip = cantilever(10, spacing_m, 0.02);
      strip.laws.tensile[0].slope *= 10;
      strip.options.seed = seed;
      return (tip_of(rest_of(strip)) - Vector2d(shape.width, shape.height)).norm();
    });
    expect_at_least(fmt::format("order of a strip's tip, Gamma 10, from {:g} mm", 1e3 * coarse_m),
                    order, 1.8);
  }
}

/// A square clamped along one hem, under gravity sideways and down: stretch, shear, bending along
/// both threads and twist all contribute. Free corner, averaged over meshes.
TEST(Order, OfABentAndTwistedSheetIsTwo) {
  const auto corner = [](double spacing_m) {
    Vector3d mean = Vector3d::Zero();
    for (const unsigned seed : {1U, 2U, 3U}) {
      FormSheet sheet({0.06, 0.06}, 7.7e-6, spacing_m);
      sheet.laws.tensile[0].slope = sheet.laws.tensile[1].slope = 300;
      sheet.laws.shear.slope = 20;
      sheet.laws.bending[1].slope = 5e-6;
      sheet.laws.twist_n_m = 1.1e-5;
      sheet.scene.gravity_m_per_s2 = {0.5 * kGravity, 0, -0.8 * kGravity};
      sheet.options.seed = seed;
      sheet.clamp_flat(0);
      mean += rest_of(sheet).place(0.06, 0.06) / 3;
    }
    return mean;
  };
  const Vector3d corners[3] = {corner(5e-3), corner(2.5e-3), corner(1.25e-3)};
  expect_at_least("self-convergence order of a bent and twisted sheet, 5 to 1.25 mm",
                  std::log2((corners[0] - corners[1]).norm() / (corners[1] - corners[2]).norm()),
                  1.8);
}

/// Both ends clamped upright at one point. A lighter loop would leave its plane on the way from the
/// start.
TEST(Loop, HangsAsTheHeartLoop) {
  constexpr double kLoop = 0.12, kSpacing = kLoop / 96;
  constexpr int kSteps = 4000;
  // From up (90 degrees) over the right shoulder to the lowest point and up the left one.
  std::vector<Vector2d> curve = {Vector2d::Zero()};
  for (int k = 0; k < kSteps; ++k) {
    const double s = (k + 0.5) / kSteps;
    const double angle = 0.5 * kPi - 3 * kPi * s - 0.67 * std::sin(2 * kPi * s);
    curve.emplace_back(curve.back() + kLoop / kSteps * Vector2d(std::cos(angle), std::sin(angle)));
  }
  for (const double gamma : {100.0, 390.0}) {
    FormSheet strip({kLoop, 2 * kSpacing}, bending_of(gamma, kLoop), kSpacing);
    for (const double end_m : {0.0, kLoop}) strip.clamp(end_m, Vector3d::Zero(), Vector3d::UnitZ());
    const FormRest rest =
        rest_of(strip, [&](double arc_m) { return curve[std::lround(arc_m / kLoop * kSteps)]; });
    expect_relative(fmt::format("heart loop height over length, Gamma {:g}", gamma),
                    exact::heart_loop_height(gamma), -rest.place(kLoop / 2, kSpacing).z() / kLoop,
                    2e-3);
  }
}

/// A strut with hinged ends and negligible weight, compressed to a given chord.
TEST(Strut, BearsTheLoadOfTheElastica) {
  constexpr double kBending = 1e-3, kSpacing = kLength / 64, kLight = 5e-3;
  constexpr double kEuler = kPi * kPi * kBending / (kLength * kLength);
  for (const double degrees : {20.0, 60.0, 100.0}) {
    const double alpha = degrees * kPi / 180, k = std::sin(alpha / 2);
    const exact::Elastica strut = exact::elastica(alpha);
    const double rise = k / std::comp_ellint_1(k), chord_m = strut.chord * kLength;
    FormSheet strip({kLength, kSpacing}, kBending, kSpacing);
    strip.laws.tensile[0].slope = strip.laws.tensile[1].slope = 2e4 * kEuler;
    strip.scene.gravity_m_per_s2 *= kLight;
    strip.options.descent.residual = 1e-3;
    strip.pin_ends(0, Vector3d::Zero());
    strip.pin_ends(kLength, -chord_m * FormSheet::kY);
    const FormRest rest = rest_of(strip, [&](double arc_m) -> Vector2d {
      const double part = arc_m / kLength;
      return {chord_m * part, rise * kLength * std::sin(kPi * part)};
    });
    expect_relative(fmt::format("strut load over Euler's, end slope {:g} deg", degrees), strut.load,
                    rest.reaction_n(kLength).y() / kSpacing / kEuler, 2e-3);
    expect_relative(fmt::format("strut's rise over its length, end slope {:g} deg", degrees), rise,
                    rest.place(kLength / 2, kSpacing / 2).z() / kLength, 2e-3);
  }
}

TEST(Chain, SagsAsTheCatenary) {
  constexpr double kChain = 0.2, kSpacing = kChain / 64;
  for (const double chord : {0.5, 0.775, 0.9}) {
    const double sag = exact::catenary_sag(chord);
    FormSheet strip({kChain, kSpacing}, 1e-8, kSpacing);
    strip.laws.tensile[0].slope = strip.laws.tensile[1].slope = 1e4 * kWeight * kChain;
    strip.laws.twist_n_m = 1e-5;  // a chain has no twist
    strip.pin_ends(0, Vector3d::Zero());
    strip.pin_ends(kChain, -chord * kChain * FormSheet::kY);
    // A parabola of about the right sag; its arc length need not match.
    const FormRest rest = rest_of(strip, [&](double arc_m) -> Vector2d {
      const double t = 2 * arc_m / kChain - 1;
      return kChain * Vector2d(0.5 * chord * (t + 1), sag * (t * t - 1));
    });
    expect_relative(fmt::format("catenary sag over length, chord {:g}", chord), sag,
                    -rest.place(kChain / 2, kSpacing / 2).z() / kChain, 1e-3);
  }
}

TEST(Strip, StretchesByItsWeight) {
  constexpr double kStrip = 0.2, kTensile = 400;
  FormSheet strip({kStrip, 0.03}, 1e-5, 5e-3);
  strip.laws.tensile[0].slope = strip.laws.tensile[1].slope = kTensile;
  strip.scene.gravity_m_per_s2 = {0, -kGravity, 0};
  strip.clamp_flat(0);
  const FormRest rest = rest_of(strip);
  expect_relative("hanging strip: drop of its end (m)", kWeight * kStrip * kStrip / (2 * kTensile),
                  -kStrip / 2 - rest.place(kStrip, 0.015).y(), 2e-3);
}

/// Load in its plane at which a flat sheet buckles, relative to the applied one: sideways stiffness
/// is K0 + (load / applied)(K - K0), singular at buckling, with K that of the sheet displaced in
/// its plane by the load. Stiffnesses by differences of forces, which are odd about flat.
double buckling_load(const FormSheet& sheet) {
  using Matrix = Eigen::SparseMatrix<double>;
  const FormRest rest = start_of(sheet);
  const MeshCloth& cloth = rest.level->cloth();
  using Coordinates = std::vector<std::pair<int, int>>;  // unknown, axis
  Coordinates in_plane, sideways;
  for (int i = 0; i < cloth.unknowns(); ++i) {
    if (rest.level->held()[i]) continue;
    sideways.emplace_back(i, 2);
    for (const int axis : {0, 1}) in_plane.emplace_back(i, axis);
  }
  const auto stiffness = [&](const MeshCloth::State& state, const Coordinates& coordinates) {
    constexpr double kStep_m = 1e-8, kRounded = 1e-8;
    const int n = static_cast<int>(coordinates.size());
    std::vector<Eigen::Triplet<double>> entries;
    for (int col = 0; col < n; ++col) {
      const auto [unknown, axis] = coordinates[col];
      const double step = unknown < cloth.points() ? kStep_m : kStep_m / sheet.options.spacing_m;
      MeshCloth::State moved = state, force(state.size(), Vector3d::Zero());
      moved[unknown][axis] += step;
      cloth.add_forces(moved, force);
      double most = 0;
      for (const Vector3d& f : force) most = std::max(most, f.cwiseAbs().maxCoeff());
      for (int row = 0; row < n; ++row)
        if (const double f = force[coordinates[row].first][coordinates[row].second];
            std::abs(f) > kRounded * most)
          entries.emplace_back(row, col, -f / step);
    }
    Matrix k(n, n);
    k.setFromTriplets(entries.begin(), entries.end());
    return Matrix((k + Matrix(k.transpose())) / 2);
  };
  const MeshCloth::State& flat = rest.moment.state;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(std::ssize(in_plane));
  for (std::size_t k = 0; k < in_plane.size(); ++k)
    if (const auto [unknown, axis] = in_plane[k]; unknown < cloth.points())
      load[static_cast<Eigen::Index>(k)] =
          cloth.mass_kg()[unknown] * sheet.scene.gravity_m_per_s2[axis];
  const Eigen::SimplicialLDLT<Matrix> plane(stiffness(flat, in_plane));
  const Eigen::VectorXd moves = plane.solve(load);
  MeshCloth::State loaded = flat;
  for (std::size_t k = 0; k < in_plane.size(); ++k)
    loaded[in_plane[k].first][in_plane[k].second] += moves[static_cast<Eigen::Index>(k)];
  const Matrix unloaded = stiffness(flat, sideways),
               of_load = stiffness(loaded, sideways) - unloaded;
  double low = 0, high = 50;
  for (int i = 0; i < 20; ++i) {
    const double middle = (low + high) / 2;
    // Sylvester's law of inertia: as many negative pivots as buckling directions.
    const Eigen::SimplicialLDLT<Matrix> factor(unloaded + middle * of_load);
    ((factor.vectorD().array() < 0).any() ? high : low) = middle;
  }
  return (low + high) / 2;
}

/// A strip upright on its clamp: gravity in its plane, towards the clamp.
TEST(Buckling, OfAnUprightStripUnderItsWeight) {
  constexpr double kGamma = 1;
  FormSheet strip = cantilever(kGamma, kLength / 40, kLength / 20);
  strip.laws.tensile[0].slope = strip.laws.tensile[1].slope = 1e7 * bending_of(kGamma) / 0.01;
  strip.scene.gravity_m_per_s2 = {0, kGravity, 0};
  expect_relative("self-buckling Gamma of an upright strip", exact::kSelfBuckling,
                  kGamma * buckling_load(strip), 5e-3);
}

// ----
// Elastic stick-slip (Romero et al. 2021): a strip clamped above the table and pressed onto it.

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
