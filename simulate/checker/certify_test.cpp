// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/certify.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/checker/layers.hpp"
#include "simulate/checker/scene.hpp"
#include "simulate/checker/sheet.hpp"
#include "tests/support/judged_drape.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using units::mm;

TEST(Certify, TrueCertificatesOfTheSphereAndThePinsHold) {
  for (const ClothModel model : {ClothModel::consistent, ClothModel::paper}) {
    for (const char* name : {"A", "D"}) {
      const Case drape(name, model);
      ASSERT_TRUE(drape.claim.at_rest) << name << " " << drape::name_of(model);
      const CertifyReport report = drape.judge();
      EXPECT_TRUE(report.accepted()) << name << " " << drape::name_of(model) << "\n"
                                     << listed(report);
      EXPECT_GT(report.contacts, 0);
    }
  }
}

TEST(Certify, CurvesFittedWhereTheClothLivesAreJudgedByTheSameFit) {
  Case drape("A", ClothModel::consistent);
  drape.options.solver = Solver::fall;
  drape.options.reach = find_reach(drape.scene, drape.fabric, drape.print, std::nullopt);
  ASSERT_TRUE(drape.options.reach);
  drape.result = simulate(drape.scene, drape.fabric, drape.print, std::nullopt, drape.options);
  const Cloth::Strains& strains = drape.result.report.strains;
  EXPECT_LE(strains.warp_most, drape.options.reach->tensile[0]);
  EXPECT_LE(strains.shear_most_rad, drape.options.reach->shear_rad);
  EXPECT_LE(strains.curvature_most_per_m, drape.options.reach->curvature_per_m);
  const test::TemporaryFolder folder;
  write_certificate(folder.path() / "certificate.json", drape.result, drape.options);
  write_durable(folder.path() / "history.csv", history_csv(drape.result.history));
  if (!drape.result.contact_forces.empty())
    write_durable(folder.path() / "contact_forces.csv",
                  contact_forces_csv(drape.result.contact_forces));
  drape.claim = read_claim(folder.path());
  EXPECT_TRUE(drape.claim.shear_most_rad && drape.claim.curvature_most_per_m &&
              drape.claim.twist_n_m);
  EXPECT_TRUE(drape.judge().accepted()) << listed(drape.judge());
  EXPECT_TRUE(drape.judge().warnings.empty());
  ASSERT_FALSE(drape.claim.contact_forces.empty());
  CertificateClaim exaggerated = drape.claim;
  for (ContactForce& force : exaggerated.contact_forces) force.force_in_world *= 1000;
  std::swap(drape.claim, exaggerated);
  EXPECT_TRUE(drape.judge().accepted()) << "other forces hold it";
  EXPECT_EQ(drape.judge().warnings.size(), 1U);
  std::swap(drape.claim, exaggerated);
  write_durable(folder.path() / "contact_forces.csv", contact_forces_csv({}));
  EXPECT_THROW((void)read_claim(folder.path()), Error) << "the certificate states some";
  drape.claim.reach.reset();
  EXPECT_FALSE(drape.judge().accepted()) << "the whole fit is another cloth";
}

TEST(Certify, AResultIsAtRestOnlyIfItIsAccepted) {
  Case drape("C", ClothModel::consistent);
  judge_rest(drape.result, drape.scene, drape.fabric, drape.print, drape.options);
  EXPECT_EQ(drape.result.report.status, RestStatus::at_rest);
  ASSERT_TRUE(drape.result.report.check.has_value());
  EXPECT_TRUE(drape.result.report.check->accepted);
  EXPECT_TRUE(drape.result.report.check->refused.empty());
  drape.result.sheet.marks[37].point_in_world.z() += 0.02 * mm;
  judge_rest(drape.result, drape.scene, drape.fabric, drape.print, drape.options);
  EXPECT_EQ(drape.result.report.status, RestStatus::refused);
  EXPECT_FALSE(drape.result.report.check->accepted);
  EXPECT_FALSE(drape.result.report.check->refused.empty());
  EXPECT_NE(std::get<SimulatedSource>(drape.result.sheet.source).status, "at rest");
}

