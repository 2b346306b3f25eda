// SPDX-License-Identifier: Apache-2.0
// Slippery drapes of known parameters that other solvers found (tests/data/independent-drapes),
// from a coarse grid: what refinement states against how far they truly are.
#include <gtest/gtest.h>

#include <cstdio>

#include "core/files/csv.hpp"
#include "core/units.hpp"
#include "simulate/ensemble/checked.hpp"
#include "simulate/refine/refine.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::MatrixX3d;
using units::mm;

MatrixX3d places_of(const std::filesystem::path& csv) {
  const Csv other = read_csv(csv, {"warp_mm", "weft_mm", "x_mm", "y_mm", "z_mm"});
  MatrixX3d places(other.lines.size(), 3);
  for (Eigen::Index k = 0; k < places.rows(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      places(k, axis) =
          mm * other.columns[2 + static_cast<std::size_t>(axis)][static_cast<std::size_t>(k)];
  return places;
}

double mean_m(const MatrixX3d& moves_m) {
  return moves_m.rowwise().norm().mean();
}

/// Refines the static solver's drape of 31x31 from the scene's flat start up to `finest`.
void expect_covered(const std::string& name, int finest, double aim_mm) {
  const std::filesystem::path folder = drape::test::test_data("independent-drapes");
  const Scene scene = read_scene(folder / (name + ".toml"));
  const Fabric fabric = read_fabric(scene.fabric_file);
  const Print print = read_print(scene.print_file);
  const MatrixX3d other_m = places_of(folder / (name + ".csv"));
  SimulateOptions options;
  options.rows = options.cols = 31;
  options.segments = 1;
  options.solver = Solver::newton;
  const SimulateResult rest = simulate_checked(scene, fabric, print, std::nullopt, options);
  ASSERT_EQ(rest.report.status, RestStatus::at_rest) << rest.report.sentence;
  RefineOptions how;
  how.finest = finest;
  how.goal_m = 0.01 * mm;
  const Refinement refined =
      refine(scene, fabric, print, std::nullopt, options, {rest.sheet, rest.contact_forces}, how);
  ASSERT_TRUE(refined.left);
  ASSERT_EQ(refined.finest_at_rest(), refined.grids.size() - 1) << "every grid comes to rest";
  const MatrixX3d& last_m = refined.grids.back().places_m;
  const auto covers = [&](int rows, const MatrixX3d& places_m) {
    const double true_m = mean_m(places_m - other_m);
    const double stated_m = mean_m(places_m - last_m) + refined.left->mean_m();
    std::printf("%s %dx%d: %.3f mm from the independent drape, %.3f mm stated\n", name.c_str(),
                rows, rows, true_m / mm, stated_m / mm);
    EXPECT_LE(true_m, stated_m) << name << " " << rows;
  };
  covers(refined.coarse.rows, refined.coarse_places_m);
  for (const RefinedGrid& grid : refined.grids) covers(grid.result.sheet.rows, grid.places_m);
  const double found_mm = mean_m(last_m - other_m) / mm;
  if (found_mm > aim_mm) std::printf("  aim %.2f mm, MISSED\n", aim_mm);
  EXPECT_LT(found_mm, mean_m(refined.coarse_places_m - other_m) / mm) << "finer is nearer";
}

TEST(IndependentRefined, SphereIsCoveredByWhatIsStated) {
  expect_covered("sphere", 86, 0.5);
}

TEST(IndependentRefined, CubeIsCoveredByWhatIsStated) {
  expect_covered("cube", 61, 0.5);
}

}  // namespace
}  // namespace drape::simulate
