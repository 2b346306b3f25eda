// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/pair_contacts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "simulate/cloth/test_grid.hpp"
#include "simulate/contact/piercing.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/dynamics/motion.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kGravity = 9.80665;
constexpr double kThickness = 0.5e-3;

ClothLaws stiff_cotton(double bending_n_m = 7.7e-6) {
  ClothLaws laws = linear_laws(0.138, 2000, 30, bending_n_m);
  laws.stretch_damping_s = 1e-5;
  return laws;
}

/// Flat around the origin at height z, thrown down at `speed`.
void throw_down(const GridSpec& grid, double z, double speed, Motion& motion) {
  for (int i = 0; i < grid.count(); ++i) {
    put_at(motion.position, i,
           {int{i / grid.cols} * grid.warp_spacing_m() - 0.5 * grid.patch_m.x(),
            (i % grid.cols) * grid.weft_spacing_m() - 0.5 * grid.patch_m.y(), z});
    put_at(motion.velocity, i, {0, 0, -speed});
  }
}

/// A solid below z = 0 that comes up to a point (0, 0, 0) or, with `length_m`, to an edge along y.
Surroundings blade(double length_m) {
  const double w = 1e-3, depth = 0.04, y = 0.5 * length_m;
  std::vector<Vector3d> corners = {{-w, -y - w, -depth},
                                   {w, -y - w, -depth},
                                   {w, y + w, -depth},
                                   {-w, y + w, -depth},
                                   {0, -y, 0}};
  std::vector<ClosedMesh::Triangle> faces = {{0, 2, 1}, {0, 3, 2}};
  if (length_m > 0) {
    corners.emplace_back(0, y, 0);
    faces.insert(faces.end(), {{0, 1, 4}, {1, 2, 5}, {1, 5, 4}, {2, 3, 5}, {3, 0, 4}, {3, 4, 5}});
  } else {
    faces.insert(faces.end(), {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}});
  }
  Surroundings solids;
  solids.add(PlacedMesh{std::make_shared<const ClosedMesh>(corners, faces, "blade"), {}});
  return solids;
}

/// True if the segment from a to b goes through the sheet.
bool pierced(const GridSpec& grid, const Field& x, const Vector3d& a, const Vector3d& b) {
  const auto through = [&](int i, int j, int k) {
    const Vector3d p = at(x, i), u = at(x, j) - p, v = at(x, k) - p, span = b - a;
    const Vector3d cross = u.cross(v);
    const double det = -span.dot(cross);
    if (det == 0) return false;
    const Vector3d w = a - p;
    const double t = w.dot(cross) / det;
    const double s = -span.cross(w).dot(v) / det, r = span.cross(w).dot(u) / det;
    return t >= 0 && t <= 1 && s >= 0 && r >= 0 && s + r <= 1;
  };
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.cols; ++c) {
      const int i = grid.index(r, c);
      if (through(i, i + 1, i + grid.cols) || through(i + 1, i + grid.cols + 1, i + grid.cols))
        return true;
    }
  }
  return false;
}

/// Drops a sheet whose particles all pass the blade; how often the blade, from `depth_m` below its
/// edge or point on, was seen to pass through the sheet.
int drop(const Surroundings& solid, double length_m, bool contact, double speed,
         double depth_m = 0.1e-3) {
  const GridSpec grid{4, 4, {0.03, 0.03}};
  Cloth cloth(grid, stiff_cotton(), MassRule::area);
  Motion motion(cloth, solid, {{0, 0, -kGravity}, 20, 0, 0.5, contact});
  throw_down(grid, 2e-3, speed, motion);
  int through = 0;
  for (double time = 0; time < 0.1;) {
    time += motion.step(motion.stable_step_s(0.9));
    for (int k = -4; k <= 4; ++k) {
      const double y = k * length_m / 8;
      through += pierced(grid, motion.position, {0, y, -depth_m}, {0, y, -0.03});
    }
  }
  return through;
}

TEST(PairContacts, ASheetAcrossASharpMeshEdgeBetweenItsParticlesStaysAboveIt) {
  const Surroundings solid = blade(0.06);
  EXPECT_GT(drop(solid, 0.06, false, 1.0), 0);  // by particles alone it falls through
  for (const double speed : {0.0, 1.0, 3.0})
    EXPECT_EQ(drop(solid, 0.06, true, speed), 0) << speed << " m/s";
}

