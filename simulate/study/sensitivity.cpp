// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/sensitivity.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

ForceCurve times(ForceCurve curve, double factor) {
  curve.slope *= factor;
  for (ForceCurve::Hinge& hinge : curve.hinges) hinge.change *= factor;
  return curve;
}

/// Derivative of the forces with respect to a relative change of the value. Forces are
/// proportional to it, so the difference to twice the value is exact.
VectorXd force_change(Cloth& cloth, const Field& position, FabricValue value,
                      const Vector3d& gravity) {
  const int n = cloth.count();
  VectorXd change(3 * n);
  if (value == FabricValue::areal_density) {
    for (int i = 0; i < n; ++i) change.segment<3>(3 * i) = cloth.mass_kg()[i] * gravity;
    return change;
  }
  Field once(position.size(), 0.0);
  Field twice(position.size(), 0.0);
  cloth.add_forces(position, nullptr, once);
  Cloth stronger(cloth.grid(), scaled(cloth.laws(), value, 2), MassRule::area);
  stronger.clamp(cloth.clamped_places());
  stronger.add_forces(position, nullptr, twice);
  for (int i = 0; i < n; ++i) change.segment<3>(3 * i) = at(twice, i) - at(once, i);
  return change;
}

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

std::string name_of(FabricValue value) {
  switch (value) {
    case FabricValue::tensile_warp:
      return "tensile_warp";
    case FabricValue::tensile_weft:
      return "tensile_weft";
    case FabricValue::shear:
      return "shear";
    case FabricValue::bending_warp:
      return "bending_warp";
    case FabricValue::bending_weft:
      return "bending_weft";
    case FabricValue::twist:
      return "twist";
    case FabricValue::areal_density:
      break;
  }
  return "areal_density";
}

bool is_stand_in(const Fabric& fabric, FabricValue value) {
  const std::string name = name_of(value);
  const std::string kind = name.substr(0, name.find('_'));
  if (value == FabricValue::twist && !fabric.bias_bending_n_m) return true;
  return std::any_of(fabric.stand_ins.begin(), fabric.stand_ins.end(),
                     [&](const std::string& what) {
                       const auto says = [&](const char* word) { return names({what}, word); };
                       if (what == "all") return true;
                       if (value == FabricValue::areal_density)
                         return says("areal density") || says("areal_density");
                       const bool bias = says("bias") || says("at 45") || says("twist");
                       if (value == FabricValue::twist) return bias;
                       // The curve's hysteresis is not the curve.
                       return says(kind.c_str()) && !bias && !says("hysteresis");
                     });
}

ClothLaws scaled(ClothLaws laws, FabricValue value, double factor) {
  switch (value) {
    case FabricValue::tensile_warp:
      laws.tensile[0] = times(laws.tensile[0], factor);
      break;
    case FabricValue::tensile_weft:
      laws.tensile[1] = times(laws.tensile[1], factor);
      break;
    case FabricValue::shear:
      laws.shear = times(laws.shear, factor);
      break;
    case FabricValue::bending_warp:
      laws.bending[0] = times(laws.bending[0], factor);
      break;
    case FabricValue::bending_weft:
      laws.bending[1] = times(laws.bending[1], factor);
      break;
    case FabricValue::twist:
      laws.twist_n_m *= factor;
      break;
    case FabricValue::areal_density:
      laws.density_kg_per_m2 *= factor;
      break;
  }
  return laws;
}

Reference reference_on(const GridSpec& grid, const Sheet& sheet) {
  constexpr double kBeyond = 1e-6;  // m
  Reference reference;
  for (const SheetMark& mark : sheet.marks) {
    const Eigen::Array2d m = mark.material_m.array();
    if ((m < -kBeyond).any() || (m > grid.patch_m.array() + kBeyond).any()) continue;
    if (!mark.point_in_world.allFinite()) continue;
    reference.marks.push_back(mark.mark);
    reference.points.push_back(hold_at(grid, mark.material_m));
    reference.in_world.push_back(mark.point_in_world);
  }
  if (reference.points.empty()) {
    throw bad_input("the reference sheet has no mark on the patch", {.field = "material_mm"},
                    "give the measured sheet of the same print");
  }
  return reference;
}

Eigen::MatrixX3d marks_on(const Reference& reference, const Field& position) {
  Eigen::MatrixX3d places(reference.points.size(), 3);
  for (std::size_t k = 0; k < reference.points.size(); ++k)
    places.row(static_cast<Eigen::Index>(k)) = mix(position, reference.points[k]);
  return places;
}

void add_moves(const MarkMoves& moves, Json& entry) {
  entry["step"] = moves.step;
  if (moves.half_width) entry["half_width"] = *moves.half_width;
  entry["down_mm"] = to_json(moves.down_m / units::mm);
  entry["up_mm"] = to_json(moves.up_m / units::mm);
}

double mean_distance_m(const Reference& reference, const Field& position) {
  double sum = 0;
  for (std::size_t k = 0; k < reference.points.size(); ++k) {
    sum += (mix(position, reference.points[k]) - reference.in_world[k]).norm();
  }
  return sum / static_cast<double>(reference.points.size());
}

double mean_moved_m(const Reference& from, const Field& from_position, const Reference& to,
                    const Field& to_position) {
  double sum = 0;
  for (std::size_t k = 0; k < from.points.size(); ++k) {
    sum += (mix(to_position, to.points[k]) - mix(from_position, from.points[k])).norm();
  }
  return sum / static_cast<double>(from.points.size());
}

std::optional<std::vector<Sensitivity>> find_sensitivities(Cloth& cloth, StaticSolver& solver,
                                                           const Vector3d& gravity_m_per_s2,
                                                           const Reference& reference) {
  std::vector<Sensitivity> list;
  for (const FabricValue value : kFabricValues) {
    Sensitivity one;
    one.value = value;
    const VectorXd change = force_change(cloth, solver.position, value, gravity_m_per_s2);
    const std::optional<VectorXd> up = solver.first_order_displacement(change);
    const std::optional<VectorXd> down = solver.first_order_displacement(-change);
    if (!up || !down) return std::nullopt;
    one.displacement = 0.5 * (*up - *down);
    const auto count = static_cast<double>(reference.points.size());
    MarkMoves moves{1, std::nullopt, {}, Eigen::MatrixX3d(reference.points.size(), 3)};
    for (std::size_t k = 0; k < reference.points.size(); ++k) {
      const Vector3d apart = mix(solver.position, reference.points[k]) - reference.in_world[k];
      const Vector3d displacement = mix_step(one.displacement, reference.points[k]);
      // A mark that lies on its reference only moves away from it.
      one.distance_m +=
          (apart.norm() > 0 ? apart.normalized().dot(displacement) : displacement.norm()) / count;
      one.mean_moved_m += displacement.norm() / count;
      one.largest_moved_m = std::max(one.largest_moved_m, displacement.norm());
      moves.up_m.row(static_cast<Eigen::Index>(k)) = 0.01 * displacement;
    }
    moves.down_m = -moves.up_m;
    one.moves = std::move(moves);
    list.push_back(std::move(one));
  }
  return list;
}

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
