// SPDX-License-Identifier: Apache-2.0
#include "core/scene.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace drape {
namespace {
using Eigen::Vector3d;
using units::deg;
using units::mm;

constexpr double kFarthest_mm = 1e5;
constexpr double kLeastObject_mm = 5, kMostObject_mm = 3000;
constexpr std::string_view kObjectSizes =
    "what cloth drapes over measures 5 mm to 3 m; lengths are in mm, not in m or cm";
constexpr double kLeastEarth = 9.76, kMostEarth = 9.84;  ///< m/s2; Huascaran and the North Pole
constexpr double kLargestBench_mm = 10'000;  ///< largest distance of a cloth from the target

constexpr Field place(std::string_view name, std::string_view meaning) {
  return {name,
          meaning,
          mm,
          -kLargestBench_mm,
          kLargestBench_mm,
          "places are in mm from the target's middle"};
}

/// Limits the longest edge of an object to what fits a bench and still shapes a cloth.
void limit_size(Fields& f, std::string_view field, double longest_m) {
  if (!f.reads()) return;
  f.rule(longest_m / mm >= kLeastObject_mm && longest_m / mm <= kMostObject_mm, field,
         fmt::format("the object is {:g} mm long", longest_m / mm), kObjectSizes);
}

void yaw(Fields& f, Eigen::Matrix3d& rotation) {
  double yaw_rad = std::atan2(rotation(1, 0), rotation(0, 0));
  f.otherwise({"yaw_deg", "rotation about z, from x towards y", deg, -360, 360,
               "an angle in degrees, -180 to 180"},
              yaw_rad);
  if (f.reads()) rotation = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
}

/// Describes x, y and the lowest point of an object, which is `reach_m` below its centre.
void stand(Fields& f, Vector3d& centre_m, double reach_m) {
  double bottom_m = centre_m.z() - reach_m;
  f(place("x_mm", "centre in the world"), centre_m.x());
  f(place("y_mm", "centre in the world"), centre_m.y());
  f({"z_bottom_mm", "height of its lowest point in the world", mm}, bottom_m);
  centre_m.z() = bottom_m + reach_m;
}

void direction(Fields& f, const Field& field, Vector3d& unit) {
  f(field, unit);
  f.limit(unit.norm() >= 1e-9, field.name, "the direction has no length", "give e.g. [0, 0, 1]");
  if (f.reads()) unit.normalize();
}

constexpr Field standard_uncertainty(std::string_view name, std::string_view meaning) {
  return {name, meaning, mm, above_zero};
}

bool has_turn(const Obstacle& object) {
  return std::holds_alternative<Box>(object) || std::holds_alternative<MeshObject>(object);
}

/// One [[object]] of the file; the scene keeps its parts in separate lists.
struct SceneObject {
  Obstacle shape;
  ObjectUncertainty uncertainty;
  std::optional<ObjectTags> tags;
};

}  // namespace

void fields(Fields& f, Sphere& ball) {
  double diameter_m = 2 * ball.radius_m;
  f({"diameter_mm", "diameter", mm, above_zero}, diameter_m);
  limit_size(f, "diameter_mm", diameter_m);
  ball.radius_m = 0.5 * diameter_m;
  stand(f, ball.centre_in_world, ball.radius_m);
}

void fields(Fields& f, Box& box) {
  f({"size_mm", "full edges along x, y, z of the box", mm, above_zero}, box.size_m);
  limit_size(f, "size_mm", box.size_m.maxCoeff());
  f.otherwise({"edge_radius_mm", "radius of the rounded edges", mm, 0}, box.edge_radius_m);
  f.rule(2 * box.edge_radius_m <= box.size_m.minCoeff(), "edge_radius_mm",
         "the rounded edges are larger than the box",
         "give at most half of the smallest edge in size_mm");
  yaw(f, box.world_from_box.rotation);
  stand(f, box.world_from_box.translation_m, 0.5 * box.size_m.z());
}

