// SPDX-License-Identifier: Apache-2.0
// Strips with internal friction against closed form and boundary-value problem.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/equilibrium/run.hpp"
#include "simulate/start/history.hpp"
#include "simulate/start/local_frame.hpp"

namespace drape::simulate {
namespace {

/// Cotton broad of Matsudaira et al. 2015: B, 2HB and density.
constexpr double kStiffness = 0.118 * units::gf_cm2_per_cm;          // N m
constexpr double kFrictionMoment = 0.124 / 2 * units::gf_cm_per_cm;  // N
constexpr double kSlipCurvature = 0.1 * units::per_cm;               // 1/m
constexpr double kDensity = 0.1238;                                  // kg/m2
constexpr double kGravity = 9.80665;                                 // m/s2

FrictionStack stack_of(double friction_moment) {
  return {{{friction_moment / kSlipCurvature, friction_moment, 0}}};
}

ClothLaws cotton(double length, double friction_moment) {
  ClothLaws laws;
  laws.density_kg_per_m2 = kDensity;
  laws.tensile[0] = laws.tensile[1] = {3e4 * kDensity * kGravity * length, {}};
  laws.shear = {1, {}};
  laws.bending[0] = laws.bending[1] = {kStiffness, {}};
  laws.twist_n_m = 2 * kStiffness;
  laws.friction = ClothFriction{{stack_of(friction_moment), stack_of(friction_moment)}, {}};
  return laws;
}

/// Goes to rest with the first two rows held; how it ends.
StaticStatus settle_down(Cloth& cloth, const Eigen::Vector3d& gravity, Field& x,
                         double tolerance = 1e-5) {
  StaticOptions options;
  options.gravity_m_per_s2 = gravity;
  options.residual_tolerance = tolerance;
  options.first_step_s = 0.1;
  options.judge_stability = false;
  const Surroundings nothing;
  StaticSolver solver(cloth, nothing, options);
  std::vector<Hold> holds;
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < 2 * cloth.grid().cols; ++i) {
    holds.push_back({{i, i, i, i}, {1, 0, 0, 0}});
    places.push_back(at(x, i));
  }
  solver.contacts().hold(holds, places);
  solver.position = x;
  const StaticReport report = solver.solve();
  x = solver.position;
  return report.status;
}

/// Mean turn per length over the free rows (1/m), from the angles between the grid's edges.
double mean_curvature(const GridSpec& grid, const Field& x) {
  double turned = 0;
  for (int r = 1; r + 1 < grid.rows; ++r) {
    const Eigen::Vector3d before = at(x, grid.index(r, 0)) - at(x, grid.index(r - 1, 0));
    const Eigen::Vector3d after = at(x, grid.index(r + 1, 0)) - at(x, grid.index(r, 0));
    turned += std::atan2(before.cross(after).norm(), before.dot(after));
  }
  return turned / ((grid.rows - 2) * grid.warp_spacing_m());
}

/// Rolled to `curvature`, let go without gravity, and what curvature is left.
double left_of(double curvature, double friction_moment) {
  const int rows = 41;
  const double spacing = 1e-3;
  const GridSpec grid{rows, 2, {spacing * (rows - 1), spacing}};
  Cloth cloth(grid, cotton(grid.patch_m.x(), friction_moment), MassRule::area);
  Field x(3 * static_cast<std::size_t>(grid.count()));
  const double turn = 2 * std::asin(0.5 * curvature * spacing);  // so that the edges keep length
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < 2; ++c) put_at(x, grid.index(r, c), p + Eigen::Vector3d(0, c * spacing, 0));
    p += spacing * Eigen::Vector3d(std::cos(turn * r), 0, -std::sin(turn * r));
  }
  cloth.settle(x);
  // Residuals are counted in weights: a little gravity, across the strip, bends nothing.
  EXPECT_EQ(settle_down(cloth, {0, 1e-4 * kGravity, 0}, x, 1e-3), StaticStatus::at_rest);
  return mean_curvature(grid, x);
}

