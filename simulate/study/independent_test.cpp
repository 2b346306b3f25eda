// SPDX-License-Identifier: Apache-2.0
// Frictionless drapes with known parameters computed by another solver: the scenes of
// tests/data/independent-drapes, three of them converged in tests/data/converged-drapes.
#include <gtest/gtest.h>

#include <cstdio>
#include <tuple>
#include <utility>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/simulate.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using units::mm;

struct Found {
  bool at_rest = false;
  double distance_m = 0;  ///< mean over the marks
};

/// Drapes `name` with the default options from the scene's flat start.
Found found_of(const std::string& name, const std::string& data, const Fabric& fabric) {
  const Scene scene = read_scene(test::test_data("independent-drapes") / (name + ".toml"));
  SimulateOptions options;
  options.segments = 1;
  const SimulateResult result =
      simulate(scene, fabric, read_print(scene.print_file), std::nullopt, options);
  const Csv other = read_csv(test::test_data(data) / (name + ".csv"),
                             {"warp_mm", "weft_mm", "x_mm", "y_mm", "z_mm"});
  std::vector<Eigen::Vector2d> material_m;
  for (std::size_t k = 0; k < other.columns[0].size(); ++k)
    material_m.emplace_back(mm * other.columns[0][k], mm * other.columns[1][k]);
  const Eigen::MatrixX3d places = result.drape->level->places(result.drape->rest, material_m);
  Found found{result.at_rest(), 0};
  for (std::size_t k = 0; k < material_m.size(); ++k) {
    const Eigen::Vector3d there(other.columns[2][k], other.columns[3][k], other.columns[4][k]);
    const Eigen::Vector3d here =
        result.drape_case->local.to_world(places.row(static_cast<Eigen::Index>(k)).transpose());
    found.distance_m += (here - mm * there).norm() / static_cast<double>(material_m.size());
  }
  return found;
}

Fabric twin() {
  return read_fabric(test::test_data("independent-drapes") / "fab" / "twinA.toml");
}

double stiffness_of(const KawabataCurve& bending) {
  return bending.loading.back() / bending.x.back();
}

/// The fabric with bending stiffnesses times `bending` and twist stiffness times `twist`.
Fabric changed(double bending, double twist) {
  Fabric fabric = twin();
  const double before = stiffness_of(fabric.bending[0]) + stiffness_of(fabric.bending[1]);
  const double twist_n_m = 4 * *fabric.bias_bending_n_m - before;
  for (KawabataCurve& curve : fabric.bending) {
    for (double& moment : curve.loading) moment *= bending;
    for (double& moment : curve.unloading) moment *= bending;
  }
  fabric.bias_bending_n_m = 0.25 * (twist * twist_n_m + bending * before);
  return fabric;
}

constexpr double kHang_mm = 0.05;

TEST(IndependentDrapes, AreMetByDefault) {
  for (const auto& [name, data, limit_mm] : {std::tuple("hang", "converged-drapes", kHang_mm),
                                             std::tuple("sphere", "converged-drapes", 0.15),
                                             std::tuple("cube", "converged-drapes", 0.25),
                                             std::tuple("bias", "independent-drapes", 0.10)}) {
    const Found found = found_of(name, data, twin());
    EXPECT_TRUE(found.at_rest) << name;
    EXPECT_LE(found.distance_m / mm, limit_mm) << name;
    std::printf("%s: %.4f mm from %s\n", name, found.distance_m / mm, data);
  }
}

TEST(IndependentDrapes, TellWrongParametersApart) {
  Fabric exchanged = twin();
  std::swap(exchanged.bending[0], exchanged.bending[1]);
  const std::pair<const char*, Fabric> wrong[] = {{"bending + 10 %", changed(1.1, 1)},
                                                  {"bending - 10 %", changed(0.9, 1)},
                                                  {"twist halved", changed(1, 0.5)},
                                                  {"bending exchanged", exchanged}};
  for (const auto& [what, fabric] : wrong) {
    const double distance_m = found_of("hang", "converged-drapes", fabric).distance_m;
    EXPECT_GT(distance_m / mm, kHang_mm) << what;
    std::printf("hang, %s: %.4f mm\n", what, distance_m / mm);
  }
}

}  // namespace
}  // namespace drape::simulate