/// Random places of a sheet of 30 particles, some of them cells, and forces in their cones.
struct Pressed {
  std::vector<checker::Point> force;
  std::vector<checker::Support> supports;

  Pressed(unsigned seed, long double friction) : force(30) {
    std::mt19937 engine(seed);
    const auto random = [&] { return 2.0L * engine() / 4294967295.0L - 1; };
    for (int s = 0; s < 60; ++s) {
      checker::Support support;
      long double sum = 0;
      for (int k = 0; k < 4; ++k) {
        support.particle[k] = s % 3 == 0 ? s / 2 : (s / 2 + k) % 30;
        support.weight[k] = s % 3 == 0 ? (k == 0 ? 1 : 0) : 0.1L + std::abs(random());
        sum += support.weight[k];
      }
      for (long double& w : support.weight) w /= sum;
      support.normal = {0.3L * random(), 0.3L * random(), 1};
      const long double size = std::sqrt(support.normal[0] * support.normal[0] +
                                         support.normal[1] * support.normal[1] + 1);
      for (long double& n : support.normal) n /= size;
      // Every second one slides: its force lies on the cone. One third presses nothing.
      const long double pressing = s % 3 == 1 ? 0 : 1 + random();
      const checker::Point& n = support.normal;
      const checker::Point along = {n[2] / std::hypot(n[0], n[2]), 0,
                                    -n[0] / std::hypot(n[0], n[2])};
      const long double fraction = s % 2 == 0 ? 1 : random();
      for (int k = 0; k < 4; ++k) {
        for (int axis = 0; axis < 3; ++axis)
          force[support.particle[k]][axis] -=
              support.weight[k] * pressing * (n[axis] + friction * fraction * along[axis]);
      }
      supports.push_back(support);
    }
  }
};

TEST(Certify, ForcesInTheConesAreFoundWhereThereAreAny) {
  for (const long double friction : {0.0L, 1e-3L, 0.4L, 3.0L}) {
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Pressed pressed(seed, friction);
      const checker::Balance found =
          checker::balance(pressed.force, pressed.supports, friction, 1e-7L, 400);
      EXPECT_LE(found.largest, 1e-7L) << friction << " " << seed;
    }
  }
}

// A particle on an edge of an object is offered hundreds of places whose directions oppose each
// other. Newton's method then takes more steps to the centre than 40, which once was the limit.
TEST(Certify, ForcesAreFoundWhereManyDirectionsOppose) {
  constexpr long double kFriction = 0.5L, kTolerance = 1e-4L;
  const std::vector<checker::Point> edge = {
      {0, -0.1L, -1}, {0, -0.7L, -0.7L}, {0, 0, -1}, {0, -1, 0}, {0, -0.8L, 0.6L}};
  for (const int places : {300, 600, 900}) {
    std::vector<checker::Point> force(2);
    std::vector<checker::Support> supports;
    const auto offer = [&](checker::Support support, long double pressing) {
      const long double size = std::sqrt(checker::dot(support.normal, support.normal));
      for (long double& n : support.normal) n /= size;
      for (int axis = 0; axis < 3; ++axis) {
        // It slides along x.
        const long double f = pressing * (axis == 0 ? kFriction : support.normal[axis]);
        for (int k = 0; k < 2; ++k) force[support.particle[k]][axis] -= support.weight[k] * f;
      }
      supports.push_back(support);
    };
    offer({{0, 1, 0, 0}, {0.6L, 0.4L, 0, 0}, {0, -0.8L, 0.6L}, false}, 1);
    for (int k = 0; k < places; ++k)
      offer({{0, 0, 0, 0}, {1, 0, 0, 0}, edge[k % edge.size()], false}, k == 4 ? 2 : 0);
    EXPECT_LE(checker::balance(force, supports, kFriction, kTolerance, 400).largest, kTolerance)
        << places;
  }
}

