// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/bands.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "core/parallel.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "simulate/start/history.hpp"
#include "simulate/study/sensitivity.hpp"

namespace drape::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixX3d;
using Eigen::Vector3d;
using units::mm;

constexpr double kPart = 0.5;      // fraction of friction and of the weight
constexpr double kBetween = 1e-2;  // residual before the last step, in mean weights of a point
constexpr int kPushSteps = 2;      // steps in which a push grows, and in which it is released

/// Two horizontal axes, x as close as possible to the first, and the vertical.
std::array<Vector3d, 3> axes_of(const Vector3d& gravity) {
  const Vector3d up = -gravity.normalized();
  const Vector3d beside = std::abs(up.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d first = (beside - beside.dot(up) * up).normalized();
  return {first, up.cross(first), up};
}

/// Equilibrium of the cloth after another loading history, in the frame of the case.
struct Other {
  OtherRest rest;
  MatrixX3d marks;
  int folds = 0;
};

/// Computes equilibria around that of the scene's own start.
class OtherRests {
 public:
  OtherRests(const Ensemble& ensemble, const EnsembleCase& coarse, int threads)
      : ensemble_(ensemble), coarse_(coarse), threads_(threads) {
    for (const MarkId mark : ensemble.marks)
      material_m_.push_back(coarse.drape->print.material_m(mark));
  }

  [[nodiscard]] const Member& own() const { return ensemble_.members.front(); }

  /// Adds pushes in both directions of each axis, by a multiple of the weight; 0 skips an axis.
  void add_pushes(const Vector3d& per_weight, const std::string& what) {
    const std::array<Vector3d, 3> axes = axes_of(coarse_.drape->local.scene.gravity_m_per_s2);
    for (std::size_t k = 0; k < axes.size(); ++k) {
      if (per_weight[static_cast<int>(k)] <= 0) continue;
      for (const double sign : {-1.0, 1.0}) {
        const Vector3d by = sign * per_weight[static_cast<int>(k)] * axes[k];
        tasks_.emplace_back([this, by, what] {
          Other other = continued(coarse_, own().drape.rest, what, [&](auto& level, auto& moment) {
            return push(level, moment, by);
          });
          const LocalScene& local = coarse_.drape->local;
          other.rest.push_per_weight = local.to_world(by) - local.to_world(Vector3d::Zero());
          return other;
        });
      }
    }
  }
  void add_without_memory(const FittedLaws& without) {
    tasks_.emplace_back([this, without] {
      ClothMoment moment = own().drape.rest;
      moment.memory = {};
      return continued(coarse_.with_laws(without), moment, "without internal friction, from there",
                       [](auto& level, auto& from) { return level.rest(from); });
    });
  }
  void add_drape(const std::function<void(Scene&)>& change, const std::string& what) {
    tasks_.emplace_back([this, change, what] {
      const EnsembleCase other = coarse_.with(change);
      const Drape drape = drape_cloth(*other.drape, other.options.drape);
      return other_of(other, *drape.level, drape.rest, drape.levels.back().rest, what);
    });
  }

  /// Runs all of them; returns the results in the order in which they were added.
  [[nodiscard]] std::vector<Other> made() {
    std::vector<Other> others(tasks_.size());
    parallel_for(tasks_.size(), threads_, [&](std::size_t k) { others[k] = tasks_[k](); });
    tasks_.clear();
    return others;
  }

  /// Determines which equilibria count, their moves, and the intervals that they span.
  void state(std::vector<Other> others, double reach_m, bool same_folds,
             std::vector<OtherRest>& rests, std::vector<MarkInterval>& intervals) const {
    const LocalScene& local = coarse_.drape->local;
    for (std::size_t k = 0; k < ensemble_.marks.size(); ++k) {
      const Vector3d place = local.to_world(own().marks.row(static_cast<Index>(k)).transpose());
      intervals.push_back({ensemble_.marks[k], place, place, place});
    }
    for (Other& other : others) {
      if (other.rest.ending == "at rest" &&
          (mean_distance_m(other.marks, own().marks, ensemble_.round) > reach_m ||
           (same_folds && other.folds != own().hem.nodes)))
        other.rest.ending = "on another branch";
      if (other.rest.ending == "at rest") {
        other.rest.moves_m.emplace();
        for (std::size_t k = 0; k < intervals.size(); ++k) {
          const Vector3d there = local.to_world(other.marks.row(static_cast<Index>(k)).transpose());
          intervals[k].low_in_world = intervals[k].low_in_world.cwiseMin(there);
          intervals[k].high_in_world = intervals[k].high_in_world.cwiseMax(there);
          other.rest.moves_m->push_back(there - intervals[k].rest_in_world);
        }
      }
      rests.push_back(std::move(other.rest));
    }
  }

 private:
  [[nodiscard]] Other other_of(const EnsembleCase& from, const DrapeLevel& level,
                               const ClothMoment& moment, const RestReport& report,
                               const std::string& what) const {
    Other other;
    other.rest.what = what;
    other.rest.ending = from.ending_of(level, moment, report);
    if (other.rest.ending != "at rest") return other;
    other.marks = level.places(moment, material_m_);
    other.folds = label_hem(level, moment).nodes;
    return other;
  }
  template <class Change>
  [[nodiscard]] Other continued(const EnsembleCase& from, ClothMoment moment,
                                const std::string& what, const Change& change) const {
    DrapeLevel level(*from.drape, from.options.drape, from.options.drape.spacing_m);
    const RestReport report = change(level, moment);
    return other_of(from, level, moment, report, what);
  }

  const Ensemble& ensemble_;
  const EnsembleCase& coarse_;
  int threads_;
  std::vector<Eigen::Vector2d> material_m_;
  std::vector<std::function<Other()>> tasks_;
};

/// Position of the equilibrium within the vertical interval, summed over the marks, from 0 (lowest)
/// to 1 (highest); nullopt if the interval is empty.
std::optional<double> place_of_rest(const std::vector<MarkInterval>& marks) {
  double below_m = 0, width_m = 0;
  for (const MarkInterval& mark : marks) {
    below_m += mark.rest_in_world.z() - mark.low_in_world.z();
    width_m += mark.high_in_world.z() - mark.low_in_world.z();
  }
  return width_m > 0 ? std::optional(below_m / width_m) : std::nullopt;
}

constexpr std::size_t kDrapes = 8;

std::vector<Vector3d> rows_of(const MatrixX3d& moves) {
  std::vector<Vector3d> rows;
  for (Index k = 0; k < moves.rows(); ++k) rows.push_back(moves.row(k).transpose());
  return rows;
}

/// Changes every value by one standard uncertainty, up or down at random.
ValueErrors coins(const ValueErrors& uncertainties, std::size_t seed) {
  SplitMix64 random(seed);
  ValueErrors errors = uncertainties;
  for (auto& [name, error] : errors)
    if (random.uniform() < 0.5) error = -error;
  return errors;
}

/// Sum of the first-order responses.
MatrixX3d answered(const SensitivityFile& split, const ValueErrors& errors) {
  MatrixX3d moves_m = MatrixX3d::Zero(static_cast<Index>(split.marks_at.size()), 3);
  const auto add = [&](const auto& effects) {
    for (const auto& one : effects)
      if (one.moves)
        moves_m += 0.5 * error_of(errors, one.value) / one.moves->step *
                   (one.moves->up_m - one.moves->down_m);
  };
  add(split.values);
  add(split.scene);
  return moves_m;
}

}  // namespace

