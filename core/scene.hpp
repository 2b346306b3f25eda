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
#include "core/geometry/rigid_motion.hpp"
#include "core/marks.hpp"
#include "core/rig.hpp"
#include "core/units.hpp"

namespace drape {

struct Sphere {
  Eigen::Vector3d centre_in_world;  ///< metres
  double radius_m = 0;
};

/// Box. Its frame has the origin at the centre and axes along the edges.
struct Box {
  WorldFromObject world_from_box;
  Eigen::Vector3d size_m;    ///< full edge lengths
  double edge_radius_m = 0;  ///< radius of the rounded edges
};

/// Solid cylinder. Its frame has the origin at the centre and z along the axis.
struct Cylinder {
  WorldFromObject world_from_cylinder;
  double radius_m = 0;
  double height_m = 0;
  double edge_radius_m = 0;  ///< radius of the rounded edges
};

/// Half space behind a plane.
struct Plane {
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d normal_in_world;  ///< unit normal, pointing out of the solid
};

/// Solid bounded by a closed triangle mesh (PLY or OBJ, in millimetres in its own frame).
struct MeshObject {
  std::filesystem::path file;
  WorldFromObject world_from_mesh;
};

using Obstacle = std::variant<Sphere, Box, Cylinder, Plane, MeshObject>;

/// Standard uncertainties of an object as stated by the operator; unstated ones default to half a
/// division of a steel rule.
struct ObjectUncertainty {
  static constexpr double ruler_m = 0.5e-3;
  std::optional<double> stated_place_m;  ///< along each axis, m
  std::optional<double> stated_size_m;
  std::optional<double> stated_turn_rad = std::nullopt;  ///< about the vertical
  bool on_stand = false;  ///< the object stands above the table, on something not in the scene

  [[nodiscard]] double place_m() const { return stated_place_m.value_or(ruler_m); }
  [[nodiscard]] double size_m() const { return stated_size_m.value_or(ruler_m); }
};

/// Standard uncertainty of an object's turn about the vertical, rad: as stated, else that of a
/// box's first edge between two ends of known place. nullopt if the object is round or flat, or a
/// mesh whose turn's uncertainty is not stated.
[[nodiscard]] std::optional<double> turn_rad(const Obstacle& object, const ObjectUncertainty& own);

/// Plate of tags on an object (`drape print object-tags`), photographed before the cloth was laid.
/// Lengths are in millimetres, as they are passed on to `drape object`.
struct ObjectTags {
  int object = 1;                ///< number of the object in the scene, from 1
  std::string set;               ///< frame set that shows it
  std::filesystem::path target;  ///< its description file
  std::optional<double> thickness_mm, hole_mm, placing_mm;

  /// Options of `drape object` that state how the plate lies on the object.
  [[nodiscard]] std::vector<std::pair<std::string, double>> lies() const;
};

/// A mark or another material point that is held fixed: at its position in the measured sheet, or
/// at one that the operator measured.
struct Pin {
  MarkId mark;                                    ///< unused if a material point is given
  std::optional<Eigen::Vector3d> point_in_world;  ///< absent if taken from the measured sheet
  std::optional<Eigen::Vector2d> at_material_m = std::nullopt;  ///< material point (warp, weft)
  std::optional<double> stated_place_m = std::nullopt;  ///< standard uncertainty along each axis

  /// Standard uncertainty along each axis of the operator's `point_in_world`. A pin without one is
  /// held at its measured mark and inherits that mark's uncertainty.
  [[nodiscard]] double place_m() const {
    return stated_place_m.value_or(ObjectUncertainty::ruler_m);
  }
  [[nodiscard]] Eigen::Vector2d material_m(const Print& print) const {
    return at_material_m.value_or(print.material_m(mark));
  }
};

/// A line along warp or weft of the cloth, held on a straight line in space with a fixed slope.
struct Clamp {
  Eigen::Vector2d from_material_m, to_material_m;  ///< (warp, weft)
  Eigen::Vector3d from_in_world, to_in_world;
  Eigen::Vector3d
      direction_in_world;  ///< unit; the cloth leaves this way, towards larger coordinates
  std::optional<double> stated_place_m = std::nullopt;  ///< standard uncertainty along each axis