// A line 0.1 mm below the top of a cylinder may press anywhere between the two edges, also at the
// one where it lies less deep.
TEST(Certify, ALineAlongAFaceMayPressUpToItsEdges) {
  const auto first = [](double edge_radius_m, const checker::Point& direction) {
    Scene scene;
    scene.table_z_m = -1;
    scene.obstacles = {Cylinder{{}, 24 * mm, 48 * mm, edge_radius_m}};
    const std::vector<checker::Point> sheet = {{-30e-3L, 0, 23.9e-3L},
                                               {30e-3L, 0, 23.899e-3L},
                                               {-30e-3L, 60e-3L, 30e-3L},
                                               {30e-3L, 60e-3L, 30e-3L}};
    long double least = 1;
    for (const checker::Support& s :
         checker::supports_of(checker::Objects(scene), sheet, 2, 2, 5e-6L)) {
      if (s.particle == std::array{0, 1, 0, 1} && checker::dot(s.normal, direction) > 0.999L)
        least = std::min(least, s.weight[1]);
    }
    return static_cast<double>(least);
  };
  EXPECT_NEAR(first(0, {0, 0, 1}), 6.1 / 59.999, 1e-6) << "the side is as near as the top";
  EXPECT_NEAR(first(1 * mm, {0, 0, 1}), 7.0 / 60, 1e-6) << "the rounding begins";
  EXPECT_NEAR(first(0, {-1, 0, 0}), 5.995 / 60, 1e-6) << "it leaves the side, by 5 um";
}

TEST(Certify, NoForcesAreFoundWhereThereAreNone) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Pressed pressed(seed, 0.4L);
    // Surfaces that do not pull: the sum of all forces up would have to be a pull.
    pressed.force[0][2] += 200;
    EXPECT_GT(checker::balance(pressed.force, pressed.supports, 0.4L, 1e-3L, 400).largest, 1.0L);
  }
}

TEST(Certify, WrongOnesAreRefused) {
  const Case good("A", ClothModel::consistent);
  ASSERT_TRUE(good.judge().accepted());
  Case moved = good;
  moved.result.sheet.marks[37].point_in_world.z() += 0.02 * mm;
  EXPECT_FALSE(moved.judge().accepted());
  Case energy = good;
  *energy.claim.bending_j *= 1.001;
  EXPECT_FALSE(energy.judge().accepted());
  Case strain = good;
  strain.claim.warp_most += 1e-6;
  EXPECT_FALSE(strain.judge().accepted());
  for (auto part : {&CertificateClaim::shear_most_rad, &CertificateClaim::curvature_most_per_m,
                    &CertificateClaim::twist_n_m}) {
    Case value = good;
    *(value.claim.*part) *= 1.0001;
    EXPECT_FALSE(value.judge().accepted());
  }
  Case gap = good;
  gap.claim.deepest_between_m = 0;
  EXPECT_FALSE(gap.judge().accepted());
  Case law = good;
  law.fabric.areal_density_kg_per_m2 *= 1.01;  // heavier than the forces bear
  EXPECT_FALSE(law.judge().accepted());
  Case slippery = good;
  slippery.scene.friction = 0.01;
  EXPECT_FALSE(slippery.judge().accepted());
  Case lost = good;
  lost.result.sheet.marks.pop_back();
  EXPECT_FALSE(lost.judge().accepted());
}

TEST(Certify, AMovingSheetThatClaimsRestIsRefused) {
  Case early("D", ClothModel::consistent);
  early.options.max_steps = 3000;
  early.result = simulate(early.scene, early.fabric, early.print, std::nullopt, early.options);
  early.claim = claim_of(early.result, early.options);
  ASSERT_FALSE(early.claim.at_rest);
  EXPECT_TRUE(early.judge().accepted()) << listed(early.judge());  // its numbers are true
  early.claim.at_rest = true;
  early.claim.residual = 1e-4;
  EXPECT_FALSE(early.judge().accepted());
}

/// Four particles of a 3x3 sheet 1 um above the table, and what the checker makes of a force there.
struct StatedOnTable {
  Scene scene;
  std::vector<checker::Point> points;