TEST(MemoryStrip, ReleasedStripKeepsItsResidualCurvature) {
  for (const double share : {1.0, 0.5}) {
    const double moment = share * kFrictionMoment;
    const double exact = moment / kStiffness;  // 2HB / (2 B)
    for (const double sign : {1.0, -1.0})
      EXPECT_NEAR(left_of(sign * 1.5 * units::per_cm, moment), exact, 1e-3 * exact);
  }
}

/// A heavy inextensible strip with the same law, clamped horizontally: theta' = curvature(M),
/// M' = -w (L - s) cos theta, theta(0) = 0, M(L) = 0, by shooting with Heun's rule; every place
/// remembers its slip from load to load.
class HeavyStrip {
 public:
  explicit HeavyStrip(double length) : length_(length), slip_(kPieces + 1, 0.0) {}

  void load(double weight_n_per_m2) {
    weight_ = weight_n_per_m2;
    double low = -1, high = 1;  // N, of the moment at the clamp
    for (int k = 0; k < 100; ++k) {
      const double middle = 0.5 * (low + high);
      (shoot(middle) > 0 ? high : low) = middle;
    }
    (void)shoot(low);
    for (int j = 0; j <= kPieces; ++j) slip_[j] = element_.settled(curvature_[j], slip_[j]);
  }
  double x = 0, z = 0;  ///< of the tip

 private:
  static constexpr int kPieces = 2000;

  /// The curvature at which the law gives a moment; the law rises everywhere.
  [[nodiscard]] double curvature_of(double moment, double slip) const {
    const double sticking =
        (moment + element_.stiffness * slip) / (kStiffness + element_.stiffness);
    const double pull = element_.stiffness * (sticking - slip);
    if (std::abs(pull) <= element_.threshold) return sticking;
    return (moment - std::copysign(element_.threshold, pull)) / kStiffness;
  }
  /// The moment at the tip.
  double shoot(double root_moment) {
    const double h = length_ / kPieces;
    double theta = 0, moment = root_moment;
    x = z = 0;
    curvature_.assign(kPieces + 1, 0.0);
    for (int j = 0; j <= kPieces; ++j) {
      curvature_[j] = curvature_of(moment, slip_[j]);
      if (j == kPieces) break;
      const double fall = -weight_ * (length_ - j * h) * std::cos(theta);
      const double ahead = theta + h * curvature_[j];
      const double fall_ahead = -weight_ * (length_ - (j + 1) * h) * std::cos(ahead);
      const double next =
          theta + 0.5 * h * (curvature_[j] + curvature_of(moment + h * fall, slip_[j + 1]));
      moment += 0.5 * h * (fall + fall_ahead);
      x += 0.5 * h * (std::cos(theta) + std::cos(next));
      z -= 0.5 * h * (std::sin(theta) + std::sin(next));
      theta = next;
    }
    return moment;
  }

  double length_, weight_ = 0;
  SlipElement element_ = stack_of(kFrictionMoment).elements.front();
  std::vector<double> slip_, curvature_;
};

TEST(MemoryStrip, HeavyCantileverLoadedAndUnloaded) {
  constexpr double kLength = 0.08;
  constexpr int kRows = 162, kSteps = 10;
  const double spacing = kLength / (kRows - 1.5);  // the clamp is half a cell before row 1
  const GridSpec grid{kRows, 2, {spacing * (kRows - 1), spacing}};
  Cloth cloth(grid, cotton(kLength, kFrictionMoment), MassRule::area);
  Field x(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i)
    put_at(x, i, Eigen::Vector3d(i / 2 * spacing, i % 2 * spacing, 0));
  HeavyStrip exact(kLength);
  std::vector<double> loads;
  for (int k = 1; k <= kSteps; ++k) loads.push_back(1.0 * k / kSteps);
  for (int k = kSteps - 1; k >= 1; --k) loads.push_back(1.0 * k / kSteps);
  double loaded_height = 0;
  for (std::size_t k = 0; k < loads.size(); ++k) {
    const double gravity = loads[k] * kGravity;
    ASSERT_EQ(settle_down(cloth, {0, 0, -gravity}, x), StaticStatus::at_rest) << loads[k];
    exact.load(kDensity * gravity);
    const Eigen::Vector3d tip = at(x, grid.index(kRows - 1, 0));
    const double width = tip.x() - 0.5 * spacing, height = -tip.z();
    EXPECT_NEAR(height, -exact.z, 3e-3 * -exact.z) << loads[k];
    EXPECT_NEAR(width, exact.x, 3e-3 * exact.x) << loads[k];
    if (k + 1 == kSteps) loaded_height = height;
  }
  // What friction holds: unloaded to a tenth, an elastic strip would hang far higher.
  EXPECT_GT(-exact.z, 0.5 * loaded_height);
  EXPECT_GT(cloth.dissipated_j(), 0);
}

