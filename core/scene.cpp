// SPDX-License-Identifier: Apache-2.0
#include "core/scene.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/files/toml_file.hpp"
#include "core/units.hpp"

namespace drape {
namespace {
using Eigen::Vector3d;
using units::deg;
using units::mm;

Vector3d vector3(const TomlTable& table, const std::string& key) {
  const std::vector<double> values = table.numbers(key, 3);
  return {values[0], values[1], values[2]};
}

/// Of an object's longest side: cloth does not see less, and no bench carries more.
void require_size(const TomlTable& table, const std::string& key, double longest_m) {
  constexpr double kLeast_m = 5 * mm, kMost_m = 3;
  if (longest_m >= kLeast_m && longest_m <= kMost_m) return;
  table.reject(key, fmt::format("the object is {:g} mm long", longest_m / mm),
               fmt::format("what cloth drapes over measures {:g} mm to {:g} m; lengths are in mm, "
                           "not in m or cm",
                           kLeast_m / mm, kMost_m));
}

Sphere read_sphere(const TomlTable& table) {
  const double radius_m = 0.5 * table.positive("diameter_mm") * mm;
  require_size(table, "diameter_mm", 2 * radius_m);
  return {{table.number("x_mm") * mm, table.number("y_mm") * mm,
           table.number("z_bottom_mm") * mm + radius_m},
          radius_m};
}

Box read_box(const TomlTable& table) {
  Box box;
  box.size_m = vector3(table, "size_mm") * mm;
  if (box.size_m.minCoeff() <= 0)
    table.reject("size_mm", "an edge is not positive", "give three lengths above 0");
  require_size(table, "size_mm", box.size_m.maxCoeff());
  box.edge_radius_m = table.has("edge_radius_mm") ? table.not_negative("edge_radius_mm") * mm : 0.0;
  if (2 * box.edge_radius_m > box.size_m.minCoeff())
    table.reject("edge_radius_mm", "the rounded edges are larger than the box",
                 "give at most half of the smallest edge in size_mm");
  const double yaw_rad = table.number_or("yaw_deg", 0.0) * deg;
  box.world_from_box.rotation = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  box.world_from_box.translation_m = {table.number("x_mm") * mm, table.number("y_mm") * mm,
                                      table.number("z_bottom_mm") * mm + 0.5 * box.size_m.z()};
  return box;
}

Vector3d direction(const TomlTable& table, const std::string& key) {
  const Vector3d value = vector3(table, key);
  if (value.norm() < 1e-9) table.reject(key, "the direction has no length", "give e.g. [0, 0, 1]");
  return value.normalized();
}

Cylinder read_cylinder(const TomlTable& table) {
  Cylinder body;
  body.radius_m = 0.5 * table.positive("diameter_mm") * mm;
  body.height_m = table.positive("height_mm") * mm;
  require_size(table, "diameter_mm", std::max(2 * body.radius_m, body.height_m));
  if (table.has("edge_radius_mm")) body.edge_radius_m = table.not_negative("edge_radius_mm") * mm;
  if (body.edge_radius_m > std::min(body.radius_m, 0.5 * body.height_m)) {
    table.reject("edge_radius_mm", "the rounded edges are larger than the cylinder",
                 "give at most the radius and half of the height");
  }
  const Vector3d axis = table.has("axis") ? direction(table, "axis") : Vector3d(0, 0, 1);
  body.world_from_cylinder.rotation =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis).toRotationMatrix();
  const double reach =
      0.5 * body.height_m * std::abs(axis.z()) + body.radius_m * std::hypot(axis.x(), axis.y());
  body.world_from_cylinder.translation_m = {table.number("x_mm") * mm, table.number("y_mm") * mm,
                                            table.number("z_bottom_mm") * mm + reach};
  return body;
}

MeshObject read_mesh_object(const TomlTable& table) {
  MeshObject body{table.file_path("file"), {}};
  const double yaw_rad = table.number_or("yaw_deg", 0.0) * deg;
  body.world_from_mesh.rotation = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  body.world_from_mesh.translation_m = vector3(table, "origin_mm") * mm;
  return body;
}

Obstacle read_obstacle(const TomlTable& table) {
  const std::string kind = table.text("kind");
  if (kind == "sphere") return read_sphere(table);
  if (kind == "box") return read_box(table);
  if (kind == "cylinder") return read_cylinder(table);
  if (kind == "plane") return Plane{vector3(table, "point_mm") * mm, direction(table, "normal")};
  if (kind == "mesh") return read_mesh_object(table);
  table.reject("kind", fmt::format("objects of kind `{}` are not known", kind),
               "use `sphere`, `box`, `cylinder`, `plane` or `mesh`");
}

std::optional<double> optional_length(const TomlTable& table, const std::string& key) {
  return table.has(key) ? std::optional(table.positive(key) * mm) : std::nullopt;
}

Eigen::Vector2d material_point_m(const TomlTable& table, const std::string& key) {
  const std::vector<double> at = table.numbers(key, 2);
  return {at[0] * mm, at[1] * mm};
}

Clamp read_clamp(const TomlTable& table) {
  return {material_point_m(table, "from_material_mm"), material_point_m(table, "to_material_mm"),
          vector3(table, "from_mm") * mm, vector3(table, "to_mm") * mm,
          direction(table, "direction")};
}

Pin read_pin(const TomlTable& table) {
  Pin pin;
  if (table.has("at_material_mm")) {
    pin.at_material_m = material_point_m(table, "at_material_mm");
  } else {
    pin.mark = {table.integer("row"), table.integer("col")};
  }
  if (table.has("at_mm")) pin.point_in_world = vector3(table, "at_mm") * mm;
  return pin;
}

Start read_start(const TomlTable& table) {
  Start start;
  if (table.has("history")) start.history = table.texts("history");
  const std::string mode = table.text("mode");
  if (mode == "measured") return {StartMode::measured, 0, {}, 0, start.history};
  if (mode == "flat") {
    start.mode = StartMode::flat;
    start.centre_in_world = vector3(table, "centre_mm") * mm;
    start.yaw_rad = table.number_or("yaw_deg", 0.0) * deg;
    return start;
  }
  if (mode != "flat-from-measured") {
    table.reject("mode", fmt::format("`{}` is no start", mode),
                 "use `flat-from-measured`, `measured` or `flat`");
  }
  start.clearance_m = table.not_negative("clearance_mm") * mm;
  return start;
}

}  // namespace

