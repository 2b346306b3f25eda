// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/start_check.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/contact/piercing.hpp"
#include "simulate/contact/self_distance.hpp"

namespace drape::simulate {
namespace {

using units::mm;

constexpr double kPierced = 1e-4;    // m; less is a sheet that lies on an edge
constexpr double kWritten_m = 1e-3;  // two places written to a whole millimetre

}  // namespace

std::vector<std::string> faults_of_start(const GridSpec& grid, const Field& position,
                                         const Surroundings& surroundings) {
  std::vector<std::string> faults;
  const int crossings = self_distance(grid, position).crossings;
  if (crossings > 0) {
    faults.push_back(
        fmt::format("the start passes through itself in {} pairs of triangles", crossings));
  }
  const double through_m = std::max(pierced_m(grid, position, surroundings),
                                    rim_through_m(grid, position, surroundings));
  if (through_m > kPierced) {
    faults.push_back(fmt::format(
        "the start is pierced: an edge of an object stands {:.2g} mm through it", through_m / mm));
  }
  return faults;
}

void check_pins(const Scene& scene, const Print& print, const Fabric& fabric) {
  for (std::size_t i = 0; i < scene.pins.size(); ++i) {
    for (std::size_t k = i + 1; k < scene.pins.size(); ++k) {
      const Pin &one = scene.pins[i], &other = scene.pins[k];
      if (!one.point_in_world || !other.point_in_world) continue;
      const Eigen::Vector2d between = (other.material_m(print) - one.material_m(print)).cwiseAbs();
      const double apart_m = (*other.point_in_world - *one.point_in_world).norm();
      const double reach_m = between.x() * (1 + fabric.tensile[0].x.back()) +
                             between.y() * (1 + fabric.tensile[1].x.back());
      if (apart_m <= reach_m + kWritten_m) continue;
      throw bad_input(
          fmt::format("pins {} and {} are {:.4g} mm apart in space; the cloth between them, {:.4g} "
                      "mm along its threads, was measured to stretch to {:.4g} mm",
                      i + 1, k + 1, apart_m / mm, between.sum() / mm, reach_m / mm),
          {.file = scene.file.string(), .field = "pin"},
          "is a place wrong, or a mark's row or column exchanged?");
    }
  }
}

std::string warning_of_lifted(int particles) {
  return fmt::format("{} particles started inside an object and were set on its surface",
                     particles);
}

}  // namespace drape::simulate