std::vector<BandMark> band_of(const Ensemble& ensemble, const LocalScene& local) {
  std::vector<const Member*> members;
  for (const Member& member : ensemble.members)
    if (member.start >= 0 && member.rests()) members.push_back(&member);
  std::vector<BandMark> band;
  if (members.size() < kLeastMembers) return band;
  for (std::size_t k = 0; k < ensemble.marks.size(); ++k) {
    BandMark one;
    one.mark = ensemble.marks[k];
    std::vector<Vector3d> places;
    for (const Member* member : members)
      places.push_back(local.to_world(member->marks.row(static_cast<Index>(k)).transpose()));
    for (const Vector3d& p : places) one.mean_in_world += p / static_cast<double>(places.size());
    std::vector<double> distance_m;
    for (const Vector3d& p : places) distance_m.push_back((p - one.mean_in_world).norm());
    one.radius95_m = quantile(distance_m, 0.95);
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> along;
      for (const Vector3d& p : places) along.push_back(p[axis]);
      one.low_in_world[axis] = quantile(along, 0.025);
      one.high_in_world[axis] = quantile(along, 0.975);
    }
    band.push_back(one);
  }
  return band;
}

RestReport push(DrapeLevel& level, ClothMoment& moment, const Vector3d& per_weight) {
  const Vector3d gravity = level.drape().local.scene.gravity_m_per_s2;
  RestReport report;
  for (int k = 1; k <= 2 * kPushSteps; ++k) {
    const double part = static_cast<double>(std::min(k, 2 * kPushSteps - k)) / kPushSteps;
    level.set_gravity(gravity + part * gravity.norm() * per_weight);
    report = k < 2 * kPushSteps ? level.rest(moment, kBetween) : level.rest(moment);
    if (!report.at_rest) break;
  }
  level.set_gravity(gravity);
  return report;
}

