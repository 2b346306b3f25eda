// SPDX-License-Identifier: Apache-2.0
#include "synth/plates.hpp"

#include <cmath>

#include "core/files/toml_file.hpp"
#include "core/units.hpp"

namespace drape::synth {
namespace {

using units::mm;

WorldFromTarget pose_of(const TomlTable& table, const Obstacle& object) {
  constexpr double kSheet_mm = 0.1;  // as `drape object` takes it where nothing is stated
  WorldFromTarget pose;
  if (const auto* box = std::get_if<Box>(&object)) {
    pose.rotation = box->world_from_box.rotation;
    const double above_m =
        0.5 * box->size_m.z() + table.number_or("tags_thickness_mm", kSheet_mm) * mm;
    pose.translation_m = box->world_from_box * Eigen::Vector3d(0, 0, above_m);
    return pose;
  }
  const auto* ball = std::get_if<Sphere>(&object);
  const double hole_m = 0.5 * table.number_or("tags_hole_mm", 0) * mm;
  if (ball == nullptr || hole_m <= 0 || hole_m >= ball->radius_m)
    table.reject("tags_set", "a plate lies on a box, or carries a sphere in its hole",
                 "give a sphere's tags_hole_mm, smaller than its diameter");
  pose.translation_m = ball->centre_in_world;
  pose.translation_m.z() -= std::sqrt(ball->radius_m * ball->radius_m - hole_m * hole_m);
  return pose;
}

}  // namespace

std::vector<Plate> plates_of(const Scene& scene) {
  std::vector<Plate> plates;
  std::size_t index = 0;
  for (const TomlTable& table : TomlTable::open(scene.file, "scene").tables("object")) {
    const Obstacle& object = scene.obstacles[index++];
    if (table.has("tags_set"))
      plates.push_back(
          {table.name("tags_set"), table.file_path("tags_target"), pose_of(table, object)});
  }
  return plates;
}

}  // namespace drape::synth
