// SPDX-License-Identifier: Apache-2.0
// Shapes with distances known in closed form, to 1e-9 m or better.

#include <random>

#include "compare/test_sheets.hpp"
#include "tests/support/trials.hpp"

namespace drape::compare {
namespace {

using units::deg;
using units::mm;

constexpr double kExact_m = 1e-9 * mm;
constexpr double kPatch_m = 220 * mm;

/// Particles exactly at the marks, so that the virtual sheet has no interpolation between them.
Sheet at_marks(const test::Shape& shape) {
  Sheet sheet = test::measured_sheet(shape);
  sheet.source = test::simulated_sheet(11, 5).source;
  return sheet;
}

/// A patch on a sphere about the origin: longitude along the weft, latitude against the warp.
test::Shape on_sphere(double radius_m) {
  return [radius_m](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    const double east = (m.y() - kPatch_m / 2) / 0.2, north = (kPatch_m / 2 - m.x()) / 0.2;
    return radius_m * Eigen::Vector3d(std::cos(north) * std::sin(east), std::sin(north),
                                      std::cos(north) * std::cos(east));
  };
}

/// A patch on a cylinder about the y axis, printed side out.
test::Shape on_cylinder(double radius_m, double bend_radius_m = 0.1) {
  return [=](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    const double angle = (m.y() - kPatch_m / 2) / bend_radius_m;
    return {radius_m * std::sin(angle), kPatch_m / 2 - m.x(), radius_m * std::cos(angle)};
  };
}

std::vector<MarkError> errors(const Sheet& real, const Sheet& simulated) {
  return compare_marks(real, Surface(simulated, "simulated")).marks;
}

TEST(KnownAnswers, ConcentricSpheresAreTheirRadiiApart) {
  const auto marks =
      errors(test::measured_sheet(on_sphere(0.2 + 7 * mm)), at_marks(on_sphere(0.2)));
  ASSERT_EQ(marks.size(), 121U);
  const DistanceStatistics s = statistics_of(marks);
  for (const double value : {s.mean_m, s.median_m, s.rms_m, s.p95_m, s.max_m})
    EXPECT_NEAR(value, 7 * mm, kExact_m);
}

TEST(KnownAnswers, CoaxialCylindersHaveTheNormalOfTheirChords) {
  // If particles are the marks, the normal at a mark is that of the chord to the next particle:
  // half a step of angle from the radius. The distance itself is the difference of the radii.
  const auto marks =
      errors(test::measured_sheet(on_cylinder(0.1 + 4 * mm)), at_marks(on_cylinder(0.1)));
  const double half_step = 20 * mm / 0.1 / 2;
  EXPECT_NEAR(statistics_of(marks).mean_m, 4 * mm, kExact_m);
  EXPECT_NEAR(normal_statistics_of(marks).mean_m, 4 * mm * std::cos(half_step), kExact_m);
  const auto inside =
      errors(test::measured_sheet(on_cylinder(0.1 - 4 * mm)), at_marks(on_cylinder(0.1)));
  EXPECT_NEAR(normal_statistics_of(inside).mean_m, -4 * mm * std::cos(half_step), kExact_m);
}

TEST(KnownAnswers, AlignmentFindsEveryRigidMoveAndLeavesNothing) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < drape::test::trial_count(20, 500); ++trial) {
    const Eigen::Vector3d axis = Eigen::Vector3d(normal(random), normal(random), normal(random));
    const double angle = 0.5 + std::fmod(std::abs(normal(random)), 2.0);
    const Eigen::Vector3d shift = 0.1 * Eigen::Vector3d(normal(random), normal(random), 1);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
    const test::Shape shape = on_cylinder(0.1);
    const test::Shape moved = [&](const Eigen::Vector2d& m) -> Eigen::Vector3d {
      return turn.transpose() * (shape(m) - shift);
    };
    const auto found = align(errors(test::measured_sheet(moved), at_marks(shape)));
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->turn_rad, angle, 1e-9);
    EXPECT_NEAR((found->rotation - turn).norm(), 0, 1e-9);
    EXPECT_NEAR((found->shift_m - shift).norm(), 0, 1e-9);
    EXPECT_NEAR(found->after.max_m, 0, kExact_m);
  }
}

TEST(KnownAnswers, AlignmentOfMarksOnALineIsRefused) {
  auto marks = errors(test::measured_sheet(), at_marks(test::flat));
  marks.resize(5);  // the first row
  EXPECT_FALSE(align(marks));
}

TEST(KnownAnswers, ParallelPlanesAreTheirGapApartAsSurfaces) {
  const test::Shape raised = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return test::flat(m) + Eigen::Vector3d(0, 0, 6 * mm);
  };
  const SurfaceDistance d = surface_distance(mesh_of(test::simulated_sheet(7, 1)),
                                             mesh_of(test::simulated_sheet(12, 1, raised)), 5 * mm);
  for (const double value :
       {d.mean_m(), d.hausdorff_m(), d.first_to_second.rms_m, d.second_to_first.rms_m})
    EXPECT_NEAR(value, 6 * mm, kExact_m);
}