TEST(PairContacts, APointUnderACellHoldsTheSheet) {
  const Surroundings solid = blade(0);
  EXPECT_GT(drop(solid, 0, false, 1.0), 0);
  EXPECT_EQ(drop(solid, 0, true, 0.0), 0);
  // Three particles are stopped at once; the rest of the sheet presses them in for a moment.
  EXPECT_EQ(drop(solid, 0, true, 1.0, 0.5e-3), 0);
}

TEST(Piercing, APointThroughTheSheetIsMeasuredAndOneThatPressesItIsNot) {
  const Surroundings solid = blade(0);
  const GridSpec grid{4, 4, {0.03, 0.03}};
  Cloth cloth(grid, stiff_cotton(), MassRule::area);
  for (const double depth : {2e-3, 2e-6, -1e-3}) {
    Motion motion(cloth, solid, {{0, 0, -kGravity}, 20, 0, 0.5, true});
    throw_down(grid, -depth, 0, motion);
    // The needle's edges are inclined by 1.4 mm over their 40 mm: upright to 0.1 %.
    EXPECT_NEAR(pierced_m(grid, motion.position, solid), std::max(0.0, depth), 2e-3 * 2e-3)
        << depth;
  }
}

/// Bent over y by `sag_m` at the hem.
Field bent(const GridSpec& grid, double sag_m) {
  Field x(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i) {
    const double u = static_cast<double>(int{i / grid.cols}) / (grid.rows - 1) - 0.5;
    const double v = static_cast<double>(i % grid.cols) / (grid.cols - 1) - 0.5;
    put_at(x, i, {u * grid.patch_m.x(), v * grid.patch_m.y(), -4 * sag_m * v * v});
  }
  return x;
}

TEST(Piercing, ALongEdgeThatGoesInAndOutStandsThroughByItsDepth) {
  const GridSpec grid{13, 13, {0.06, 0.06}};
  // The edge lies along y at z = 0: through the crown of the bend by `depth`, and above the sheet
  // by 9 mm at the hem, where the two bodies' gap is and no depth.
  for (const double depth : {0.1e-3, 0.3e-3}) {
    Field x = bent(grid, -9e-3);
    for (int i = 0; i < grid.count(); ++i) put_at(x, i, at(x, i) - Vector3d(0, 0, depth));
    const double found = pierced_m(grid, x, blade(0.058));
    EXPECT_GT(found, 0.5 * depth);
    EXPECT_LT(found, 1.5 * depth);
  }
}

TEST(Piercing, AnEdgeThatComesOutBeyondTheHemDoesNotStandThrough) {
  const GridSpec grid{13, 13, {0.06, 0.06}};
  // Inclined against the edge by 1 in 10; at the hem 0.2 mm below it, which goes on for 20 mm.
  Field x = bent(grid, 0);
  for (int i = 0; i < grid.count(); ++i) {
    const Vector3d p = at(x, i);
    put_at(x, i, p + Vector3d(0, 0, 0.1 * (0.03 - p.y()) - 0.2e-3));
  }
  EXPECT_LT(pierced_m(grid, x, blade(0.1)), 0.3e-3);
}

TEST(Piercing, ASheetOnAKnifesEdgeIsNotPierced) {
  const Surroundings solid = blade(0.06);
  const GridSpec grid{4, 4, {0.03, 0.03}};
  Cloth cloth(grid, stiff_cotton(), MassRule::area);
  Motion motion(cloth, solid, {{0, 0, -kGravity}, 20, 0, 0.5, true});
  throw_down(grid, 2e-3, 0, motion);
  double fall = 0, rest = 0;
  for (double time = 0; time < 0.2;) {
    time += motion.step(motion.stable_step_s(0.9));
    double& most = time < 0.15 ? fall : rest;
    most = std::max(most, pierced_m(grid, motion.position, solid));
  }
  EXPECT_LT(fall, 0.5e-3);  // a depth that a simulation refuses between particles
  EXPECT_LT(rest, 0.1e-3);
}

TEST(PairContacts, ABoxOfSharpEdgesIsMetAtItsEdgesAndCorners) {
  // A tower of 4 mm between particles 10 mm apart.
  Surroundings tower;
  tower.add(Box{{Eigen::Matrix3d::Identity(), {0, 0, -0.02}}, {4e-3, 4e-3, 0.04}, 0});
  EXPECT_GT(drop(tower, 0, false, 1.0), 0);
  for (const double speed : {0.0, 1.0, 3.0})
    EXPECT_EQ(drop(tower, 0, true, speed), 0) << speed << " m/s";
}

/// A strip whose first rows are held flat and whose rest lies folded over them.
struct FoldedStrip {
  GridSpec grid{13, 3, {0.06, 0.01}};
  Cloth cloth{grid, stiff_cotton(2e-7), MassRule::area};  // limp, so that the fold stays closed
  Surroundings nothing;
  Motion motion;

