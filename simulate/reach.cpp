// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "simulate/equilibrium/run.hpp"
#include "simulate/simulate.hpp"
#include "simulate/start/clamps.hpp"
#include "simulate/world.hpp"

namespace drape::simulate {
namespace {

constexpr int kFirstGrid = 15;  // particles per side: a fold or two of any drape, in 0.1 s
// A crease holds its bend within a few particles, so that its strains grow with their number: to 61
// per side four times those of the first run.
constexpr double kFinerGrids = 4;
constexpr int kFirstSegments = 5;  // those of the paper

}  // namespace

std::optional<CurveReach> find_reach(const Scene& scene, const Fabric& fabric, const Print& print,
                                     const std::optional<Sheet>& measured) {
  const LocalScene local = local_scene(scene, measured, Surroundings(scene).top_z_m());
  SimulateReport ignored;
  const ClothLaws laws = make_laws(fabric, kFirstSegments, ignored);
  const Surroundings surroundings(local.scene);
  const StaticCase the_case{local.scene, print, local.measured, surroundings, laws};
  SimulateOptions how;
  how.solver = "fall";
  const GridSpec grid{kFirstGrid, kFirstGrid, print.patch_m};
  const StaticDrape first = drape_statically(the_case, grid, static_options(local.scene, how));
  Cloth cloth(grid, laws, MassRule::area);
  cloth.clamp(clamps_on(local.scene, grid).places);
  const Cloth::Strains strains = cloth.strains(first.position);
  const CurveReach reach{.tensile = {kFinerGrids * std::max(strains.warp_most, 0.0),
                                     kFinerGrids * std::max(strains.weft_most, 0.0)},
                         .shear_rad = kFinerGrids * strains.shear_most_rad,
                         .curvature_per_m = kFinerGrids * strains.curvature_most_per_m};
  const double sum = reach.tensile[0] + reach.tensile[1] + reach.shear_rad + reach.curvature_per_m;
  return std::isfinite(sum) ? std::optional(reach) : std::nullopt;
}

}  // namespace drape::simulate
