// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <utility>

#include "core/units.hpp"
#include "front/check/check.hpp"

namespace drape {

using units::mm;

void check_clamps(const Scene& scene, const Print* print, BenchCheck& check) {
  constexpr double kMostStretch = 0.03;  // cloth tears or slips out of the clamp not far beyond
  for (std::size_t i = 0; i < scene.clamps.size(); ++i) {
    const Clamp& clamp = scene.clamps[i];
    const Eigen::Vector2d along = clamp.to_material_m - clamp.from_material_m;
    const Eigen::Vector3d in_space = clamp.to_in_world - clamp.from_in_world;
    const auto problem = [&](const char* key, const std::string& what, const char* remedy) {
      add(check, scene.file, std::string("clamp.") + key, fmt::format("clamp {} {}", i + 1, what),
          remedy, i);
    };
    for (const auto& [key, end] : {std::pair{"from_material_mm", clamp.from_material_m},
                                   std::pair{"to_material_mm", clamp.to_material_m}})
      if (print != nullptr && (end.minCoeff() < 0 || (print->patch_m - end).minCoeff() < 0))
        problem(key,
                fmt::format("ends at ({:g}, {:g}) mm, the patch is {:g} x {:g} mm", end.x() / mm,
                            end.y() / mm, print->patch_m.x() / mm, print->patch_m.y() / mm),
                "count along warp and weft from the corner beside mark (0, 0)");
    if (!(along.norm() > 0 && in_space.norm() > 0)) {
      problem("to_material_mm", "has no length", "give two ends apart from each other, or a pin");
      continue;
    }
    if (along.cwiseAbs().minCoeff() > 0) {
      problem("to_material_mm", "crosses the threads",
              "a clamp runs along warp or weft: give both ends the same warp or the same weft");
      continue;
    }
    const double stretch = in_space.norm() / along.norm() - 1;
    if (std::abs(stretch) > kMostStretch)
      problem("to_mm",
              fmt::format("is {:g} mm long on the cloth and {:.4g} mm in space", along.norm() / mm,
                          in_space.norm() / mm),
              "both are the length of the held edge: is a place wrong, or an end exchanged?");
    if (clamp.direction_in_world.cross(in_space.normalized()).norm() < 1e-3)
      problem("direction", "is left along itself",
              "give the direction in which the cloth leaves, across the clamp");
  }
}

}  // namespace drape