  FoldedStrip(double thickness, double speed, double friction)
      : motion(cloth, nothing, {{0, 0, -kGravity}, 4, 0, friction, true, thickness}) {
    std::vector<Hold> held;
    for (int i = 0; i < grid.count(); ++i) {
      const int r = i / grid.cols;
      Vector3d p(5e-3 * r, 5e-3 * (i % grid.cols), 0);
      if (r == 6) p = {0.025 + 1e-3 * std::sqrt(21.0), p.y(), 2e-3};
      if (r > 6) p = {0.025 - 5e-3 * (r - 7), p.y(), 4e-3};
      put_at(motion.position, i, p);
      if (r > 7) put_at(motion.velocity, i, {0, 0, -speed});
      if (r < 5) held.push_back({{i, i, i, i}, {1, 0, 0, 0}});
    }
    motion.hold(held);
  }
};

TEST(PairContacts, AStripFoldedOnItselfRestsOneThicknessAboveItself) {
  FoldedStrip strip(kThickness, 0, 0.3);
  double before = 0, least = 1;
  bool rising = false;
  for (int k = 0; k < 40000; ++k) {
    strip.motion.step(strip.motion.stable_step_s(0.9));
    const double now = strip.motion.kinetic_energy_j();
    if (now < before && rising) strip.motion.stop();
    rising = now >= before;
    before = now;
    if (k % 100 != 0) continue;
    const SelfDistance self = self_distance(strip.grid, strip.motion.position);
    ASSERT_EQ(self.crossings, 0) << "step " << k;
    least = std::min(least, self.least_m.value_or(1));
    if (strip.motion.residual() < 1e-3) break;
  }
  EXPECT_LT(strip.motion.residual(), 1e-3);
  EXPECT_GT(strip.motion.pair_contacts().pressing(strip.motion.position), 0);
  EXPECT_GT(least, kThickness - 50e-6);
  const SelfDistance rest = self_distance(strip.grid, strip.motion.position);
  ASSERT_TRUE(rest.least_m.has_value());
  EXPECT_NEAR(*rest.least_m, kThickness, 20e-6);
}

TEST(PairContacts, ALayerThrownOnAHeldLayerDoesNotPassThrough) {
  for (const double speed : {1.0, 3.0}) {
    for (const double thickness : {0.0, kThickness}) {
      FoldedStrip strip(thickness, speed, 0.3);
      int crossings = 0;
      for (int k = 0; k < 2000; ++k) {
        strip.motion.step(strip.motion.stable_step_s(0.9));
        if (k % 20 == 0) crossings += self_distance(strip.grid, strip.motion.position).crossings;
      }
      if (thickness > 0) {
        EXPECT_EQ(crossings, 0) << speed << " m/s";
        EXPECT_GT(strip.motion.backtracked_steps(), 0);
      } else {
        EXPECT_GT(crossings, 0) << speed << " m/s";
      }
    }
  }
}

TEST(PairContacts, ImpactOfLayersKeepsMomentumAndTakesEnergy) {
  FoldedStrip strip(kThickness, 1.0, 0.3);
  strip.motion.hold({});
  const auto momentum = [&] {
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i < strip.grid.count(); ++i)
      sum += strip.cloth.mass_kg()[i] * at(strip.motion.velocity, i);
    return sum;
  };
  const Vector3d start = momentum();
  const auto energy = [&] {
    return strip.motion.kinetic_energy_j() + strip.motion.gravity_energy_j() +
           strip.cloth.energies(strip.motion.position).sum_j() +
           strip.motion.pair_contacts().energy_j(strip.motion.position) +
           strip.motion.viscous_loss_j();
  };
  const double energy_start = energy();
  double time = 0;
  FoldedStrip* const s = &strip;
  // Damping acts on the whole sheet; without it the sum changes by weight alone.
  Motion free(s->cloth, s->nothing, {{0, 0, -kGravity}, 0, 0, 0.3, true, kThickness});
  free.position = strip.motion.position;
  free.velocity = strip.motion.velocity;
  for (int k = 0; k < 300; ++k) time += free.step(2e-5);
  strip.motion.position = free.position;
  strip.motion.velocity = free.velocity;
  const Vector3d expected = start + s->cloth.total_mass_kg() * time * Vector3d(0, 0, -kGravity);
  EXPECT_LT((momentum() - expected).norm(), 1e-9 * start.norm());
  EXPECT_LT(energy(), energy_start);
}

}  // namespace
}  // namespace drape::simulate
