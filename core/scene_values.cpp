// SPDX-License-Identifier: Apache-2.0
#include "core/scene_values.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

namespace drape {
namespace {

using Eigen::Vector3d;
using units::mm;

/// Standard uncertainty stated by the operator, or assumed where it could be stated.
ValueWidth standard(double u, const char* unit, bool stated, const std::string& measure) {
  return {u, u, false,
          fmt::format("{:g}{} {}", u, unit, stated ? "as stated" : "assumed, nothing is stated"),
          stated ? "" : measure};
}

ValueWidth friction_width(const Scene& scene) {
  const auto [least, largest] = scene.friction_ends();
  if (scene.friction_range() && !scene.friction_uncertainty)
    return {scene.friction - least, largest - scene.friction, true,
            fmt::format("not measured: between {:g} and {:g}", least, largest), "measure friction"};
  return standard(scene.friction_u(), "", scene.friction_uncertainty.has_value(),
                  "state friction_uncertainty");
}

std::string value_name(const char* what, std::size_t i, const char* value) {
  return fmt::format("{}_{}_{}", what, i + 1, value);
}

Vector3d place_error_m(const ValueErrors& errors, const char* what, std::size_t i) {
  return mm * Vector3d(error_of(errors, value_name(what, i, "x_mm")),
                       error_of(errors, value_name(what, i, "y_mm")),
                       error_of(errors, value_name(what, i, "z_mm")));
}

struct Moved {
  Vector3d by_m;

  void operator()(Sphere& body) const { body.centre_in_world += by_m; }
  void operator()(Box& body) const { body.world_from_box.translation_m += by_m; }
  void operator()(Cylinder& body) const { body.world_from_cylinder.translation_m += by_m; }
  void operator()(Plane& body) const { body.point_in_world += by_m; }
  void operator()(MeshObject& body) const { body.world_from_mesh.translation_m += by_m; }
};

struct Grown {
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

std::vector<SceneValue> values_of(const Scene& scene,
                                  const std::function<double(const Pin&)>& pin_m) {
  std::vector<SceneValue> values;
  const auto add_place = [&](const char* what, std::size_t i, const ValueWidth& width) {
    for (const char* axis : {"x_mm", "y_mm", "z_mm"})
      values.push_back({value_name(what, i, axis), width});
  };
  const auto place_of = [](const char* what, std::size_t i, double u_m, bool stated) {
    return standard(u_m / mm, " mm", stated,
                    fmt::format("measure {} {} and state place_uncertainty_mm", what, i + 1));
  };
  for (const char* axis : {"x", "y"})
    values.push_back(
        {fmt::format("level_{}_deg", axis),
         standard(scene.level_rad() / units::deg, " degrees", scene.stated_level_rad.has_value(),
                  "level the bench and state level_uncertainty_deg")});
  for (std::size_t i = 0; i < scene.pins.size(); ++i) {
    const Pin& pin = scene.pins[i];
    add_place("pin", i,
              pin.point_in_world ? place_of("pin", i, pin.place_m(), pin.stated_place_m.has_value())
                                 : ValueWidth{pin_m(pin) / mm, pin_m(pin) / mm, false,
                                              "where its mark was measured", ""});
  }
  for (std::size_t i = 0; i < scene.clamps.size(); ++i)
    add_place("clamp", i,
              place_of("clamp", i, scene.clamps[i].place_m(),
                       scene.clamps[i].stated_place_m.has_value()));
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const ObjectUncertainty own = scene.uncertainty_of(i);
    add_place("object", i, place_of("object", i, own.place_m(), own.stated_place_m.has_value()));
    if (!std::holds_alternative<Plane>(scene.obstacles[i]) &&
        !std::holds_alternative<MeshObject>(scene.obstacles[i]))
      values.push_back(
          {value_name("object", i, "size_mm"),
           standard(own.size_m() / mm, " mm", own.stated_size_m.has_value(),
                    fmt::format("measure object {} and state size_uncertainty_mm", i + 1))});
  }
  if (scene.friction > 0) values.push_back({"friction", friction_width(scene)});
  return values;
}

double error_of(const ValueErrors& errors, const std::string& name) {
  const auto found = errors.find(name);
  return found == errors.end() ? 0 : found->second;
}

Scene erring(Scene scene, const ValueErrors& errors) {
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    scene.obstacles[i] =
        moved(grown(scene.obstacles[i], mm * error_of(errors, value_name("object", i, "size_mm"))),
              place_error_m(errors, "object", i));
  for (std::size_t i = 0; i < scene.pins.size(); ++i)
    if (scene.pins[i].point_in_world)
      *scene.pins[i].point_in_world += place_error_m(errors, "pin", i);
  for (std::size_t i = 0; i < scene.clamps.size(); ++i) {
    scene.clamps[i].from_in_world += place_error_m(errors, "clamp", i);
    scene.clamps[i].to_in_world += place_error_m(errors, "clamp", i);
  }
  scene.friction += error_of(errors, "friction");
  scene.gravity_m_per_s2 =
      Eigen::AngleAxisd(units::deg * error_of(errors, "level_x_deg"), Vector3d::UnitX()) *
      (Eigen::AngleAxisd(units::deg * error_of(errors, "level_y_deg"), Vector3d::UnitY()) *
       scene.gravity_m_per_s2);
  if (scene.start.centre_in_world)
    *scene.start.centre_in_world +=
        mm * Vector3d(error_of(errors, "start_x_mm"), error_of(errors, "start_y_mm"), 0);
  scene.start.yaw_rad += units::deg * error_of(errors, "start_yaw_deg");
  return scene;
}

Obstacle moved(Obstacle object, const Vector3d& by_m) {
  std::visit(Moved{by_m}, object);
  return object;
}

Obstacle grown(Obstacle object, double by_m) {
  std::visit(Grown{by_m}, object);
  return object;
}

}  // namespace drape
