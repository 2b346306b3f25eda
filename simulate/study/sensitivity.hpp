// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/equilibrium/run.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {

/// The values of a fabric that an equilibrium depends on. Each scales a whole law.
enum class FabricValue {
  tensile_warp,
  tensile_weft,
  shear,
  bending_warp,
  bending_weft,
  twist,
  areal_density
};
inline constexpr FabricValue kFabricValues[] = {
    FabricValue::tensile_warp, FabricValue::tensile_weft, FabricValue::shear,
    FabricValue::bending_warp, FabricValue::bending_weft, FabricValue::twist,
    FabricValue::areal_density};

[[nodiscard]] std::string name_of(FabricValue value);
/// A value that nobody measured lies within half of what was put in its place; a measured Kawabata
/// value repeats within 5 % (one standard deviation). Both are stated, not derived.
inline constexpr double kStandInPart = 0.5, kMeasuredPart = 0.05;
/// Twist is one where no bending at 45 degrees was measured.
[[nodiscard]] bool is_stand_in(const Fabric& fabric, FabricValue value);
/// The laws with one value times `factor`.
[[nodiscard]] ClothLaws scaled(ClothLaws laws, FabricValue value, double factor);

/// Marks of a reference sheet as material points of a grid.
struct Reference {
  std::vector<MarkId> marks;
  std::vector<Hold> points;
  std::vector<Eigen::Vector3d> in_world;
};
/// Leaves out marks that lie beyond the patch of `grid`. Throws Error when none is left.
[[nodiscard]] Reference reference_on(const GridSpec& grid, const Sheet& sheet);
/// Where the marks lie on a sheet, one row each (m, world).
[[nodiscard]] Eigen::MatrixX3d marks_on(const Reference& reference, const Field& position);
/// Mean over the marks of the distance between reference and sheet (m).
[[nodiscard]] double mean_distance_m(const Reference& reference, const Field& position);
/// Mean over the marks of their displacement from one sheet to another, each with its own grid (m).
[[nodiscard]] double mean_moved_m(const Reference& from, const Field& from_position,
                                  const Reference& to, const Field& to_position);

/// Displacement of the marks (rows as Reference, m) for a value lower and higher by `step`.
struct MarkMoves {
  double step = 0;                   ///< in the unit of the value's sensitivity
  std::optional<double> half_width;  ///< a stand-in's: the true value lies within, same unit
  Eigen::MatrixX3d down_m, up_m;
};
/// Adds step, down_mm and up_mm, and half_width where there is one.
void add_moves(const MarkMoves& moves, Json& entry);

/// Change of an equilibrium when one value of the fabric grows, to first order.
struct Sensitivity {
  FabricValue value = FabricValue::tensile_warp;
  Eigen::VectorXd displacement;  ///< m per relative change; x, y, z of each particle in turn
  double distance_m = 0;         ///< change of the mean distance per relative change
  double mean_moved_m = 0;       ///< mean displacement of the marks per relative change
  double largest_moved_m = 0;    ///< largest displacement of a mark
  /// By one per cent to first order; of a stand-in, by its half-width; absent where the cloth did
  /// not come to rest there.
  std::optional<MarkMoves> moves;
};

/// H dx = (derivative of the forces), for a growing and for a shrinking value, and the mean of the
/// two. What presses goes on pressing and what sticks sticks; what slides goes on where the change
/// draws it on and sticks where it draws it back, with a limit that stays that of the equilibrium.
/// `solver` must stand at an equilibrium of `cloth`; nothing when its Hessian is not positive
/// definite there (a saddle, or the end of a branch).
[[nodiscard]] std::optional<std::vector<Sensitivity>> find_sensitivities(
    Cloth& cloth, StaticSolver& solver, const Eigen::Vector3d& gravity_m_per_s2,
    const Reference& reference);

/// Answer of the mean distance from the reference to a measured value of the scene.
struct SceneEffect {
  /// "friction", "object_1_x_mm", "object_1_size_mm"; "internal_friction" (of the fabric): 0
  /// without, 1 with, -1 as far in the other direction
  std::string value;
  std::optional<double> change_per_unit;  ///< m per unit; absent when a drape did not come to rest
  MarkMoves moves;
};

/// Where the marks of a drape come to rest, one row each (m, world), and their mean distance from
/// the reference (m).
struct RestedMarks {
  Eigen::MatrixX3d places_m;
  double distance_m = 0;
};

/// Drapes the scene with one value changed by its standard uncertainty, up and down: place (x, y,
/// z) and size of each object, and friction; a stand-in by its half-width. `drape` gives nothing
/// where the cloth does not come to rest; `base_m`: where the marks lie on the unchanged drape.
[[nodiscard]] std::vector<SceneEffect> scene_effects(
    const Scene& scene, const std::function<std::optional<RestedMarks>(const Scene&)>& drape,
    const Eigen::MatrixX3d& base_m);

/// Array of {value, mean_distance_mm_per_unit, step, down_mm, up_mm}, without the absent ones.
[[nodiscard]] Json scene_effects_json(const std::vector<SceneEffect>& effects);

}  // namespace drape::simulate