TEST(KnownAnswers, ClothThatSlidesInItsPlaneHasNoSurfaceDistanceButALongerHausdorff) {
  // Shifted by 8 mm within the plane: zero inside the overlap, a strip of 8 mm outside.
  const test::Shape slid = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return test::flat(m) + Eigen::Vector3d(8 * mm, 0, 0);
  };
  const Sheet still = test::simulated_sheet(11, 1), moved = test::simulated_sheet(11, 1, slid);
  const SurfaceDistance d = surface_distance(mesh_of(still), mesh_of(moved), 2 * mm);
  EXPECT_NEAR(d.hausdorff_m(), 8 * mm, kExact_m);
  EXPECT_NEAR(statistics_of(errors(test::measured_sheet(slid), at_marks(test::flat))).mean_m,
              8 * mm, kExact_m);
}

/// A closed prism of `count` sides about the z axis, its vertices on the radius, 0.3 m high.
TriangleMesh prism(double radius_m, std::size_t count) {
  TriangleMesh mesh;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    for (const double z : {0.0, 0.3})
      mesh.points.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle), z);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t a = 2 * i, b = 2 * ((i + 1) % count);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
  return mesh;
}

TEST(KnownAnswers, NestedPrismsHaveTheDistancesOfTheirRadii) {
  // From an outer vertex the inner vertex is nearest: difference of the radii. From an inner point
  // the outer face is: difference of the inscribed radii, everywhere.
  for (const std::size_t sides : {6U, 24U, 90U}) {
    const SurfaceDistance d = surface_distance(prism(0.105, sides), prism(0.1, sides), 10 * mm);
    const double inscribed = 5 * mm * std::cos(std::numbers::pi / static_cast<double>(sides));
    EXPECT_NEAR(d.hausdorff_m(), 5 * mm, kExact_m) << sides;
    EXPECT_NEAR(d.first_to_second.hausdorff_m, 5 * mm, kExact_m) << sides;
    EXPECT_NEAR(d.second_to_first.mean_m, inscribed, kExact_m) << sides;
    EXPECT_NEAR(d.second_to_first.hausdorff_m, inscribed, kExact_m) << sides;
  }
}

TEST(KnownAnswers, NearestSurfaceIsWhatTryingEveryTriangleGives) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.15, 0.15);
  const TriangleMesh mesh = mesh_of(test::simulated_sheet(9, 1, on_sphere(0.1)));
  const NearestSurface tree(mesh);
  for (int trial = 0; trial < drape::test::trial_count(200, 5000); ++trial) {
    const Eigen::Vector3d point(uniform(random), uniform(random), uniform(random));
    double best = 1;
    for (const auto& [a, b, c] : mesh.triangles) {
      best = std::min(
          best,
          (nearest_on_triangle(point, mesh.points[a], mesh.points[b], mesh.points[c]).point - point)
              .norm());
    }
    EXPECT_NEAR(tree.distance_m(point), best, 1e-15);
  }
}

TEST(KnownAnswers, StrainOfAStretchedPatchIsItsStretch) {
  // 2 % longer along the warp, 1 % shorter along the weft: the area is 1.02 * 0.99.
  const test::Shape stretched = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return {0.99 * m.y(), -1.02 * m.x(), 0};
  };
  const Sheet simulated = at_marks(test::flat);
  const StrainMaps maps =
      strain_maps(test::measured_sheet(stretched), Surface(simulated, "simulated"));
  std::map<std::string, int> counts;
  for (const Strain& one : maps.strains) {
    ++counts[one.kind];
    EXPECT_NEAR(one.real,
                one.kind == "warp"   ? 0.02
                : one.kind == "weft" ? -0.01
                                     : 1.02 * 0.99 - 1,
                1e-9);
    EXPECT_NEAR(one.simulated, 0, 1e-9);
  }
  EXPECT_EQ(counts, (std::map<std::string, int>{{"warp", 110}, {"weft", 110}, {"area", 100}}));
  EXPECT_NEAR(*maps.difference.warp, 0.02, 1e-9);
  EXPECT_NEAR(*maps.difference.weft, 0.01, 1e-9);
}

TEST(KnownAnswers, SigmasOfOrderStatisticsAreThoseOfTheirMarks) {
  DistanceStatistics s = statistics_of(std::vector<double>{4, 1, 3, 2, 10});
  add_sigmas({4, 1, 3, 2, 10}, {0.4, 0.1, 0.3, 0.2, 1.0}, s);
  EXPECT_NEAR(*s.median.sigma_m, 0.3, 1e-15);
  EXPECT_NEAR(*s.max.sigma_m, 1.0, 1e-15);
  EXPECT_NEAR(*s.p95.sigma_m, std::hypot(0.2 * 0.4, 0.8 * 1.0), 1e-12) << "0.95 * 4 = 3.8";
  EXPECT_NEAR(*s.mean.sigma_m, std::sqrt(0.16 + 0.01 + 0.09 + 0.04 + 1) / 5, 1e-15);
  EXPECT_NEAR(*s.rms.sigma_m,
              std::sqrt(1.6 * 1.6 + 0.1 * 0.1 + 0.9 * 0.9 + 0.4 * 0.4 + 100) / (5 * s.rms_m),
              1e-15);
}

