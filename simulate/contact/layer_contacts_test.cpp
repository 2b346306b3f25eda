// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/layer_contacts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "simulate/cloth/test_grid.hpp"
#include "simulate/contact/neighbours.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/equilibrium/solver.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kGravity = 9.80665;
constexpr double kThickness = 0.5e-3;

ClothLaws cotton() {
  return linear_laws(0.138, 2000, 30, 7.7e-6, 5e-6);
}

/// A pair on the first or last particles of two short rows far apart in the sheet.
LayerPair pair_of(bool edges) {
  return edges ? LayerPair{true, {0, 1, 30, 31}} : LayerPair{false, {0, 30, 31, 40}};
}

Field random_places(unsigned seed, int count, double size) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> between(-size, size);
  Field x(3 * static_cast<std::size_t>(count));
  for (double& value : x) value = between(random);
  return x;
}

TEST(LayerPair, NearestPointsAreNoFartherThanAnyOthers) {
  constexpr int kParts = 20;
  for (const bool edges : {false, true}) {
    const LayerPair pair = pair_of(edges);
    for (unsigned seed = 0; seed < 200; ++seed) {
      const Field x = random_places(seed, 50, 1);
      std::array<Vector3d, 4> p;
      for (int k = 0; k < 4; ++k) p[k] = at(x, pair.particle[k]);
      const NearestPoints nearest = nearest_points(pair, x);
      double least = 1e9;
      for (int i = 0; i <= kParts; ++i) {
        for (int j = 0; j <= kParts; ++j) {
          const double s = static_cast<double>(i) / kParts;
          const double t = static_cast<double>(j) / kParts;
          if (!edges && s + t > 1) continue;
          const Vector3d apart = edges
                                     ? (p[0] + s * (p[1] - p[0]) - p[2] - t * (p[3] - p[2])).eval()
                                     : (p[0] - p[1] - s * (p[2] - p[1]) - t * (p[3] - p[1])).eval();
          least = std::min(least, apart.norm());
        }
      }
      const double found = nearest.apart.norm();
      EXPECT_LE(found, least + 1e-12);
      EXPECT_GE(found, least - 4.0 / kParts);
      Vector3d apart = Vector3d::Zero();
      for (int k = 0; k < 4; ++k) apart += nearest.weight[k] * p[k];
      EXPECT_LT((apart - nearest.apart).norm(), 1e-12);
    }
  }
}

TEST(LayerPair, CurvatureIsTheDerivativeOfTheDistance) {
  constexpr double kStep = 1e-5;
  for (const bool edges : {false, true}) {
    const LayerPair pair = pair_of(edges);
    for (unsigned seed = 0; seed < 50; ++seed) {
      const Field x = random_places(seed, 50, 1);
      const NearestPoints nearest = nearest_points(pair, x);
      const Eigen::Matrix<double, 12, 12> curvature = distance_curvature(pair, nearest, x);
      bool smooth = true;  // the same free directions on both sides
      Eigen::Matrix<double, 12, 12> differences;
      for (int c = 0; c < 12; ++c) {
        Eigen::Matrix<double, 12, 1> slope[2];
        for (const int side : {0, 1}) {
          Field moved = x;
          Vector3d displacement = Vector3d::Zero();
          displacement[c % 3] = side == 0 ? -kStep : kStep;
          add_at(moved, pair.particle[c / 3], displacement);
          const NearestPoints there = nearest_points(pair, moved);
          smooth = smooth && there.slides == nearest.slides && there.slide == nearest.slide;
          for (int k = 0; k < 4; ++k) slope[side].segment<3>(3 * k) = there.weight[k] * there.apart;
        }
        differences.col(c) = (slope[1] - slope[0]) / (2 * kStep);
      }
      if (!smooth) continue;
      EXPECT_LT((curvature - differences).norm(), 1e-5 * (1 + curvature.norm())) << edges << seed;
    }
  }
}

TEST(LayerPair, AClearPathKeepsItsDistanceAndAThrownOneIsCut) {
  int cut = 0;
  for (const bool edges : {false, true}) {
    const LayerPair pair = pair_of(edges);
    for (unsigned seed = 0; seed < 300; ++seed) {
      const Field from = random_places(seed, 50, 1), to = random_places(seed + 1000, 50, 3);
      const double distance = nearest_points(pair, from).apart.norm();
      const double least = 0.2 * distance;
      const double fraction = clear_fraction(pair, from, to, distance, least);
      EXPECT_GT(fraction, 0);
      for (const double most : {0.1, 0.5})
        EXPECT_EQ(std::min(most, clear_fraction(pair, from, to, distance, least, most)),
                  std::min(most, fraction));
      cut += fraction < 1;
      for (int k = 0; k <= 100; ++k) {
        Field here = from;
        for (std::size_t i = 0; i < here.size(); ++i)
          here[i] += 0.01 * k * fraction * (to[i] - from[i]);
        EXPECT_GE(nearest_points(pair, here).apart.norm(), least * (1 - 1e-12));
      }
    }
  }
  EXPECT_GT(cut, 20);
}

