// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/sensitivity.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>

#include "core/scene.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixX3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kSmall = 1e-6;     // fraction of a step for differences of forces
constexpr double kAnswered = 5e-5;  // relative error of a response in energy
constexpr int kManySegments = 20;   // number of segments that represents the exact curve

/// Marks of the reference that are on the cloth.
struct Reference {
  std::vector<MarkId> marks;
  std::vector<Vector2d> material_m;
  MatrixX3d in_world;

  Reference(const Sheet& sheet, const DrapeLevel& level, const ClothMoment& rest) {
    std::vector<Vector2d> all_m;
    for (const SheetMark& mark : sheet.marks) all_m.push_back(mark.material_m);
    const MatrixX3d places = level.places(rest, all_m);
    std::vector<Vector3d> found;
    for (std::size_t k = 0; k < sheet.marks.size(); ++k) {
      const SheetMark& mark = sheet.marks[k];
      if (!places.row(static_cast<Index>(k)).allFinite() || !mark.point_in_world.allFinite())
        continue;
      marks.push_back(mark.mark);
      material_m.push_back(mark.material_m);
      found.push_back(mark.point_in_world);
    }
    if (marks.empty())
      throw bad_input("the reference sheet has no mark on the cloth", {.field = "material_mm"},
                      "give the measured sheet of the same print");
    in_world.resize(static_cast<Index>(found.size()), 3);
    for (std::size_t k = 0; k < found.size(); ++k)
      in_world.row(static_cast<Index>(k)) = found[k].transpose();
  }
  [[nodiscard]] double distance_m(const MatrixX3d& places) const {
    return (places - in_world).rowwise().norm().mean();
  }
};

double mean_m(const MatrixX3d& moves) {
  return moves.rowwise().norm().mean();
}

/// Changes one value of a drape, its level and its held points by an amount (SI).
struct Change {
  std::string name;
  double step = 0, unit = 1;         ///< SI; unit of the name
  std::optional<double> half_width;  ///< stand-in's interval, SI
  std::function<void(DrapeCase&, DrapeLevel&, MeshCloth::State&, double)> apply;
};

/// Another version of a part of the model.
struct Variant {
  std::string what;
  std::function<void(DrapeCase&, DrapeOptions&)> apply;
  bool same_mesh = true;
};

/// A drape at rest, from which responses are computed.
class Base {
 public:
  Base(const SimulateResult& result, const Fabric& fabric, const Sheet& reference,
       const SensitivityOptions& options)
      : case_(*result.drape_case),
        fabric_(fabric),
        options_(options),
        level_(*result.drape->level),
        rest_(result.drape->rest),
        reference_(reference, level_, rest_),
        base_m_(places(level_, rest_)) {}

  void describe(SensitivityFile& file) const {
    file.spacing_m = level_.spacing_m();
    file.marks_at = reference_.marks;
    file.marks = static_cast<int>(reference_.marks.size());
    file.distance_m = reference_.distance_m(base_m_);
  }

  /// Computes the sensitivities to fabric values, then scene values; none if the base is a saddle.
  void find(SensitivityFile& file) {
    constexpr std::size_t kValues = std::size(names_of<FabricValue>);
    const std::vector<Change> changes = scene_changes();
    std::vector<MeshCloth::State> forces, held;
    for (std::size_t i = 0; i < kValues; ++i)
      forces.push_back(force_change(level_, rest_, static_cast<FabricValue>(i)));
    DrapeCase probed = case_;
    DrapeLevel probe(probed, options_.simulate.drape, level_.spacing_m());
    for (const Change& change : changes) difference(change, probed, probe, forces, held);
    forces.push_back(force_change(level_, rest_, laws(kManySegments, false)));
    const auto ways = level_.first_order(rest_, forces, kAnswered);
    if (!ways) return;
    for (std::size_t i = 0; i < kValues; ++i) {
      const auto value = static_cast<FabricValue>(i);
      const MatrixX3d up_m = moved((*ways)[i], 0.01);
      file.values.push_back({std::string(name_of(value)), change_of_distance_m(up_m), mean_m(up_m),
                             MarkMoves{1, std::nullopt, -up_m, up_m}});
      if (is_stand_in(fabric_, value)) file.values.back().moves->half_width = 100 * kStandInPart;
    }
    const MatrixX3d finer_m = moved(ways->back(), 1);
    file.scene.push_back({"curve_segments",
                          change_of_distance_m(finer_m),
                          MarkMoves{1, 1.0, -finer_m, finer_m},
                          {}});
    for (std::size_t k = 0; k < changes.size(); ++k) {
      MeshCloth::State way = (*ways)[kValues + k];
      for (std::size_t i = 0; i < way.size(); ++i) way[i] += held[k][i];
      const MatrixX3d up_m = moved(way, 1);
      const double steps = changes[k].step / changes[k].unit;
      file.scene.push_back({changes[k].name,
                            change_of_distance_m(up_m) / steps,
                            MarkMoves{steps, std::nullopt, -up_m, up_m},
                            {}});
      if (changes[k].half_width)
        file.scene.back().moves->half_width = *changes[k].half_width / changes[k].unit;
    }
  }