  StatedOnTable() {
    scene.table_z_m = 0;
    for (int i = 0; i < 9; ++i) points.push_back({0.01L * (i % 3), 0.01L * int{i / 3}, 1e-6L});
  }
  [[nodiscard]] std::optional<checker::Point> first_gets(const ContactForce& stated,
                                                         double friction) const {
    std::vector<checker::Point> sum(points.size());
    if (!add_stated(checker::Objects(scene), points, 3, friction, 5e-6L, stated, sum))
      return std::nullopt;
    return sum[0];
  }
};

TEST(StatedForces, AreCutToWhatContactCanDo) {
  const StatedOnTable table;
  ContactForce push{0, {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 0, 2}};
  EXPECT_EQ(static_cast<double>((*table.first_gets(push, 0))[2]), 2);
  push.force_in_world = {1, 0, 2};
  EXPECT_LT(static_cast<double>((*table.first_gets(push, 0))[0]), 1e-6) << "slippery";
  EXPECT_NEAR(static_cast<double>((*table.first_gets(push, 0.25))[0]), 0.5, 1e-6) << "in the cone";
  push.force_in_world = {0, 0, -2};
  EXPECT_EQ(static_cast<double>((*table.first_gets(push, 0.25))[2]), 0) << "objects do not pull";
}

TEST(StatedForces, ActOnPlacesOfTheSheetThatTouch) {
  StatedOnTable table;
  const ContactForce in_cell{0, {0, 1, 3, 4}, {0.25, 0.25, 0.25, 0.25}, {0, 0, 4}};
  EXPECT_NEAR(static_cast<double>((*table.first_gets(in_cell, 0))[2]), 1, 1e-12);
  const ContactForce refused[] = {
      {0, {0, 2, 2, 2}, {0.5, 0.5, 0, 0}, {0, 0, 4}},   // between particles two columns apart
      {0, {0, 6, 6, 6}, {0.5, 0.5, 0, 0}, {0, 0, 4}},   // two rows apart
      {0, {0, 1, 1, 1}, {1.5, -0.5, 0, 0}, {0, 0, 4}},  // beyond its particles
      {0, {0, 1, 1, 1}, {0.5, 0.4, 0, 0}, {0, 0, 4}},   // weights that are no place
      {0, {0, 9, 9, 9}, {1, 0, 0, 0}, {0, 0, 4}},       // a particle that is not there
      {1, {0, 0, 0, 0}, {1, 0, 0, 0}, {0, 0, 4}}};      // an object that is not there
  for (const ContactForce& stated : refused) EXPECT_FALSE(table.first_gets(stated, 0));
  for (checker::Point& p : table.points) p[2] = 6e-6L;
  EXPECT_FALSE(table.first_gets(in_cell, 0)) << "too far to touch";
}

/// A sheet of 3 x 12 particles, its second half 0.4 mm above the first, turned over; and what the
/// checker makes of a force between the two.
struct StatedOnLayers {
  std::vector<checker::Point> points;

  StatedOnLayers() {
    for (int i = 0; i < 36; ++i) {
      const int col = i % 12;
      points.push_back(
          {0.01L * int{i / 12}, 0.01L * (col < 6 ? col : 11.3L - col), col < 6 ? 0 : 0.4e-3L});
    }
  }
  [[nodiscard]] std::optional<std::vector<checker::Point>> get(
      const ContactForce& stated, double friction = 0,
      checker::Real neighbours_m = 0.505e-3L) const {
    std::vector<checker::Point> sum(points.size());
    if (!checker::add_stated_layers(points, 12, friction, {0.505e-3L, neighbours_m}, stated, sum))
      return std::nullopt;
    return sum;
  }
};