void fields(Fields& f, Cylinder& body) {
  double diameter_m = 2 * body.radius_m;
  f({"diameter_mm", "diameter", mm, above_zero}, diameter_m);
  f({"height_mm", "length along its axis", mm, above_zero}, body.height_m);
  limit_size(f, "diameter_mm", std::max(diameter_m, body.height_m));
  body.radius_m = 0.5 * diameter_m;
  f.otherwise({"edge_radius_mm", "radius of the rounded edges", mm, 0}, body.edge_radius_m);
  f.rule(body.edge_radius_m <= std::min(body.radius_m, 0.5 * body.height_m), "edge_radius_mm",
         "the rounded edges are larger than the cylinder",
         "give at most the radius and half of the height");
  std::optional<Vector3d> axis = body.world_from_cylinder.rotation.col(2);
  if (f.reads()) axis.reset();
  f.if_any({"axis", "direction of its axis in the world; z if absent"}, axis);
  const Vector3d unit = axis.value_or(Vector3d::UnitZ());
  f.limit(unit.norm() >= 1e-9, "axis", "the direction has no length", "give e.g. [0, 0, 1]");
  const Vector3d along = unit.normalized();
  if (f.reads())
    body.world_from_cylinder.rotation =
        Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), along).toRotationMatrix();
  stand(
      f, body.world_from_cylinder.translation_m,
      0.5 * body.height_m * std::abs(along.z()) + body.radius_m * std::hypot(along.x(), along.y()));
}

void fields(Fields& f, Plane& plane) {
  f({"point_mm", "a point on the plane, in the world", mm}, plane.point_in_world);
  direction(f, {"normal", "out of the solid, any length"}, plane.normal_in_world);
}

void fields(Fields& f, MeshObject& body) {
  f({"file", "closed triangle mesh (PLY or OBJ, millimetres)"}, body.file);
  yaw(f, body.world_from_mesh.rotation);
  f({"origin_mm", "origin of the mesh in the world", mm}, body.world_from_mesh.translation_m);
}

namespace {

void fields(Fields& f, SceneObject& object) {
  f.one_of({"kind", "shape of the object"}, object.shape,
           {"sphere", "box", "cylinder", "plane", "mesh"});
  ObjectUncertainty& u = object.uncertainty;
  f.if_any(standard_uncertainty("place_uncertainty_mm", "standard uncertainty along each axis"),
           u.stated_place_m);
  f.if_any(standard_uncertainty("size_uncertainty_mm", "standard uncertainty of its size"),
           u.stated_size_m);
  f.if_any({"turn_uncertainty_deg",
            "standard uncertainty of its turn about the vertical; of a box, if absent, that of an "
            "edge between two ends of its place's uncertainty",
            deg, above_zero, 45, "give one standard deviation in degrees, e.g. 0.4"},
           u.stated_turn_rad);
  f.rule(!u.stated_turn_rad || has_turn(object.shape), "turn_uncertainty_deg",
         "only a box or a mesh can be turned", "remove turn_uncertainty_deg");
  f.otherwise({"on_stand", "true if it stands on something that the scene does not contain"},
              u.on_stand);
  ObjectTags tags = object.tags.value_or(ObjectTags{});
  std::optional<std::string> set = object.tags ? std::optional(tags.set) : std::nullopt;
  std::optional<std::filesystem::path> target =
      object.tags ? std::optional(tags.target) : std::nullopt;
  f.if_any(Field{"tags_set", "frame set that shows its tag plate"}.plain_name(), set);
  f.if_any({"tags_target", "description of the plate"}, target);
  f.if_any({"tags_thickness_mm", "thickness of the plate"}, tags.thickness_mm);
  f.if_any({"tags_hole_mm", "diameter of the stand's hole"}, tags.hole_mm);
  f.if_any({"tags_placing_mm", "standard uncertainty of placing the plate"}, tags.placing_mm);
  f.rule(!set || target, "tags_target", "`tags_target` is missing",
         "name the description of the plate that `drape print object-tags` wrote");
  if (!set) return;
  tags.set = *set;
  tags.target = target.value_or("");
  object.tags = tags;
}

}  // namespace