TEST(Neighbours, MeetNowhereAndHaveNoCellInCommon) {
  const GridSpec grid{4, 5, {0.03, 0.04}};
  EXPECT_TRUE(are_two_layers(grid, {0, 1, 2, 6}, 1)) << "a particle and the next cell's triangle";
  EXPECT_FALSE(are_two_layers(grid, {0, 1, 6, 5}, 1)) << "its own cell's";
  EXPECT_FALSE(are_two_layers(grid, {1, 1, 2, 6}, 1)) << "a corner of it";
  EXPECT_TRUE(are_two_layers(grid, {0, 5, 2, 6}, 2));
  EXPECT_FALSE(are_two_layers(grid, {0, 5, 1, 6}, 2)) << "opposite sides of a cell";
  EXPECT_EQ(layers_apart_m(grid, {0, 5, 2, 6}, 2, 5e-3), 2.5e-3) << "a quarter of the spacing";
  EXPECT_EQ(layers_apart_m(grid, {0, 5, 8, 9}, 2, 5e-3), 5e-3);
}

TEST(Neighbours, NoneIsNearerThanTheBound) {
  const GridSpec grid{3, 3, {0.02, 0.03}};
  int useful = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    Field x = random_places(seed, grid.count(), 0.00003 * seed);
    for (int i = 0; i < grid.count(); ++i)
      add_at(x, i, {int{i / 3} * grid.warp_spacing_m(), (i % 3) * grid.weft_spacing_m(), 0});
    for (const int two : {1, 3, 4}) {
      const double bound = least_apart_m(grid, x, 0, two);
      useful += bound > 0;
      const int s = grid.cols;
      for (const LayerPair& pair :
           {LayerPair{false, {0, two, two + 1, two + s}}, LayerPair{false, {two + s + 1, 0, 1, s}},
            LayerPair{true, {0, 1, two + 1, two + s}}, LayerPair{true, {1, s, two + 1, two + s}}}) {
        if (!are_two_layers(grid, pair.particle, pair.edges ? 2 : 1)) continue;
        EXPECT_LE(bound, nearest_points(pair, x).apart.norm()) << seed << " " << two;
      }
    }
  }
  EXPECT_GT(useful, 100);
}

/// A strip that is folded over itself: the lower layer on z = 0, a half circle, the upper layer.
Field folded_strip(const GridSpec& grid, double radius) {
  Field x(3 * static_cast<std::size_t>(grid.count()));
  const double half = 0.5 * grid.patch_m.y();
  const double turn = 3.14159265358979 * radius;
  for (int i = 0; i < grid.count(); ++i) {
    const double row = int{i / grid.cols} * grid.warp_spacing_m();
    const double along = (i % grid.cols) * grid.weft_spacing_m();
    const double past = along - (half - 0.5 * turn);
    if (past < 0) {
      put_at(x, i, {row, past, 0});
    } else if (past < turn) {
      const double angle = past / radius;
      put_at(x, i, {row, radius * std::sin(angle), radius * (1 - std::cos(angle))});
    } else {
      put_at(x, i, {row, turn - past, 2 * radius});
    }
  }
  return x;
}

TEST(LayerContacts, ForcesAreTheGradientAndBlocksTheSecondDerivativeOfTheEnergy) {
  const GridSpec grid{4, 21, {0.02, 0.1}};
  const Cloth cloth(grid, cotton(), MassRule::area);
  LayerContacts layers(cloth, kGravity, kThickness);
  // Layers 0.4 mm apart, shaken so that no edges are parallel and no nearest point is a corner.
  Field x = folded_strip(grid, 0.2e-3);
  const Field shake = random_places(4, grid.count(), 0.05e-3);
  for (std::size_t k = 0; k < x.size(); ++k) x[k] += shake[k];
  layers.begin(x);
  ASSERT_GT(layers.pressing(x), 10);
  Field force(x.size(), 0.0);
  layers.add_forces(x, force);
  const Field displacement = random_places(5, grid.count(), 1);
  constexpr double kStep = 1e-9;
  Field ends[2] = {x, x};
  Field forces[2] = {Field(x.size(), 0.0), Field(x.size(), 0.0)};
  for (std::size_t k = 0; k < x.size(); ++k) {
    ends[0][k] -= kStep * displacement[k];
    ends[1][k] += kStep * displacement[k];
  }
  for (const int side : {0, 1}) layers.add_forces(ends[side], forces[side]);
  double slope = 0, curve = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    slope -= force[k] * displacement[k];
    curve -= (forces[1][k] - forces[0][k]) * displacement[k] / (2 * kStep);
  }
  EXPECT_NEAR((layers.energy_j(ends[1]) - layers.energy_j(ends[0])) / (2 * kStep), slope,
              1e-5 * std::abs(slope));
  double found = 0;
  for (const LayerContacts::Block& block : layers.blocks(x, false)) {
    Eigen::Matrix<double, 12, 1> part;
    for (int k = 0; k < 4; ++k) part.segment<3>(3 * k) = at(displacement, block.particle[k]);
    found += part.dot(block.matrix * part);
  }
  EXPECT_NEAR(found, curve, 1e-4 * std::abs(curve));
}

