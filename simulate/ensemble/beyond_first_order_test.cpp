// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/bands.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/units.hpp"
#include "simulate/ensemble/test_ensemble.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

double mean_mm(const Eigen::MatrixX3d& moves_m) {
  return moves_m.rowwise().norm().mean() / mm;
}

/// Errors of what is stated: a body that is larger stands where it stood, gravity turns by the
/// level, a flat start is laid elsewhere; everything that is stated has an uncertainty.
TEST(StatedErrors, AreThoseOfTheScene) {
  const Scene scene = test::on_round_box();
  const auto& box = std::get<Box>(scene.obstacles.front());
  const ValueErrors errors{{"object_1_x_mm", 2.0}, {"object_1_size_mm", 1.0},
                           {"friction", 0.1},      {"level_x_deg", 0.5},
                           {"start_y_mm", -3.0},   {"start_yaw_deg", 2.0}};
  const Scene other = drape::erring(scene, errors);
  const auto& moved_box = std::get<Box>(other.obstacles.front());
  EXPECT_LT((moved_box.size_m - box.size_m - Vector3d::Constant(1 * mm)).norm(), 1e-12);
  EXPECT_LT((moved_box.world_from_box.translation_m - box.world_from_box.translation_m -
             Vector3d(2, 0, 0.5) * mm)
                .norm(),
            1e-12);
  EXPECT_NEAR(other.friction, scene.friction + 0.1, 1e-12);
  EXPECT_NEAR(
      std::acos(other.gravity_m_per_s2.normalized().dot(scene.gravity_m_per_s2.normalized())) /
          units::deg,
      0.5, 1e-6);
  EXPECT_NEAR(other.gravity_m_per_s2.x(), 0, 1e-12) << "turned about x";
  EXPECT_NEAR((*other.start.centre_in_world - *scene.start.centre_in_world).y() / mm, -3, 1e-9);
  EXPECT_NEAR((other.start.yaw_rad - scene.start.yaw_rad) / units::deg, 2, 1e-9);
  const ValueErrors all =
      uncertainties_of(scene, read_fabric(scene.fabric_file), read_print(scene.print_file));
  for (const auto& [name, error] : errors)
    EXPECT_EQ(error_of(all, name) > 0, name != "friction") << name;
}

/// Cloth that friction holds where it fell goes another way than its rest would be drawn.
TEST(BeyondFirstOrder, IsTheSameOnTwoThreadsAndNotNothingWhereFrictionHolds) {
  const EnsembleCase own = test::coarse_case(test::on_round_box());
  EnsembleOptions how{.starts = 1};
  how.same_m = 10 * mm;
  const Ensemble ensemble = find_branches(own, how);
  const auto one = beyond_first_order(ensemble, own, std::nullopt, how);
  ASSERT_TRUE(one);
  int counted = 0;
  for (const ErringRest& rest : one->rests) {
    if (!rest.moves_m) continue;
    ++counted;
    EXPECT_GT(mean_mm(one_a_row(*rest.moves_m) - one_a_row(*rest.first_order_m)), 0.01);
  }
  EXPECT_GE(counted, 4);
  how.threads = 2;
  const auto two = beyond_first_order(ensemble, own, std::nullopt, how);
  BranchList first, second;
  first.beyond_first_order = one;
  second.beyond_first_order = two;
  EXPECT_EQ(text_of(first), text_of(second));
}

}  // namespace
}  // namespace drape::simulate