void fields(Fields& f, Pin& pin) {
  f.if_any(
      {"at_material_mm", "held point of the cloth (warp, weft)", mm, -kFarthest_mm, kFarthest_mm},
      pin.at_material_m);
  f.when(!pin.at_material_m, {"row", "row of the held mark, along the warp"}, pin.mark.row);
  f.when(!pin.at_material_m, {"col", "column of the held mark, along the weft"}, pin.mark.col);
  f.if_any({"at_mm", "position at which it is held; absent if where it was measured", mm,
            -kFarthest_mm, kFarthest_mm},
           pin.point_in_world);
  f.if_any(standard_uncertainty("place_uncertainty_mm",
                                "standard uncertainty of at_mm along each axis; absent: 0.5 mm"),
           pin.stated_place_m);
}

void fields(Fields& f, Clamp& clamp) {
  f({"from_material_mm", "end of the held line on the cloth (warp, weft)", mm, -kFarthest_mm,
     kFarthest_mm},
    clamp.from_material_m);
  f({"to_material_mm", "other end on the cloth", mm, -kFarthest_mm, kFarthest_mm},
    clamp.to_material_m);
  f({"from_mm", "end of the held line in the world", mm, -kFarthest_mm, kFarthest_mm},
    clamp.from_in_world);
  f({"to_mm", "other end in the world", mm, -kFarthest_mm, kFarthest_mm}, clamp.to_in_world);
  direction(f, {"direction", "direction in which the cloth leaves the clamp, any length"},
            clamp.direction_in_world);
  f.if_any(
      standard_uncertainty("place_uncertainty_mm",
                           "standard uncertainty of both ends along each axis; absent: 0.5 mm"),
      clamp.stated_place_m);
  const Eigen::Vector2d along = clamp.to_material_m - clamp.from_material_m;
  const Vector3d in_space = clamp.to_in_world - clamp.from_in_world;
  const bool is_long = along.norm() > 1e-6 && in_space.norm() > 1e-6;
  f.rule(is_long, "to_material_mm", "the clamp has no length",
         "give two ends apart from each other, or a [[pin]]");
  f.rule(!is_long || along.cwiseAbs().minCoeff() <= 1e-6, "to_material_mm",
         "the clamp crosses the threads",
         "a clamp runs along warp or weft: give both ends the same warp or the same weft");
  f.rule(!is_long || clamp.direction_in_world.cross(in_space.normalized()).norm() >= 1e-3,
         "direction", "the clamp is left along itself",
         "give the direction in which the cloth leaves, across the clamp");
}

void fields(Fields& f, Start& start) {
  f.if_any({"history", "loading history before the drape"}, start.history);
  f({"mode", "how the virtual cloth starts"}, start.mode);
  f.when(start.mode == StartMode::flat_from_measured,
         {"clearance_mm", "height above the highest object", mm, 0}, start.clearance_m);
  if (start.mode != StartMode::flat && !f.documents()) return;
  Vector3d centre_m = start.centre_in_world.value_or(Vector3d::Zero());
  f.when(true, {"centre_mm", "centre of the flat cloth", mm}, centre_m);
  start.centre_in_world = centre_m;
  f.otherwise({"yaw_deg", "from x to the weft of the flat cloth", deg}, start.yaw_rad);
}

