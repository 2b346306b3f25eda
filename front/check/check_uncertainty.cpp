// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/units.hpp"
#include "front/check/check.hpp"

namespace drape {
namespace {

using units::mm;

/// The narrowest side that lies level; zero of an object without one.
double width_of(const Obstacle& object) {
  if (const auto* ball = std::get_if<Sphere>(&object)) return 2 * ball->radius_m;
  if (const auto* box = std::get_if<Box>(&object)) return box->size_m.head<2>().minCoeff();
  return 0;
}

struct PlateLimit {
  const char *option, *key;
  double least_mm, widths;  ///< smallest value, and the object's widths below which it stays
  const char* remedy;
};

/// An uncertainty as the object's own place may have it, a sheet and no block, a hole that carries.
constexpr PlateLimit kPlateLimits[] = {
    {"--placing-mm", "tags_placing_mm", 1e-3, 0.25,
     "give the standard uncertainty of laying the plate on, in mm"},
    {"--thickness-mm", "tags_thickness_mm", 0, 0.5, "give the thickness of the sheet in mm"},
    {"--hole-mm", "tags_hole_mm", 0, 1, "give the diameter of the stand's hole in mm"}};

void check_plate(const Scene& scene, const ObjectTags& plate, double width_m, BenchCheck& check) {
  for (const auto& [option, value_mm] : plate.lies()) {
    for (const PlateLimit& limit : kPlateLimits) {
      if (option != limit.option) continue;
      if (value_mm >= limit.least_mm && value_mm < limit.widths * width_m / mm) continue;
      add(check, scene.file, std::string("object.") + limit.key,
          fmt::format("{} = {:g} is not from {:g} to {:g}, {:g} of the width of object {}",
                      limit.key, value_mm, limit.least_mm, limit.widths * width_m / mm,
                      limit.widths, plate.object),
          limit.remedy, static_cast<std::size_t>(plate.object - 1));
    }
  }
}

}  // namespace

void check_uncertainty(const Scene& scene, std::size_t index, BenchCheck& check) {
  const double width_m = width_of(scene.obstacles[index]);
  const ObjectUncertainty stated = scene.uncertainty_of(index);
  if (!(width_m > 0)) return;
  for (const auto& [key, u_m] : {std::pair{"place_uncertainty_mm", stated.place_m()},
                                 std::pair{"size_uncertainty_mm", stated.size_m()}}) {
    if (2 * u_m < 0.5 * width_m) continue;
    add(check, scene.file, std::string("object.") + key,
        fmt::format("{} = {:g}: twice that is half of object {}, {:g} mm wide", key, u_m / mm,
                    index + 1, width_m / mm),
        "give one standard deviation in mm, e.g. half of the rule's smallest division", index);
  }
  for (const ObjectTags& plate : scene.tags)
    if (static_cast<std::size_t>(plate.object) == index + 1)
      check_plate(scene, plate, width_m, check);
}

}  // namespace drape
