// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/scene_effects.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

struct Move {
  Vector3d moved_m;

  void operator()(Sphere& body) const { body.centre_in_world += moved_m; }
  void operator()(Box& body) const { body.world_from_box.translation_m += moved_m; }
  void operator()(Cylinder& body) const { body.world_from_cylinder.translation_m += moved_m; }
  void operator()(Plane& body) const { body.point_in_world += moved_m; }
  void operator()(MeshObject& body) const { body.world_from_mesh.translation_m += moved_m; }
};

/// Grows a body that stands where it stood; planes and meshes have no size of their own.
struct Grow {
  double by_m;

  void operator()(Sphere& body) const {
    body.radius_m += 0.5 * by_m;
    body.centre_in_world.z() += 0.5 * by_m;
  }
  void operator()(Box& body) const {
    body.size_m += Vector3d::Constant(by_m);
    body.world_from_box.translation_m.z() += 0.5 * by_m;
  }
  void operator()(Cylinder& body) const {
    body.radius_m += 0.5 * by_m;
    body.height_m += by_m;
    body.world_from_cylinder.translation_m.z() += 0.5 * by_m;
  }
  void operator()(Plane&) const {}
  void operator()(MeshObject&) const {}
};

}  // namespace

std::vector<SceneEffect> scene_effects(
    const Scene& scene, const std::function<std::optional<RestedMarks>(const Scene&)>& drape,
    const Eigen::MatrixX3d& base_m) {
  std::vector<SceneEffect> effects;
  /// `change(scene, amount)`, up and down by `step` (in SI); `unit` is that of the sensitivity.
  const auto add = [&](const std::string& name, double step, double unit,
                       const std::function<void(Scene&, double)>& change) {
    Scene higher = scene, lower = scene;
    change(higher, step);
    change(lower, -step);
    const auto up = drape(higher), down = drape(lower);
    SceneEffect effect{name, std::nullopt, {}};
    if (up && down) {
      effect.change_per_unit = (up->distance_m - down->distance_m) / (2 * step / unit);
      effect.moves = {step / unit, std::nullopt, down->places_m - base_m, up->places_m - base_m};
    }
    effects.push_back(effect);
  };
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      add(fmt::format("object_{}_{}_mm", i + 1, "xyz"[axis]), scene.uncertainty_of(i).place_m(), mm,
          [&](Scene& one, double by_m) {
            std::visit(Move{by_m * Vector3d::Unit(axis)}, one.obstacles[i]);
          });
    }
    if (std::holds_alternative<Plane>(scene.obstacles[i]) ||
        std::holds_alternative<MeshObject>(scene.obstacles[i]))
      continue;
    add(fmt::format("object_{}_size_mm", i + 1), scene.uncertainty_of(i).size_m(), mm,
        [&](Scene& one, double by_m) { std::visit(Grow{by_m}, one.obstacles[i]); });
  }
  if (scene.friction > 0) {
    const bool stand_in = !scene.friction_uncertainty && names(scene.stand_ins, "friction");
    const double step = stand_in
                            ? kStandInPart * scene.friction
                            : scene.friction_uncertainty.value_or(kMeasuredPart * scene.friction);
    add("friction", std::min(step, scene.friction), 1,
        [](Scene& one, double by) { one.friction += by; });
    if (stand_in) effects.back().moves.half_width = step;
  }
  return effects;
}

Json scene_effects_json(const std::vector<SceneEffect>& effects) {
  Json list = Json::array();
  for (const SceneEffect& effect : effects) {
    if (!effect.change_per_unit) continue;
    list.push_back(
        {{"value", effect.value}, {"mean_distance_mm_per_unit", *effect.change_per_unit / mm}});
    add_moves(effect.moves, list.back());
  }
  return list;
}

}  // namespace drape::simulate