namespace {

/// Limits friction and gravity to plausible values; a real drape has the Earth's gravity.
void limit_forces(Fields& f, const Scene& scene) {
  f.limit(
      scene.friction <= kMostFriction, "friction",
      fmt::format("a friction coefficient of {:g}; cloth on solids has {:g} to {:g}",
                  scene.friction, kLeastFriction, kMostFriction),
      fmt::format("is it {:.3g} (degrees), {:.3g} (per cent) or {:.3g}? Measure it on a tilting "
                  "plane: the tangent of the angle at which it slides",
                  std::tan(scene.friction * deg), scene.friction / 100, scene.friction / 10));
  const double u = scene.friction_uncertainty.value_or(0);
  f.limit(u == 0 || u < scene.friction, "friction_uncertainty",
          fmt::format("friction = {:g} with an uncertainty of {:g}: nothing would be known of it",
                      scene.friction, u),
          "give one standard deviation, or leave it out and list friction in stand_ins");
  if (scene.stated_friction_range)
    f.limit(scene.stated_friction_range->front() <= scene.friction &&
                scene.friction <= scene.stated_friction_range->back(),
            "friction_range",
            fmt::format("friction = {:g} is not between {:g} and {:g}", scene.friction,
                        scene.stated_friction_range->front(), scene.stated_friction_range->back()),
            "give the least and the largest friction of cloth and object, and `friction` between");
  constexpr double kLeast = 0.01, kMost = 100;  // m/s2; closed forms are tested in weak gravity
  constexpr const char* kUsual = "leave it out, or give [0, 0, -9.80665]";
  const double gravity = scene.gravity_m_per_s2.norm();
  f.limit(gravity >= kLeast && gravity <= kMost, "gravity_m_per_s2",
          fmt::format("gravity of {:g} m/s2", gravity), kUsual);
  if (scene.set.empty() || !(gravity >= kLeast && gravity <= kMost)) return;
  f.limit(is_gravity_of_earth(scene), "gravity_m_per_s2",
          fmt::format("gravity of {:g} m/s2 is not the Earth's, of {:g} to {:g}", gravity,
                      kLeastEarth, kMostEarth),
          kUsual);
  f.limit(!is_gravity_of_earth(scene) || scene.gravity_m_per_s2.z() <= -0.9 * gravity,
          "gravity_m_per_s2", "gravity does not point down (-z)", kUsual);
}

}  // namespace

bool is_gravity_of_earth(const Scene& scene) {
  const double gravity = scene.gravity_m_per_s2.norm();
  return gravity >= kLeastEarth && gravity <= kMostEarth;
}

bool names(const std::vector<std::string>& stand_ins, const std::string& word) {
  return std::any_of(stand_ins.begin(), stand_ins.end(),
                     [&](const std::string& what) { return what.find(word) != std::string::npos; });
}

std::optional<std::array<double, 2>> Scene::friction_range() const {
  if (stated_friction_range || !names(stand_ins, "friction")) return stated_friction_range;
  return {{0.5 * friction, 2 * friction}};
}

std::array<double, 2> Scene::friction_ends() const {
  if (!friction_uncertainty)
    if (const auto range = friction_range()) return *range;
  return {std::max(0.0, friction - friction_u()), friction + friction_u()};
}

void fields(Fields& f, Scene& scene) {
  scene.file = scene.document.file();
  f(Field{"name", "letter or name of the drape"}.plain_name(), scene.name);
  f.otherwise({"set", "frame set of the recording that shows it"}, scene.set);
  f({"fabric", "fabric file"}, scene.fabric_file);
  f({"print", "print file"}, scene.print_file);
  f({"table_z_mm", "height of the table in the world", mm}, scene.table_z_m);
  f({"friction", "Coulomb coefficient of cloth on the object", 1, 0}, scene.friction);
  f.otherwise({"gravity_m_per_s2", "gravity in the world"}, scene.gravity_m_per_s2);
  f.if_any({"stand_ins", "assumed values that were not measured"}, scene.stand_ins);
  f.if_any(standard_uncertainty("table_z_uncertainty_mm", "standard uncertainty of table_z_mm"),
           scene.stated_table_uncertainty_m);
  f.if_any({"friction_uncertainty", "standard uncertainty of friction", 1, above_zero},
           scene.friction_uncertainty);
  f.if_any({"friction_range", "smallest and largest possible friction", 1, above_zero},
           scene.stated_friction_range);
  f.if_any({"level_uncertainty_deg",
            "standard uncertainty of the bench's level (direction of gravity about each horizontal "
            "axis); 0.06 degrees (1 mm per m) if absent",
            deg, above_zero, 10, "give one standard deviation in degrees, e.g. 0.06"},
           scene.stated_level_rad);
  if (f.reads()) limit_forces(f, scene);
  std::vector<SceneObject> objects(scene.obstacles.size());
  for (std::size_t i = 0; i < objects.size(); ++i)
    objects[i] = {scene.obstacles[i], scene.uncertainty_of(i), std::nullopt};
  for (const ObjectTags& tags : scene.tags)
    objects.at(static_cast<std::size_t>(tags.object - 1)).tags = tags;
  f.if_any({"object", "objects on which the cloth lies"}, objects);
  scene.obstacles.clear();
  scene.uncertainties.clear();
  scene.tags.clear();
  for (SceneObject& object : objects) {
    scene.obstacles.push_back(std::move(object.shape));
    scene.uncertainties.push_back(object.uncertainty);
    if (!object.tags) continue;
    object.tags->object = static_cast<int>(scene.obstacles.size());
    scene.tags.push_back(std::move(*object.tags));
  }
  f.if_any({"pin", "points of the cloth that are held"}, scene.pins);
  f.if_any({"clamp", "lines of the cloth that are held"}, scene.clamps);
  f({"start", "how the virtual cloth starts"}, scene.start);
}