/// A strip of `rows` x 2 particles at that spacing, clamped in its first two rows, drapes from flat
/// after a history.
StaticDrape clamped_strip(const std::vector<std::string>& history, double gravity, bool across,
                          int rows, double spacing, double tolerance) {
  Scene scene;
  scene.file = "strip.toml";
  scene.gravity_m_per_s2 =
      across ? Eigen::Vector3d(gravity, 0, 0) : Eigen::Vector3d(0, 0, -gravity);
  Print print;
  print.rows = print.cols = 2;
  print.patch_m = {spacing * (rows - 1), spacing};
  print.margin_m.setZero();
  scene.start = {StartMode::flat, 0, Eigen::Vector3d(0, 0, 0), 0, history};
  StartReport ignored;
  const FlatPose flat = flat_start(scene, std::nullopt, 0, ignored);
  for (const double u : {0.0, spacing})
    for (const double v : {0.0, spacing})
      scene.pins.push_back({{}, flat.point_in_world({u, v}, print.patch_m), Eigen::Vector2d(u, v)});
  const GridSpec grid{rows, 2, print.patch_m};
  const Surroundings nothing;
  const ClothLaws laws = cotton(print.patch_m.x(), kFrictionMoment);
  const std::optional<Sheet> unmeasured;
  StaticOptions options;
  options.gravity_m_per_s2 = scene.gravity_m_per_s2;
  options.residual_tolerance = tolerance;
  options.first_step_s = 0.1;
  return drape_statically({scene, print, unmeasured, nothing, laws}, grid, options);
}

/// Signed by the side of the printed face that the free end stands on.
double curl_of(const std::vector<std::string>& history) {
  constexpr int kRows = 41;
  constexpr double kSpacing = 1e-3;
  const StaticDrape drape = clamped_strip(history, 1e-4 * kGravity, true, kRows, kSpacing, 1e-3);
  EXPECT_EQ(drape.report.status, StaticStatus::at_rest);
  const double size =
      mean_curvature({kRows, 2, {kSpacing * (kRows - 1), kSpacing}}, drape.position);
  return std::copysign(size, at(drape.position, 2 * kRows - 1).z());
}

/// Laid flat, its elements are at their limit: they and the elastic curve share what is left.
TEST(History, AStripThatWasBentAndLaidFlatKeepsWhatItsElementsHold) {
  const double exact = kFrictionMoment / (kStiffness + kFrictionMoment / kSlipCurvature);
  EXPECT_NEAR(curl_of({"bent 1.5 per cm along warp"}), exact, 1e-3 * exact);
  EXPECT_NEAR(curl_of({"bent -1.5 per cm along warp"}), -exact, 1e-3 * exact);
  EXPECT_NEAR(curl_of({"bent 1.5 per cm along warp", "bent -2 per cm along warp"}), -exact,
              1e-3 * exact);
  EXPECT_NEAR(curl_of({"bent 1.5 per cm along warp", "flat"}), 0, 1e-3 * exact);
  EXPECT_NEAR(curl_of({"bent 1.5 per cm along weft"}), 0, 1e-3 * exact);
}