TEST(StatedForces, OfOneLayerOnAnotherAreCutToWhatContactCanDo) {
  const StatedOnLayers layers;
  // Particle 10 lies at y = 13 mm over the triangle of 1 (10 mm), 2 (20 mm) and 13.
  ContactForce push{1, {10, 1, 2, 13}, {1, -0.7, -0.3, 0}, {0, 0, 2}};
  const auto pressed = layers.get(push);
  ASSERT_TRUE(pressed);
  EXPECT_NEAR(static_cast<double>((*pressed)[10][2]), 2, 1e-12);
  EXPECT_NEAR(static_cast<double>((*pressed)[1][2]), -1.4, 1e-12);
  EXPECT_NEAR(static_cast<double>((*pressed)[2][2]), -0.6, 1e-12);
  push.force_in_world = {1, 0, 2};
  EXPECT_LT(static_cast<double>((*layers.get(push))[10][0]), 1e-9) << "slippery";
  EXPECT_NEAR(static_cast<double>((*layers.get(push, 0.25))[10][0]), 0.5, 1e-9) << "in the cone";
  push.force_in_world = {0, 0, -2};
  EXPECT_EQ(static_cast<double>((*layers.get(push, 0.25))[10][2]), 0) << "layers do not pull";
}

TEST(StatedForces, BetweenLayersActOnNearestPlacesOfTwoLayers) {
  StatedOnLayers layers;
  // The edge 10, 9 runs along the edge 1, 2.
  EXPECT_TRUE(layers.get({1, {10, 9, 1, 2}, {1, 0, -0.7, -0.3}, {0, 0, 4}}));
  const ContactForce refused[] = {
      {1, {10, 1, 2, 13}, {1, -0.69, -0.31, 0}, {0, 0, 4}},  // not the nearest place
      {1, {10, 9, 1, 2}, {0.99, 0.01, -0.7, -0.3}, {0, 0, 4}},
      {1, {10, 1, 2, 13}, {1, -0.7, -0.2, 0}, {0, 0, 4}},  // weights that are no place
      {1, {10, 1, 2, 13}, {1, -1.3, 0.3, 0}, {0, 0, 4}},
      {1, {10, 1, 2, 4}, {1, -0.7, -0.3, 0}, {0, 0, 4}},    // no triangle
      {1, {2, 1, 13, 14}, {1, -1, 0, 0}, {0, 0, 4}},        // the layer itself
      {1, {40, 1, 2, 13}, {1, -0.7, -0.3, 0}, {0, 0, 4}}};  // a particle that is not there
  for (const ContactForce& stated : refused) EXPECT_FALSE(layers.get(stated));
  for (checker::Point& p : layers.points) p[2] *= 1.3L;
  EXPECT_FALSE(layers.get({1, {10, 1, 2, 13}, {1, -0.7, -0.3, 0}, {0, 0, 4}})) << "too far apart";
}

TEST(StatedForces, ActBetweenNeighboursWithoutACommonParticle) {
  StatedOnLayers fold;
  // Particle 5 lies below the next cell, 0.3 of a step from particle 6.
  const ContactForce press{1, {5, 6, 7, 18}, {1, -0.7, -0.3, 0}, {0, 0, -4}};
  const auto found = fold.get(press);
  ASSERT_TRUE(found);
  EXPECT_NEAR(static_cast<double>((*found)[5][2]), -4, 1e-12);
  EXPECT_NEAR(static_cast<double>((*found)[6][2]), 2.8, 1e-12);
  EXPECT_FALSE(fold.get(press, 0, 0.3e-3L)) << "too far for neighbours";
  const ContactForce own_cell{1, {5, 6, 17, 18}, {1, -1, 0, 0}, {0, 0, -4}};
  EXPECT_FALSE(fold.get(own_cell));
}

TEST(Crossings, OfNeighbouringCellsCount) {
  StatedOnLayers fold;
  EXPECT_EQ(checker::crossings_of(fold.points, 3, 12), 0);
  for (int row = 0; row < 3; ++row) {
    // Only the cells of columns 4 to 6 are left near each other.
    fold.points[row * 12 + 6] = {0.01L * row, 0.045L, 0.4e-3L};
    for (int col = 7; col < 12; ++col)
      fold.points[row * 12 + col] = {0.01L * row, 0.2L, 0.01L * col};
  }
  EXPECT_EQ(checker::crossings_of(fold.points, 3, 12), 0);
  fold.points[18][2] = -0.4e-3L;
  EXPECT_GT(checker::crossings_of(fold.points, 3, 12), 0);
}

}  // namespace
}  // namespace drape::simulate
