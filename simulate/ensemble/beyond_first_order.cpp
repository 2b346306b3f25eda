// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/beyond_first_order.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "core/statistics/random.hpp"
#include "core/units.hpp"
#include "simulate/study/sensitivity.hpp"

namespace drape::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixX3d;
using Eigen::Vector3d;
using units::mm;

constexpr std::size_t kDrapes = 8;

MatrixX3d in_world(const LocalScene& local, const MatrixX3d& marks) {
  MatrixX3d places(marks.rows(), 3);
  for (Index k = 0; k < marks.rows(); ++k)
    places.row(k) = local.to_world(marks.row(k).transpose()).transpose();
  return places;
}

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
  const MatrixX3d rest_m = in_world(coarse.drape->local, member.marks);
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
    const MatrixX3d marks_m = in_world(other.drape->local, again.marks_of_level.back());
    if (marks_m.rows() != rest_m.rows() ||
        mean_distance_m(marks_m, rest_m, ensemble.round) > reach_m) {
      rest.ending = "on another branch";
      return;
    }
    rest.moves_m = rows_of(marks_m - rest_m);
    rest.first_order_m = rows_of(answered(split, errors));
  });
  return found;
}

}  // namespace drape::simulate