  void find_variants(SensitivityFile& file) const {
    if (has_loops()) file.scene.push_back(loops());
    for (const Variant& variant : variants()) {
      DrapeCase changed = case_;
      DrapeOptions how = options_.simulate.drape;
      variant.apply(changed, how);
      if (variant.same_mesh) file.variants.push_back(row(variant, true, rested(changed)));
      const Drape again = drape_cloth(changed, how);
      file.variants.push_back(
          row(variant, false,
              again.at_rest() ? std::optional(places(*again.level, again.rest)) : std::nullopt));
    }
  }

 private:
  [[nodiscard]] MatrixX3d places(const DrapeLevel& level, const ClothMoment& moment) const {
    return case_.local.rows_to_world(level.places(moment, reference_.material_m));
  }

  /// Positions of the marks when a changed case, started from the base, has come to rest.
  [[nodiscard]] std::optional<MatrixX3d> rested(const DrapeCase& changed) const {
    ClothMoment moment = rest_;
    DrapeLevel level(changed, options_.simulate.drape, level_.spacing_m());
    if (changed.laws.friction && !case_.laws.friction) moment.memory = level.cloth().memory();
    if (!level.rest(moment).at_rest) return std::nullopt;
    return places(level, moment);
  }

  /// Displacement of the marks for a fraction of a displacement of the unknowns.
  [[nodiscard]] MatrixX3d moved(const MeshCloth::State& way, double part) const {
    ClothMoment there = rest_;
    for (std::size_t i = 0; i < way.size(); ++i) there.state[i] += part * way[i];
    return places(level_, there) - base_m_;
  }

  /// Change of the mean distance. A mark that coincides with its reference can only move away.
  [[nodiscard]] double change_of_distance_m(const MatrixX3d& moves) const {
    const MatrixX3d away_m = base_m_ - reference_.in_world;
    double sum = 0;
    for (Index k = 0; k < moves.rows(); ++k) {
      const double far = away_m.row(k).norm();
      sum += far > 0 ? moves.row(k).dot(away_m.row(k)) / far : moves.row(k).norm();
    }
    return sum / static_cast<double>(moves.rows());
  }

  /// Adds the change of forces due to a step of a value, and the displacement of held points.
  /// `probe` is a level of `probed`, which is restored to the base's case.
  void difference(const Change& change, DrapeCase& probed, DrapeLevel& probe,
                  std::vector<MeshCloth::State>& forces,
                  std::vector<MeshCloth::State>& held) const {
    forces.emplace_back(rest_.state.size(), Vector3d::Zero());
    held.emplace_back(rest_.state.size(), Vector3d::Zero());
    for (const double side : {1, -1}) {
      ClothMoment moment = rest_;
      change.apply(probed, probe, moment.state, side * kSmall * change.step);
      const MeshCloth::State force = probe.forces(moment);
      for (std::size_t i = 0; i < force.size(); ++i) {
        forces.back()[i] += side / (2 * kSmall) * force[i];
        held.back()[i] += side / (2 * kSmall) * (moment.state[i] - rest_.state[i]);
      }
      probed.around = case_.around;
      probed.local.scene.obstacles = case_.local.scene.obstacles;
      probe.set_friction(case_.local.scene.friction);
      probe.set_gravity(case_.local.scene.gravity_m_per_s2);
    }
  }

  [[nodiscard]] Vector3d local_axis(int axis) const {
    return Eigen::AngleAxisd(-case_.local.yaw_rad, Vector3d::UnitZ()) * Vector3d::Unit(axis);
  }

