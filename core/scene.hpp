// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"
#include "core/pose.hpp"
#include "core/rig.hpp"
#include "core/units.hpp"

namespace drape {

struct Sphere {
  Eigen::Vector3d centre_in_world;  ///< metres
  double radius_m = 0;
};

/// Box with its own frame at its centre, axes along its edges.
struct Box {
  WorldFromObject world_from_box;
  Eigen::Vector3d size_m;    ///< full edge lengths
  double edge_radius_m = 0;  ///< radius of the rounded edges
};

/// Solid cylinder with its own frame at its centre, axis along z.
struct Cylinder {
  WorldFromObject world_from_cylinder;
  double radius_m = 0;
  double height_m = 0;
  double edge_radius_m = 0;  ///< radius of the rounded edges
};

/// Everything behind a plane.
struct Plane {
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d normal_in_world;  ///< unit, out of the solid
};

/// Solid bounded by a closed triangle mesh (PLY or OBJ, millimetres in its own frame).
struct MeshObject {
  std::filesystem::path file;
  WorldFromObject world_from_mesh;
};

using Obstacle = std::variant<Sphere, Box, Cylinder, Plane, MeshObject>;

/// Standard uncertainties of an object as the operator states them; what is absent counts as half a
/// division of a steel rule.
struct ObjectUncertainty {
  static constexpr double ruler_m = 0.5e-3;
  std::optional<double> stated_place_m;  ///< along each axis
  std::optional<double> stated_size_m;
  bool on_stand = false;  ///< it stands on something that is not in the scene, above the table

  [[nodiscard]] double place_m() const { return stated_place_m.value_or(ruler_m); }
  [[nodiscard]] double size_m() const { return stated_size_m.value_or(ruler_m); }
};

/// Plate of tags on an object (`drape print object-tags`), photographed before the cloth was laid.
/// Lengths in millimetres, as they go on to `drape object`.
struct ObjectTags {
  int object = 1;                ///< number in the scene, from 1
  std::string set;               ///< frame set that shows it
  std::filesystem::path target;  ///< its description
  std::optional<double> thickness_mm, hole_mm, placing_mm;

  /// Options of `drape object` that say how it lies there.
  [[nodiscard]] std::vector<std::pair<std::string, double>> lies() const;
};

/// A mark, or any other material point, held in place: where the measured sheet has it, or where
/// the operator measured it.
struct Pin {
  MarkId mark;                                    ///< says nothing when there is a material point
  std::optional<Eigen::Vector3d> point_in_world;  ///< absent: where the measured sheet has it
  std::optional<Eigen::Vector2d> at_material_m = std::nullopt;  ///< (warp, weft)
  std::optional<double> stated_place_m = std::nullopt;  ///< standard uncertainty along each axis

  /// Standard uncertainty of the operator's `point_in_world` along each axis; a pin without one is
  /// where its mark was measured, and as uncertain as that.
  [[nodiscard]] double place_m() const {
    return stated_place_m.value_or(ObjectUncertainty::ruler_m);
  }
  [[nodiscard]] Eigen::Vector2d material_m(const Print& print) const {
    return at_material_m.value_or(print.material_m(mark));
  }
};

/// A line of the cloth along warp or weft, held on a straight line in space with its slope.
struct Clamp {
  Eigen::Vector2d from_material_m, to_material_m;  ///< (warp, weft)
  Eigen::Vector3d from_in_world, to_in_world;
  Eigen::Vector3d
      direction_in_world;  ///< unit; how cloth leaves, from a line inside to larger ones
  std::optional<double> stated_place_m = std::nullopt;  ///< standard uncertainty along each axis