  /// Standard uncertainty of each end along each axis, m.
  [[nodiscard]] double place_m() const {
    return stated_place_m.value_or(ObjectUncertainty::ruler_m);
  }
};

/// Initial states of the simulated cloth.
enum class StartMode {
  flat_from_measured,  ///< flat and horizontal above the object, positioned by the measured marks
  measured,            ///< the measured sheet itself, with gaps filled
  flat,                ///< flat and horizontal, with centre and yaw given in the scene
};
template <>
inline constexpr std::string_view names_of<StartMode>[] = {"flat-from-measured", "measured",
                                                           "flat"};

struct Start {
  StartMode mode = StartMode::flat_from_measured;
  double clearance_m = 0;                          ///< height above the highest object
  std::optional<Eigen::Vector3d> centre_in_world;  ///< only for flat
  double yaw_rad = 0;                              ///< only for flat: from +x to the weft direction
  std::vector<std::string> history = {};  ///< loads applied beforehand; interpreted by simulate
};

/// One drape (scene.toml): the objects under the cloth, its start, and its fabric.
struct Scene {
  std::filesystem::path file;  ///< document.file()
  std::string name;
  std::string set;  ///< frame set of the recording that shows the drape; can be empty
  std::filesystem::path fabric_file;
  std::filesystem::path print_file;
  double table_z_m = 0;  ///< height of the table in the world frame
  double friction = 0;   ///< Coulomb coefficient between cloth and objects; 0 in the paper
  Eigen::Vector3d gravity_m_per_s2 = {0, 0, -9.80665};
  std::vector<Obstacle> obstacles;
  std::vector<ObjectUncertainty> uncertainties;  ///< one per obstacle; absent where not stated
  std::vector<ObjectTags> tags;                  ///< plates of tags, ordered like the objects
  std::optional<double> stated_table_uncertainty_m;
  std::optional<double> friction_uncertainty;  ///< standard uncertainty of `friction`
  std::optional<std::array<double, 2>> stated_friction_range;  ///< smallest and largest
  std::optional<double> stated_level_rad;  ///< standard uncertainty of the direction of gravity
  std::vector<Pin> pins;
  std::vector<Clamp> clamps;
  Start start;
  std::vector<std::string> stand_ins;  ///< values of this scene that were assumed, not measured