/// Loops close, so a strip that was laid flat comes back to where it hung; shaken, it sags to where
/// the law's boundary-value problem has it after the same loads.
TEST(History, ADrapedStripComesBackAndAShakenOneSags) {
  constexpr double kLength = 0.08;
  constexpr int kRows = 162;
  const double spacing = kLength / (kRows - 1.5);
  const auto height_after = [&](const std::vector<std::string>& history) {
    const StaticDrape drape = clamped_strip(history, kGravity, false, kRows, spacing, 1e-5);
    EXPECT_EQ(drape.report.status, StaticStatus::at_rest);
    return -at(drape.position, 2 * kRows - 1).z();
  };
  HeavyStrip exact(kLength);
  exact.load(kDensity * kGravity);
  const double fresh = -exact.z;
  for (const double load : {1.5, 0.5, 1.5, 0.5, 1.0}) exact.load(load * kDensity * kGravity);
  const double shaken = -exact.z;
  EXPECT_GT(shaken, 1.02 * fresh);
  EXPECT_NEAR(height_after({}), fresh, 3e-3 * fresh);
  EXPECT_NEAR(height_after({"draped 1 times"}), fresh, 3e-3 * fresh);
  EXPECT_NEAR(height_after({"draped 1 times", "shaken 2 times"}), shaken, 3e-3 * shaken);
}

TEST(History, WhatIsNoEventIsRefusedWithFileAndField) {
  Scene scene;
  scene.file = "scenes/C.toml";
  for (const char* text : {"",
                           "folded",
                           "bent",
                           "bent 1.5",
                           "bent 1.5 per mm along warp",
                           "bent x per cm along warp",
                           "bent nan per cm along warp",
                           "bent 0 per cm along warp",
                           "bent 21 per cm along warp",
                           "bent 1e999 per cm along weft",
                           "bent 1.5 per cm along bias",
                           "draped",
                           "draped 0 times",
                           "draped -1 times",
                           "draped 1.5 times",
                           "draped 51 times",
                           "draped 1e9 times",
                           "shaken 3 times by 0 %",
                           "shaken 3 times by 96 %",
                           "shaken 3 times by -5 %",
                           "shaken 3 times by 40",
                           "flat flat",
                           "Flat"}) {
    scene.start.history = {"flat", text};
    try {
      static_cast<void>(history_of(scene));
      ADD_FAILURE() << "`" << text << "` is taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.where().file, "scenes/C.toml");
      EXPECT_EQ(error.where().field, "start.history");
      EXPECT_THAT(error.what(), ::testing::HasSubstr(text));
    }
  }
  scene.start.history = {"shaken 3 times", "flat"};
  EXPECT_THROW(static_cast<void>(history_of(scene)), Error) << "shaken before something else";
  scene.start.history = {"flat", "bent -0.5 per cm along weft", "draped 3 times",
                         "shaken 5 times by 40 %"};
  const std::vector<PastEvent> events = history_of(scene);
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[1].direction, 1);
  EXPECT_DOUBLE_EQ(events[1].curvature_per_m, -50);
  EXPECT_EQ(events[2].times, 3);
  EXPECT_EQ(shakes_of(events).times, 5);
  EXPECT_DOUBLE_EQ(shakes_of(events).part, 0.4);
}

/// A sheet pinned at two corners falls by Runge-Kutta, undamped: what it loses is what friction
/// took.
TEST(MemoryStrip, EnergyOfAFallBalances) {
  const GridSpec grid{9, 9, {0.08, 0.08}};
  ClothLaws laws = cotton(0.08, kFrictionMoment);
  laws.tensile[0] = laws.tensile[1] = {200, {}};
  laws.friction->shear = {{{20, 0.1, 1}}};
  laws.shear = {10, {}};
  Cloth cloth(grid, laws, MassRule::area);
  const Surroundings nothing;
  Motion motion(cloth, nothing, {});
  for (int i = 0; i < grid.count(); ++i)
    put_at(motion.position, i,
           Eigen::Vector3d(i / 9 * 0.01, i % 9 * 0.01, 1e-4 * std::sin(7.0 * i)));
  motion.hold({{{0, 0, 0, 0}, {1, 0, 0, 0}}, {{8, 8, 8, 8}, {1, 0, 0, 0}}});
  const auto energy = [&] {
    return motion.kinetic_energy_j() + motion.gravity_energy_j() +
           cloth.energies(motion.position).sum_j();
  };
  const double before = energy();
  double time_s = 0;
  while (time_s < 0.25) {
    time_s += motion.step(motion.stable_step_s(0.3));
  }
  EXPECT_GT(cloth.dissipated_j(), 0);
  EXPECT_NEAR(before - energy(), cloth.dissipated_j(), 1e-3 * cloth.dissipated_j());
}

}  // namespace
}  // namespace drape::simulate