  /// Standard uncertainty of each end along each axis.
  [[nodiscard]] double place_m() const {
    return stated_place_m.value_or(ObjectUncertainty::ruler_m);
  }
};

/// Starts of the virtual cloth.
enum class StartMode {
  flat_from_measured,  ///< flat and horizontal above the obstacle, placed by the measured marks
  measured,            ///< the measured sheet itself, gaps filled
  flat,                ///< flat and horizontal at a centre and yaw given in the scene
};
template <>
inline constexpr std::string_view names_of<StartMode>[] = {"flat-from-measured", "measured",
                                                           "flat"};

struct Start {
  StartMode mode = StartMode::flat_from_measured;
  double clearance_m = 0;                          ///< height above the highest obstacle
  std::optional<Eigen::Vector3d> centre_in_world;  ///< only for flat
  double yaw_rad = 0;                              ///< only for flat: from +x to the weft direction
  std::vector<std::string> history = {};           ///< loads before, read by simulate
};

/// One drape (scene.toml): what the cloth lies on, how it starts, which fabric it is.
struct Scene {
  std::filesystem::path file;  ///< document.file()
  std::string name;
  std::string set;  ///< frame set of the recording that shows it; may be empty
  std::filesystem::path fabric_file;
  std::filesystem::path print_file;
  double table_z_m = 0;  ///< height of the table in the world frame
  double friction = 0;   ///< Coulomb coefficient cloth-object; 0 is the paper's case
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  std::vector<Obstacle> obstacles;
  std::vector<ObjectUncertainty> uncertainties;  ///< one an obstacle; absent: unstated
  std::vector<ObjectTags> tags;                  ///< plates of tags, in the order of the objects
  std::optional<double> stated_table_uncertainty_m;
  std::optional<double> friction_uncertainty;  ///< standard uncertainty of `friction`
  std::optional<std::array<double, 2>> stated_friction_range;  ///< least and largest
  std::optional<double> stated_level_rad;  ///< standard uncertainty of gravity's direction
  std::vector<Pin> pins;
  std::vector<Clamp> clamps;
  Start start;
  std::vector<std::string> stand_ins;  ///< values of this scene that nobody measured

  Document document = {};  ///< the file as it was read
  [[nodiscard]] ObjectUncertainty uncertainty_of(std::size_t obstacle) const {
    return obstacle < uncertainties.size() ? uncertainties[obstacle] : ObjectUncertainty{};
  }
  [[nodiscard]] double table_uncertainty_m() const {
    return stated_table_uncertainty_m.value_or(ObjectUncertainty::ruler_m);
  }
  /// Least and largest friction: as stated; half and twice of a stand-in; nothing where friction
  /// was measured.
  [[nodiscard]] std::optional<std::array<double, 2>> friction_range() const;
  /// Friction as it may be: the ends of its range, else one standard uncertainty below and above.
  [[nodiscard]] std::array<double, 2> friction_ends() const;
  /// Standard uncertainty of a friction that was measured: 5 % where nothing is stated.
  [[nodiscard]] double friction_u() const { return friction_uncertainty.value_or(0.05 * friction); }
  /// Standard uncertainty of gravity's direction about each axis across it; unstated, a spirit
  /// level's 1 mm per m.
  [[nodiscard]] double level_rad() const { return stated_level_rad.value_or(0.06 * units::deg); }
};

/// True if one of the texts, of a fabric or a scene, speaks of `word`.
[[nodiscard]] bool names(const std::vector<std::string>& stand_ins, const std::string& word);

/// Cloth on wood, metal, plastic and skin slides between 0.1 and 1.0; coated cloth on rubber 1.5.
inline constexpr double kLeastFriction = 0.1, kMostFriction = 1.5;

/// True where gravity has the Earth's strength, which a real drape has.
[[nodiscard]] bool is_gravity_of_earth(const Scene& scene);

template <>
inline constexpr Format format_of<Scene>{"scene", Syntax::toml, 1, "scene.toml: one drape"};

void fields(Fields& f, Scene& scene);
[[nodiscard]] Scene read_scene(const std::filesystem::path& file);  ///< checked by rules.hpp

/// Table and objects as the file has them ("table_z_mm", "object.1.x_mm"), as text; a mesh by what
/// `hash_of` makes of its file.
[[nodiscard]] std::map<std::string, std::string> surroundings_of(
    const Scene& scene, const std::function<std::string(const std::filesystem::path&)>& hash_of);

}  // namespace drape