Scene read_scene(const std::filesystem::path& file) {
  const TomlTable root = TomlTable::open(file, "scene");
  Scene scene;
  scene.file = file;
  scene.name = root.name("name");
  scene.set = root.text_or("set", "");
  scene.fabric_file = root.file_path("fabric");
  scene.print_file = root.file_path("print");
  scene.table_z_m = root.number("table_z_mm") * mm;
  scene.friction = root.not_negative("friction");
  if (root.has("gravity_m_per_s2")) scene.gravity_m_per_s2 = vector3(root, "gravity_m_per_s2");
  if (root.has("stand_ins")) scene.stand_ins = root.texts("stand_ins");
  scene.stated_table_uncertainty_m = optional_length(root, "table_z_uncertainty_mm");
  if (root.has("friction_uncertainty"))
    scene.friction_uncertainty = root.positive("friction_uncertainty");
  for (const TomlTable& table : root.tables("object")) {
    for (const char* key : {"tags_set", "tags_target"}) static_cast<void>(table.text_or(key, ""));
    for (const char* key : {"tags_thickness_mm", "tags_hole_mm", "tags_placing_mm"})
      static_cast<void>(table.number_or(key, 0));
    scene.obstacles.push_back(read_obstacle(table));
    scene.uncertainties.push_back({optional_length(table, "place_uncertainty_mm"),
                                   optional_length(table, "size_uncertainty_mm"),
                                   table.boolean_or("on_stand", false)});
  }
  for (const TomlTable& table : root.tables("pin")) scene.pins.push_back(read_pin(table));
  for (const TomlTable& table : root.tables("clamp")) scene.clamps.push_back(read_clamp(table));
  scene.start = read_start(root.table("start"));
  root.finish();
  return scene;
}

}  // namespace drape
