// SPDX-License-Identifier: Apache-2.0
#include "synth/plates.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/units.hpp"

namespace drape::synth {
namespace {

using units::mm;

WorldFromTarget pose_of(const Scene& scene, const ObjectTags& tags) {
  const auto index = static_cast<std::size_t>(tags.object - 1);
  const Obstacle& object = scene.obstacles[index];
  constexpr double kSheet_mm = 0.1;  // as `drape object` takes it where nothing is stated
  WorldFromTarget pose;
  if (const auto* box = std::get_if<Box>(&object)) {
    pose.rotation = box->world_from_box.rotation;
    const double above_m = 0.5 * box->size_m.z() + tags.thickness_mm.value_or(kSheet_mm) * mm;
    pose.translation_m = box->world_from_box * Eigen::Vector3d(0, 0, above_m);
    return pose;
  }
  const auto* ball = std::get_if<Sphere>(&object);
  const double hole_m = 0.5 * tags.hole_mm.value_or(0) * mm;
  if (ball == nullptr || hole_m <= 0 || hole_m >= ball->radius_m)
    throw bad_input("a plate lies on a box, or carries a sphere in its hole",
                    scene.document.where(fmt::format("object.{}.tags_set", index)),
                    "give a sphere's tags_hole_mm, smaller than its diameter");
  pose.translation_m = ball->centre_in_world;
  pose.translation_m.z() -= std::sqrt(ball->radius_m * ball->radius_m - hole_m * hole_m);
  return pose;
}

}  // namespace

std::vector<Plate> plates_of(const Scene& scene) {
  std::vector<Plate> plates;
  for (const ObjectTags& tags : scene.tags)
    plates.push_back({tags.set, tags.target, pose_of(scene, tags)});
  return plates;
}

}  // namespace drape::synth