TEST(KnownAnswers, SigmasAreWhatRepeatedNoiseGives) {
  // 2,000 noisy copies of one drape: scatter of each statistic compared with its stated sigma. The
  // scatter of 2,000 draws is known to 1/sqrt(4000) = 1.6 %; the limit is three of these plus the
  // second-order part of a distance's noise.
  const test::Shape bent = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return test::flat(m) + Eigen::Vector3d(0, 0, 4 * mm + 30 * mm * m.x() / kPatch_m);
  };
  const Sheet simulated = at_marks(test::flat);
  const DistanceStatistics stated = statistics_of(errors(test::measured_sheet(bent), simulated));
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, 0.03 * mm);
  const int trials = drape::test::trial_count(400, 2000);
  std::vector<double> means, roots;
  for (int trial = 0; trial < trials; ++trial) {
    Sheet noisy = test::measured_sheet(bent);
    std::vector<double> distances;
    for (std::size_t i = 0; i < noisy.marks.size(); ++i) {
      const Eigen::Vector3d difference =
          noisy.marks[i].point_in_world +
          Eigen::Vector3d(noise(random), noise(random), noise(random)) -
          simulated.marks[i].point_in_world;
      distances.push_back(difference.norm());
    }
    const DistanceStatistics s = statistics_of(distances);
    means.push_back(s.mean_m);
    roots.push_back(s.rms_m);
  }
  const auto scatter = [&](const std::vector<double>& values) {
    double mean = 0, squares = 0;
    for (const double value : values) mean += value / trials;
    for (const double value : values) squares += (value - mean) * (value - mean);
    return std::sqrt(squares / (trials - 1));
  };
  const double limit = 3 / std::sqrt(2.0 * trials) + 0.01;
  EXPECT_NEAR(scatter(means) / *stated.mean.sigma_m, 1, limit);
  EXPECT_NEAR(scatter(roots) / *stated.rms.sigma_m, 1, limit);
}

TEST(KnownAnswers, BootstrapCoversTheMeanAsOftenAsItSays) {
  // Means of 121 exponential distances: the 95 % interval must contain the truth in about 95 % of
  // the trials. For so skewed a distribution a percentile interval falls short by 1 or 2 %.
  std::mt19937 random(5);
  std::exponential_distribution<double> law(1 / (4 * mm));
  const int trials = drape::test::trial_count(150, 2000);
  int held = 0;
  for (int trial = 0; trial < trials; ++trial) {
    std::vector<double> distances(121);
    for (double& d : distances) d = law(random);
    DistanceStatistics s = statistics_of(distances);
    add_bootstrap(distances, s);
    held += s.mean.bootstrap->low <= 4 * mm && 4 * mm <= s.mean.bootstrap->high;
  }
  const double fraction = static_cast<double>(held) / trials;
  const double limit = 3 * std::sqrt(0.95 * 0.05 / trials);
  EXPECT_GT(fraction, 0.93 - limit);
  EXPECT_LT(fraction, 0.96 + limit);
  RecordProperty("held_percent", std::to_string(100 * fraction));
}

TEST(KnownAnswers, BootstrapIsTheSameEveryTimeAndHoldsTheValue) {
  const std::vector<double> distances = {1 * mm, 2 * mm, 4 * mm, 3 * mm, 9 * mm, 5 * mm};
  DistanceStatistics one = statistics_of(distances), two = one;
  add_bootstrap(distances, one);
  add_bootstrap(distances, two);
  const auto pairs = {std::pair(one.mean, one.mean_m), std::pair(one.median, one.median_m),
                      std::pair(one.rms, one.rms_m), std::pair(one.p95, one.p95_m),
                      std::pair(one.max, one.max_m)};
  for (const auto& [trust, value] : pairs) {
    ASSERT_TRUE(trust.bootstrap);
    EXPECT_LE(trust.bootstrap->low, value);
    EXPECT_GE(trust.bootstrap->high, value);
  }
  EXPECT_EQ(one.mean.bootstrap->low, two.mean.bootstrap->low);
  EXPECT_EQ(one.max.bootstrap->high, 9 * mm);
  DistanceStatistics single = statistics_of(std::vector<double>{1.0});
  add_bootstrap({1.0}, single);
  EXPECT_FALSE(single.mean.bootstrap) << "one mark says nothing about other marks";
}

}  // namespace
}  // namespace drape::compare