struct Folded {
  StaticReport report;
  Field position;
  double weight_n = 0;
};

Folded rest_of_folded(bool meets_itself, int threads = 1) {
  const GridSpec grid{7, 31, {0.03, 0.15}};
  Cloth cloth(grid, cotton(), MassRule::area);
  Surroundings table;
  table.add(Table{0});
  StaticOptions options;
  options.friction = 0.4;
  options.falls = Falls::first;
  options.threads = threads;
  options.cloth_thickness_m = kThickness;
  options.meets_itself = meets_itself;
  StaticSolver solver(cloth, table, options);
  solver.position = folded_strip(grid, 4e-3);
  Folded folded;
  folded.report = solver.solve();
  folded.position = solver.position;
  folded.weight_n = cloth.total_mass_kg() * kGravity;
  return folded;
}

TEST(LayerContacts, ASheetFoldedOntoItselfRestsOneThicknessApart) {
  const GridSpec grid{7, 31, {0.03, 0.15}};
  const Folded folded = rest_of_folded(true);
  ASSERT_EQ(folded.report.status, StaticStatus::at_rest);
  const SelfDistance self = self_distance(grid, folded.position);
  EXPECT_EQ(self.crossings, 0);
  ASSERT_TRUE(self.least_m.has_value());
  // A place sinks in by 2 um for each particle's weight on it; the loop of the fold lifts or
  // presses less than all of the sheet's 217 weights.
  EXPECT_LE(*self.least_m, kThickness);
  EXPECT_GT(*self.least_m, kThickness - 2e-6 * grid.count());
  double support_n = 0, lift_n = 0, layers_n = 0;
  for (const ContactForce& contact : folded.report.contact_forces) {
    if (contact.shape == 0) {
      support_n += contact.force_in_world.z();
      continue;
    }
    layers_n += std::abs(contact.force_in_world.z());
    for (const double weight : contact.weight) lift_n += weight * contact.force_in_world.z();
  }
  EXPECT_NEAR(support_n, folded.weight_n, 1e-6 * folded.weight_n);
  EXPECT_LT(std::abs(lift_n), 1e-12) << "layers do to each other what they suffer";
  EXPECT_GT(layers_n, 0.01 * folded.weight_n);
  EXPECT_GT(folded.report.layers, 0);
}

TEST(LayerContacts, WithoutItTheSameSheetPassesThroughItself) {
  const Folded folded = rest_of_folded(false);
  EXPECT_GT(self_distance({7, 31, {0.03, 0.15}}, folded.position).crossings, 0);
  EXPECT_EQ(folded.report.layers, 0);
  EXPECT_TRUE(folded.report.through_itself) << "it falls no further than that";
  EXPECT_NE(folded.report.status, StaticStatus::at_rest);
}

/// A limp strip on a table, folded at one line of particles, whose upper half falls shut.
StaticReport falls_shut(bool meets_itself, int& crossings) {
  const GridSpec grid{5, 9, {0.04, 0.08}};
  ClothLaws limp = cotton();
  limp.bending[0] = limp.bending[1] = {2e-8, {}};
  limp.twist_n_m = 1e-8;
  Cloth cloth(grid, limp, MassRule::area);
  Surroundings table;
  table.add(Table{0});
  StaticOptions options;
  options.friction = 0.4;
  options.falls = Falls::first;
  options.cloth_thickness_m = kThickness;
  options.meets_itself = meets_itself;
  StaticSolver solver(cloth, table, options);
  solver.position.resize(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i) {
    const double row = int{i / grid.cols} * grid.warp_spacing_m();
    const double along = (i % grid.cols - 4) * grid.weft_spacing_m();
    const double rises = along > 0 ? along : 0;
    put_at(solver.position, i, {row, along > 0 ? -0.98 * along : along, 0.2 * rises});
  }
  StaticReport report = solver.solve();
  crossings = self_distance(grid, solver.position).crossings;
  return report;
}