std::vector<std::pair<std::string, double>> ObjectTags::lies() const {
  std::vector<std::pair<std::string, double>> options;
  for (const auto& [option, value_mm] :
       {std::pair{"--thickness-mm", thickness_mm}, std::pair{"--hole-mm", hole_mm},
        std::pair{"--placing-mm", placing_mm}})
    if (value_mm) options.emplace_back(option, *value_mm);
  return options;
}

Scene read_scene(const std::filesystem::path& file) {
  auto scene = read_record<Scene>(file);
  throw_if_any(faults_of(scene));
  return scene;
}

std::map<std::string, std::string> surroundings_of(
    const Scene& scene, const std::function<std::string(const std::filesystem::path&)>& hash_of) {
  std::map<std::string, std::string> values;
  for (const auto& [key, value] : flat(scene.document.root()))
    if (key == "table_z_mm" || key.starts_with("object.")) values[key] = value;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    if (const auto* mesh = std::get_if<MeshObject>(&scene.obstacles[i]))
      values[fmt::format("object.{}.file", i + 1)] = hash_of(mesh->file);
  return values;
}

namespace {

/// Standard uncertainty stated by the operator, or assumed where it could be stated.
ValueWidth standard(double u, const char* unit, bool stated, const std::string& measure) {
  return {u, u, false,
          fmt::format("{:.4g}{} {}", u, unit, stated ? "as stated" : "assumed, nothing is stated"),
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
    if (const auto turn = turn_rad(scene.obstacles[i], own))
      values.push_back({value_name("object", i, "turn_deg"),
                        standard(*turn / deg, " degrees", own.stated_turn_rad.has_value(),
                                 fmt::format("measure both ends of an edge of object {} and state "
                                             "turn_uncertainty_deg",
                                             i + 1))});
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
    scene.obstacles[i] = moved(
        turned(grown(scene.obstacles[i], mm * error_of(errors, value_name("object", i, "size_mm"))),
               deg * error_of(errors, value_name("object", i, "turn_deg"))),
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

std::optional<double> turn_rad(const Obstacle& object, const ObjectUncertainty& own) {
  if (own.stated_turn_rad) return own.stated_turn_rad;
  const auto* box = std::get_if<Box>(&object);
  if (box == nullptr) return std::nullopt;
  return std::sqrt(2.0) * own.place_m() / box->size_m.x();
}

Obstacle turned(Obstacle object, double by_rad) {
  const Eigen::AngleAxisd turn(by_rad, Vector3d::UnitZ());
  if (auto* box = std::get_if<Box>(&object))
    box->world_from_box.rotation = turn * box->world_from_box.rotation;
  if (auto* body = std::get_if<MeshObject>(&object))
    body->world_from_mesh.rotation = turn * body->world_from_mesh.rotation;
  return object;
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