OwnBands bands_of_own(const Ensemble& ensemble, const EnsembleCase& own, const FittedLaws& without,
                      const EnsembleOptions& how) {
  OwnBands bands;
  if (ensemble.members.empty() || !ensemble.members.front().rests()) return bands;
  const EnsembleCase coarse = own.with_levels(1);
  const DrapeCase& drape = *coarse.drape;
  OtherRests others(ensemble, coarse, how.threads);
  const bool touches = !DrapeLevel(drape, coarse.options.drape, coarse.options.drape.spacing_m)
                            .contact_forces(others.own().drape.rest)
                            .empty();
  double reach_m = how.same_m;
  if (drape.laws.friction) {
    others.add_without_memory(without);
    const double sideways = touches ? 0 : kPart;
    others.add_pushes({sideways, sideways, kPart}, "pushed and let go");
    std::vector<std::string> once_more = own.scene.start.history;
    const bool shaken = shakes_of(history_of(own.scene)).times > 0;
    once_more.insert(once_more.end() - (shaken ? 1 : 0), "draped 1 times");
    others.add_drape([once_more](Scene& scene) { scene.start.history = once_more; },
                     "draped once more");
    if (!own.scene.start.history.empty())
      others.add_drape([](Scene& scene) { scene.start.history.clear(); },
                       "as if it had no history");
    std::vector<Other> made = others.made();
    if (made.front().rest.ending == "at rest")
      reach_m = std::max(
          reach_m, 2 * mean_distance_m(made.front().marks, others.own().marks, ensemble.round));
    MemoryBand& band = bands.memory.emplace();
    others.state(std::move(made), reach_m, true, band.ends, band.marks);
    band.place_of_rest = place_of_rest(band.marks);
  }
  if (touches) {
    const double friction = own.scene.friction;
    others.add_pushes(Vector3d::Constant(kPart * friction), "");
    FrictionBand& band = bands.friction.emplace();
    band.friction = friction;
    others.state(others.made(), reach_m, false, band.pushes, band.marks);
    if (friction > 0) {
      for (const double end : own.scene.friction_ends())
        others.add_drape([end](Scene& scene) { scene.friction = end; },
                         fmt::format("friction {:g}", end));
      std::vector<MarkInterval> unused;
      others.state(others.made(), std::max(reach_m, ensemble.linked_m), false, band.ends, unused);
    }
  }
  return bands;
}