  [[nodiscard]] std::vector<Change> scene_changes() const {
    std::vector<Change> all;
    const Scene& scene = case_.local.scene;
    const auto along_axes = [&](const std::string& name, double u_m, const auto& move) {
      for (int axis = 0; axis < 3; ++axis)
        all.push_back({fmt::format("{}_{}_mm", name, "xyz"[axis]), u_m, mm, std::nullopt,
                       [=, along = local_axis(axis)](DrapeCase& drape, DrapeLevel&,
                                                     MeshCloth::State& state, double by_m) {
                         move(drape, state, Vector3d(by_m * along));
                       }});
    };
    for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
      const std::string name = fmt::format("object_{}", i + 1);
      along_axes(name, scene.uncertainty_of(i).place_m(),
                 [i](DrapeCase& drape, MeshCloth::State&, const Vector3d& by_m) {
                   Obstacle& object = drape.local.scene.obstacles[i];
                   object = drape::moved(object, by_m);
                   drape.around = std::make_shared<Surroundings>(drape.local.scene, kClosed_m);
                 });
      if (const auto turn = turn_rad(scene.obstacles[i], scene.uncertainty_of(i)))
        all.push_back({name + "_turn_deg", *turn, units::deg, std::nullopt,
                       [i](DrapeCase& drape, DrapeLevel&, MeshCloth::State&, double by_rad) {
                         Obstacle& object = drape.local.scene.obstacles[i];
                         object = turned(object, by_rad);
                         drape.around =
                             std::make_shared<Surroundings>(drape.local.scene, kClosed_m);
                       }});
      if (std::holds_alternative<Plane>(scene.obstacles[i]) ||
          std::holds_alternative<MeshObject>(scene.obstacles[i]))
        continue;
      all.push_back({name + "_size_mm", scene.uncertainty_of(i).size_m(), mm, std::nullopt,
                     [i](DrapeCase& drape, DrapeLevel&, MeshCloth::State&, double by_m) {
                       Obstacle& object = drape.local.scene.obstacles[i];
                       object = grown(object, by_m);
                       drape.around = std::make_shared<Surroundings>(drape.local.scene, kClosed_m);
                     }});
    }
    if (scene.friction > 0) all.push_back(friction_change());
    for (std::size_t k = 0; k < case_.pins_at.size(); ++k)
      along_axes(
          fmt::format("pin_{}", k + 1), ObjectUncertainty::ruler_m,
          [point = static_cast<std::size_t>(level_.pinned()[k])](
              DrapeCase&, MeshCloth::State& state, const Vector3d& by_m) { state[point] += by_m; });
    for (std::size_t k = 0; k < case_.lines.size(); ++k)
      along_axes(fmt::format("clamp_{}", k + 1), ObjectUncertainty::ruler_m,
                 [k, this](DrapeCase&, MeshCloth::State& state, const Vector3d& by_m) {
                   const auto& points = level_.cloth().mesh().points_m;
                   for (std::size_t i = 0; i < points.size(); ++i)
                     if (case_.lines[k].holds(points[i])) state[i] += by_m;
                 });
    for (int axis = 0; axis < 2; ++axis)
      all.push_back({fmt::format("level_{}_deg", "xy"[axis]), 0.1 * units::deg, units::deg,
                     std::nullopt,
                     [gravity = scene.gravity_m_per_s2, along = local_axis(axis)](
                         DrapeCase&, DrapeLevel& level, MeshCloth::State&, double by_rad) {
                       level.set_gravity(Eigen::AngleAxisd(by_rad, along) * gravity);
                     }});
    return all;
  }

  [[nodiscard]] Change friction_change() const {
    const Scene& scene = case_.local.scene;
    const bool stand_in = !scene.friction_uncertainty && names(scene.stand_ins, "friction");
    const double step = stand_in
                            ? kStandInPart * scene.friction
                            : scene.friction_uncertainty.value_or(kMeasuredPart * scene.friction);
    return {"friction", step, 1, stand_in ? std::optional(step) : std::nullopt,
            [friction = scene.friction](DrapeCase&, DrapeLevel& level, MeshCloth::State&,
                                        double by) { level.set_friction(friction + by); }};
  }

  [[nodiscard]] ClothLaws laws(int segments, bool internal_friction) const {
    return fit_laws(fabric_, segments, options_.simulate.reach, internal_friction).laws;
  }
  [[nodiscard]] bool has_loops() const {
    if (options_.simulate.internal_friction) return false;
    const ClothFriction friction = laws(1, true).friction.value();
    return !friction.shear.empty() || !friction.bending[0].empty() || !friction.bending[1].empty();
  }

  /// Effect of averaging the hysteresis loops. Cloth with both branches that came here without
  /// reversal is at one end of the interval left by its history, this drape near the middle.
  [[nodiscard]] SceneEffect loops() const {
    SceneEffect effect{"internal_friction"};
    DrapeCase changed = case_;
    changed.laws = laws(options_.simulate.segments, true);
    const auto there = rested(changed);
    if (!there) {
      effect.absent = "no rest with both branches of the loops";
      return effect;
    }
    const MatrixX3d up_m = *there - base_m_;
    effect.change_m_per_unit = reference_.distance_m(*there) - reference_.distance_m(base_m_);
    effect.moves = MarkMoves{1, 1.0, -up_m, up_m};
    return effect;
  }

  [[nodiscard]] std::vector<Variant> variants() const {
    const SimulateOptions& how = options_.simulate;
    std::vector<Variant> all = {
        {"no twist stiffness", [](DrapeCase& drape, DrapeOptions&) { drape.laws.twist_n_m = 0; }},
        {"friction halved",
         [](DrapeCase& drape, DrapeOptions&) { drape.local.scene.friction *= 0.5; }},
        {"friction doubled",
         [](DrapeCase& drape, DrapeOptions&) { drape.local.scene.friction *= 2; }}};
    const int segments = how.segments == 1 ? 5 : 1;
    all.push_back({fmt::format("{} segments per curve", segments),
                   [this, segments](DrapeCase& drape, DrapeOptions&) {
                     drape.laws = laws(segments, options_.simulate.internal_friction);
                   }});
    if (has_loops())
      all.push_back({"with internal friction", [this](DrapeCase& drape, DrapeOptions&) {
                       drape.laws = laws(options_.simulate.segments, true);
                     }});
    all.push_back({fmt::format("spacing {:g} mm", 2 * how.drape.spacing_m / mm),
                   [](DrapeCase&, DrapeOptions& coarser) { coarser.spacing_m *= 2; }, false});
    return all;
  }

  [[nodiscard]] VariantEffect row(const Variant& variant, bool continued,
                                  const std::optional<MatrixX3d>& there) const {
    VariantEffect effect{variant.what, continued, there.has_value()};
    if (!there) return effect;
    effect.distance_m = reference_.distance_m(*there);
    effect.change_m = effect.distance_m - reference_.distance_m(base_m_);
    effect.moved_m = mean_m(*there - base_m_);
    return effect;
  }

  const DrapeCase& case_;
  const Fabric& fabric_;
  const SensitivityOptions& options_;
  DrapeLevel& level_;
  const ClothMoment& rest_;
  Reference reference_;
  MatrixX3d base_m_;  ///< positions of the marks at the base's equilibrium
};

}  // namespace