  Document document = {};  ///< the file as it was read
  [[nodiscard]] ObjectUncertainty uncertainty_of(std::size_t obstacle) const {
    return obstacle < uncertainties.size() ? uncertainties[obstacle] : ObjectUncertainty{};
  }
  [[nodiscard]] double table_uncertainty_m() const {
    return stated_table_uncertainty_m.value_or(ObjectUncertainty::ruler_m);
  }
  /// Smallest and largest friction: as stated; half and twice the value for a stand-in; nullopt if
  /// friction was measured.
  [[nodiscard]] std::optional<std::array<double, 2>> friction_range() const;
  /// Limits within which friction is varied: its range, else one standard uncertainty to each side.
  [[nodiscard]] std::array<double, 2> friction_ends() const;
  /// Standard uncertainty of a measured friction; 5 % if not stated.
  [[nodiscard]] double friction_u() const { return friction_uncertainty.value_or(0.05 * friction); }
  /// Standard uncertainty of the direction of gravity about each horizontal axis; if not stated,
  /// that of a spirit level, 1 mm per m.
  [[nodiscard]] double level_rad() const { return stated_level_rad.value_or(0.06 * units::deg); }
};

/// True if one of the stand-ins of a fabric or scene mentions `word`.
[[nodiscard]] bool names(const std::vector<std::string>& stand_ins, const std::string& word);

/// Range of friction: 0.1 to 1.0 on wood, metal, plastic and skin; 1.5 for coated cloth on rubber.
inline constexpr double kLeastFriction = 0.1, kMostFriction = 1.5;

/// True if gravity has the Earth's strength, as for any real drape.
[[nodiscard]] bool is_gravity_of_earth(const Scene& scene);

template <>
inline constexpr Format format_of<Scene>{"scene", Syntax::toml, 1, "scene.toml: one drape"};

void fields(Fields& f, Scene& scene);
[[nodiscard]] Scene read_scene(const std::filesystem::path& file);  ///< checked by rules.hpp

/// Table and objects as the file states them ("table_z_mm", "object.1.x_mm"), as text; a mesh is
/// represented by `hash_of` its file.
[[nodiscard]] std::map<std::string, std::string> surroundings_of(
    const Scene& scene, const std::function<std::string(const std::filesystem::path&)>& hash_of);

/// Rules about a file beyond those of its description. Each error names file, line, field and
/// remedy; an empty list means that the file describes a possible bench. read_scene(),
/// read_target() and read_print() apply them, so every program that measures or simulates does;
/// compare reads scenes as they were used.

/// Finds uncertainties wider than the object itself, and a drape without support.
[[nodiscard]] std::vector<Error> faults_of(const Scene& scene);
/// Finds objects whose position is incompatible with the table. Only `drape check` applies this, to
/// a scene as typed: a measured position that contradicts the table is a NO-GO of the measurement.
[[nodiscard]] std::vector<Error> faults_of_places(const Scene& scene);

/// Finds pins and clamps that lie outside the printed cloth or stretch the cloth between them too
/// far, and a start above the ceiling.
[[nodiscard]] std::vector<Error> faults_of(const Scene& scene, const Print& print);
/// Reads the scene's print and checks both against each other. Throws all errors at once.
[[nodiscard]] Print print_of(const Scene& scene);

/// Finds unknown tag families, repeated tag ids and tags that would overlap a dot.
[[nodiscard]] std::vector<Error> faults_of(const Target& target);
[[nodiscard]] std::vector<Error> faults_of(const Print& print);

/// Finds names in `stand_ins` that match no value of the file.
[[nodiscard]] std::vector<Error> faults_of_stand_ins(const Document& document,
                                                     std::vector<std::string> also_known = {});

/// Warns of values that are unusual but possible.
[[nodiscard]] std::vector<std::string> warnings_of(const Scene& scene);
[[nodiscard]] std::vector<std::string> warnings_of(const Print& print);

/// The tag families that detect supports, with the number of tags in each.
[[nodiscard]] std::vector<std::pair<std::string, int>> known_tag_families();

/// True if a target has half-turn symmetry, so that no picture distinguishes corner (0, 0) from the
/// opposite one: a chessboard with an even sum of rows and columns, or a grid of dots without tags
/// and hollow dots.
[[nodiscard]] bool is_ambiguous(const Target& target);

/// Uncertainty of a value: standard, or, if rectangular, the half-widths below and above it.
struct ValueWidth {
  double down = 0, up = 0;  ///< in the value's unit; per cent of a fabric value
  bool rectangular = false;
  std::string origin, remedy;
};

/// An uncertain value of a scene, with its name in sensitivity.json.
struct SceneValue {
  std::string name;
  ValueWidth width;
};

/// Lists them: level of the bench, positions of pins, clamps and objects, sizes, turns, friction.
/// `pin_m`: standard uncertainty of a pin whose position is that of its measured mark.
[[nodiscard]] std::vector<SceneValue> values_of(const Scene& scene,
                                                const std::function<double(const Pin&)>& pin_m);

/// Errors of stated values by name, each in its own unit. Besides the names of values_of():
/// start_x_mm, start_y_mm and start_yaw_deg of a flat start.
using ValueErrors = std::map<std::string, double>;
/// Error with this name; 0 if there is none.
[[nodiscard]] double error_of(const ValueErrors& errors, const std::string& name);
/// The scene with these errors in its stated values, in the frame of its file.
[[nodiscard]] Scene erring(Scene scene, const ValueErrors& errors);

/// The object shifted by `by_m`.
[[nodiscard]] Obstacle moved(Obstacle object, const Eigen::Vector3d& by_m);
/// The object turned about the vertical through its centre, or a mesh's origin.
[[nodiscard]] Obstacle turned(Obstacle object, double by_rad);
/// The object with each of its sizes increased by a length, its base unchanged. Planes and meshes
/// have no size of their own.
[[nodiscard]] Obstacle grown(Obstacle object, double by_m);

}  // namespace drape