ValueErrors uncertainties_of(const Scene& scene, const Fabric& fabric, const Print& print) {
  ValueErrors errors;
  for (const auto& [name, width] : values_of(scene, [](const Pin&) { return 0.0; }))
    if (name != "friction") errors[name] = width.up;
  for (std::size_t v = 0; v < std::size(names_of<FabricValue>); ++v) {
    const bool stand_in = is_stand_in(fabric, static_cast<FabricValue>(v));
    errors[std::string(names_of<FabricValue>[v])] =
        100 * (stand_in ? kStandInPart / std::sqrt(3.0) : kMeasuredPart);
  }
  if (scene.start.mode == StartMode::flat) {
    errors["start_x_mm"] = errors["start_y_mm"] = ObjectUncertainty::ruler_m / mm;
    errors["start_yaw_deg"] =
        std::sqrt(2.0) * ObjectUncertainty::ruler_m / print.patch_m.maxCoeff() / units::deg;
  }
  return errors;
}

EnsembleCase erring(const EnsembleCase& own, const std::optional<Sheet>& measured,
                    const ValueErrors& errors) {
  EnsembleCase other = own;
  other.scene = drape::erring(own.scene, errors);
  for (std::size_t v = 0; v < std::size(names_of<FabricValue>); ++v)
    other.fitted.laws = scaled(other.fitted.laws, static_cast<FabricValue>(v),
                               1 + 0.01 * error_of(errors, std::string(names_of<FabricValue>[v])));
  other.drape = std::make_shared<const DrapeCase>(
      drape_case(other.scene, own.drape->print, measured, other.fitted.laws, own.options.outline));
  return other;
}

std::optional<BeyondFirstOrder> beyond_first_order(const Ensemble& ensemble,
                                                   const EnsembleCase& own,
                                                   const std::optional<Sheet>& measured,
                                                   const EnsembleOptions& how) {
  if (ensemble.members.empty() || !ensemble.members.front().rests()) return std::nullopt;
  const Member& member = ensemble.members.front();
  const EnsembleCase coarse = own.with_levels(1);
  const MatrixX3d rest_m = coarse.drape->local.rows_to_world(member.marks);
  Sheet places;
  for (std::size_t k = 0; k < ensemble.marks.size(); ++k) {
    SheetMark mark;
    mark.mark = ensemble.marks[k];
    mark.material_m = own.drape->print.material_m(mark.mark);
    mark.point_in_world = rest_m.row(static_cast<Index>(k));
    places.marks.push_back(mark);
  }
  Drape drape = member.drape;
  drape.level = std::make_shared<DrapeLevel>(*coarse.drape, coarse.options.drape,
                                             coarse.options.drape.spacing_m);
  const SensitivityFile split =
      sensitivities_of(coarse.result(std::move(drape)), own.fabric, places, {coarse.options});
  if (split.values.empty()) return std::nullopt;
  BeyondFirstOrder found{split.marks_at, std::vector<ErringRest>(kDrapes)};
  const ValueErrors uncertainties = uncertainties_of(own.scene, own.fabric, own.drape->print);
  const double reach_m = std::max(how.same_m, ensemble.linked_m);
  parallel_for(kDrapes, how.threads, [&](std::size_t k) {
    ErringRest& rest = found.rests[k];
    const ValueErrors errors = coins(uncertainties, k);
    const EnsembleCase other = erring(coarse, measured, errors);
    const Drape again = drape_cloth(*other.drape, other.options.drape);
    rest.ending = other.ending_of(*again.level, again.rest, again.levels.back().rest);
    if (rest.ending != "at rest") return;
    const MatrixX3d marks_m = other.drape->local.rows_to_world(again.marks_of_level.back());
    const MatrixX3d first_order_m = answered(split, errors);
    if (marks_m.rows() != rest_m.rows() ||
        mean_distance_m(marks_m, rest_m + first_order_m, ensemble.round) > reach_m) {
      rest.ending = "on another branch";
      return;
    }
    rest.moves_m = rows_of(marks_m - rest_m);
    rest.first_order_m = rows_of(first_order_m);
  });
  return found;
}

}  // namespace drape::simulate