bool is_stand_in(const Fabric& fabric, FabricValue value) {
  const std::string name(name_of(value));
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
                       // A stand-in for a curve's hysteresis does not make the curve one.
                       return says(kind.c_str()) && !bias && !says("hysteresis");
                     });
}

ClothLaws scaled(ClothLaws laws, FabricValue value, double factor) {
  if (value == FabricValue::twist) laws.twist_n_m *= factor;
  if (value == FabricValue::areal_density) laws.density_kg_per_m2 *= factor;
  ForceCurve* const curves[] = {&laws.tensile[0], &laws.tensile[1], &laws.shear, &laws.bending[0],
                                &laws.bending[1]};  // in the order of FabricValue
  const auto k = static_cast<std::size_t>(value);
  if (k >= std::size(curves)) return laws;
  curves[k]->slope *= factor;
  for (ForceCurve::Hinge& hinge : curves[k]->hinges) hinge.change *= factor;
  return laws;
}

MeshCloth::State force_change(const DrapeLevel& level, const ClothMoment& rest, FabricValue value) {
  const MeshCloth& cloth = level.cloth();
  if (value != FabricValue::areal_density)
    return force_change(level, rest, scaled(cloth.laws(), value, 2));
  MeshCloth::State change(static_cast<std::size_t>(cloth.unknowns()), Vector3d::Zero());
  for (std::size_t i = 0; i < cloth.mass_kg().size(); ++i)
    change[i] = cloth.mass_kg()[i] * level.drape().local.scene.gravity_m_per_s2;
  return change;
}

MeshCloth::State force_change(const DrapeLevel& level, const ClothMoment& rest, ClothLaws laws) {
  const MeshCloth& cloth = level.cloth();
  ClothLaws own = cloth.laws();
  own.friction.reset();
  laws.friction.reset();
  MeshCloth::State change(static_cast<std::size_t>(cloth.unknowns()), Vector3d::Zero());
  MeshCloth::State once = change;
  MeshCloth(cloth.mesh(), own, cloth.in_triangles()).add_forces(rest.state, once);
  MeshCloth(cloth.mesh(), std::move(laws), cloth.in_triangles()).add_forces(rest.state, change);
  for (std::size_t i = 0; i < change.size(); ++i) change[i] -= once[i];
  return change;
}

SensitivityFile sensitivities_of(const SimulateResult& result, const Fabric& fabric,
                                 const Sheet& reference, const SensitivityOptions& options) {
  SensitivityFile file;
  file.segments = options.simulate.segments;
  file.model = std::get<SimulatedSource>(result.sheet.source).model;
  file.no_go = reference.no_go;
  file.status = result.certificate.status;
  Base base(result, fabric, reference, options);
  base.describe(file);
  if (!result.at_rest()) return file;
  base.find(file);
  if (options.variants) base.find_variants(file);
  return file;
}

}  // namespace drape::simulate
