// SPDX-License-Identifier: Apache-2.0
// Compares drapes with converged rests of another discretisation: tests/data/converged-drapes.
#include <gtest/gtest.h>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/fabric/fabric.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

struct Found {
  bool at_rest = false;
  double distance_m = 0, stated_m = 0;  ///< means
};

/// `pins`: held points instead of the scene's.
Found found_of(const std::string& name, const DrapeOptions& options,
               const std::vector<Pin>& pins = {}) {
  Scene scene = read_scene(test::test_data("independent-drapes") / (name + ".toml"));
  if (!pins.empty()) scene.pins = pins;
  const Print print = read_print(scene.print_file);
  const DrapeCase drape =
      drape_case(scene, print, std::nullopt, fit_laws(read_fabric(scene.fabric_file), 1).laws);
  const Drape rest = drape_cloth(drape, options);
  const Csv converged = read_csv(test::test_data("converged-drapes") / (name + ".csv"),
                                 {"warp_mm", "weft_mm", "x_mm", "y_mm", "z_mm"});
  const auto& columns = converged.columns;
  std::vector<Vector2d> material;
  for (std::size_t k = 0; k < columns[0].size(); ++k)
    material.emplace_back(columns[0][k] * mm, columns[1][k] * mm);
  const Eigen::MatrixX3d places = rest.level->places(rest.rest, material);
  Found found{rest.at_rest(), 0, rest.mesh_error_m.mean()};
  for (std::size_t k = 0; k < material.size(); ++k) {
    const Vector3d there(columns[2][k], columns[3][k], columns[4][k]);
    const Vector3d here = places.row(static_cast<Eigen::Index>(k));
    found.distance_m +=
        (drape.local.to_world(here) - mm * there).norm() / static_cast<double>(material.size());
  }
  return found;
}

TEST(ConvergedDrapes, LieWithinTheStatedMeshErrorOfCoarseLevels) {
  DrapeOptions options;
  options.spacing_m = 5 * mm;
  for (const char* name : {"hang", "sphere", "cube"}) {
    const Found found = found_of(name, options);
    EXPECT_TRUE(found.at_rest) << name;
    EXPECT_LE(found.distance_m, found.stated_m) << name;
  }
}

// The converged rest is held every 1.667 mm; points 2.5 mm apart approximate that.
TEST(ConvergedDrapes, AreMetOnTheBiasWhereItIsHeldAsAnArea) {
  std::vector<Pin> pins;
  for (int i = 0; i <= 80; ++i)
    for (int k = 0; k <= 80 && i + k <= 120; ++k)
      pins.push_back(
          {{}, Vector3d(2.5 * k - 100, 100 - 2.5 * i, 200) * mm, Vector2d(2.5 * i, 2.5 * k) * mm});
  const Found found = found_of("bias", {}, pins);
  EXPECT_TRUE(found.at_rest);
  EXPECT_LE(found.distance_m, 0.08 * mm);
}

}  // namespace
}  // namespace drape::simulate