TEST(LayerContacts, KeepTheCellsOfAFoldAsSharpAsTheGridApart) {
  int crossings = 0;
  const StaticReport report = falls_shut(true, crossings);
  EXPECT_EQ(report.status, StaticStatus::at_rest);
  EXPECT_EQ(crossings, 0);
  const GridSpec grid{5, 9, {0.04, 0.08}};
  const auto is_of_neighbours = [&](const ContactForce& contact) {
    return contact.shape == 1 &&
           layers_apart_m(grid, contact.particle, contact.weight[1] > 0 ? 2 : 1, 1) < 1;
  };
  EXPECT_TRUE(
      std::any_of(report.contact_forces.begin(), report.contact_forces.end(), is_of_neighbours));
  (void)falls_shut(false, crossings);
  EXPECT_GT(crossings, 0);
}

TEST(LayerContacts, ListedAgainForWhatMovedOnAreThoseListedAtOnce) {
  const GridSpec grid{7, 31, {0.03, 0.15}};
  const Cloth cloth(grid, cotton(), MassRule::area);
  LayerContacts again(cloth, kGravity, kThickness), once(cloth, kGravity, kThickness);
  const Field start = folded_strip(grid, 0.4e-3);
  Field near = start, nearer = start;  // the upper half comes down, then a few particles more
  for (int i = 0; i < grid.count(); ++i) {
    if (at(start, i).z() > 0.5e-3) put_at(near, i, at(start, i) - Vector3d(0, 0, 0.2e-3));
    put_at(nearer, i, at(near, i));
    if (i % 31 > 20 && i < 3 * 31) put_at(nearer, i, at(near, i) - Vector3d(0, 0, 0.3e-3));
  }
  again.begin(start);
  again.watch(near);
  again.watch(nearer);
  once.begin(start);
  once.watch(nearer);
  EXPECT_GT(once.energy_j(nearer), 0);
  EXPECT_EQ(again.energy_j(nearer), once.energy_j(nearer));
  EXPECT_EQ(again.pressing(nearer), once.pressing(nearer));
}

TEST(BoxTree, VisitsEveryTwoBoxesThatMeetOnce) {
  constexpr int kBoxes = 60;
  const Field middles = random_places(1, kBoxes, 1), sizes = random_places(2, kBoxes, 0.4);
  std::vector<Vector3d> centres;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (int i = 0; i < kBoxes; ++i) {
    centres.push_back(at(middles, i));
    const Vector3d half = at(sizes, i).cwiseAbs();
    boxes.emplace_back(centres.back() - half, centres.back() + half);
  }
  BoxTree tree(centres);
  tree.refit(boxes);
  std::vector<std::pair<int, int>> found, expected;
  tree.query_pairs([&](int one, int other) { found.emplace_back(one, other); });
  for (int i = 0; i < kBoxes; ++i) {
    for (int j = i + 1; j < kBoxes; ++j) {
      if (boxes[i].intersects(boxes[j])) expected.emplace_back(i, j);
    }
  }
  std::sort(found.begin(), found.end());
  EXPECT_GT(expected.size(), 10U);
  EXPECT_EQ(found, expected);
}

TEST(LayerContacts, GiveTheSameBytesOnTwoThreads) {
  EXPECT_EQ(rest_of_folded(true, 1).position, rest_of_folded(true, 2).position);
}

TEST(LayerContacts, ThatNothingMeetsChangeNoByte) {
  const GridSpec grid{15, 15, {0.1, 0.1}};
  const auto drape = [&](bool meets_itself) {
    Cloth cloth(grid, cotton(), MassRule::area);
    Surroundings ball;
    ball.add(Sphere{{0, 0, -0.04}, 0.04});
    StaticOptions options;
    options.friction = 0.3;
    options.falls = Falls::first;
    options.cloth_thickness_m = kThickness;
    options.meets_itself = meets_itself;
    StaticSolver solver(cloth, ball, options);
    solver.position.resize(3 * static_cast<std::size_t>(grid.count()));
    for (int i = 0; i < grid.count(); ++i) {
      put_at(solver.position, i,
             {int{i / grid.cols} * grid.warp_spacing_m() - 0.049,
              (i % grid.cols) * grid.weft_spacing_m() - 0.052, 1e-3});
    }
    const StaticReport report = solver.solve();
    EXPECT_EQ(report.status, StaticStatus::at_rest);
    return solver.position;
  };
  EXPECT_EQ(drape(true), drape(false));
}

}  // namespace
}  // namespace drape::simulate
