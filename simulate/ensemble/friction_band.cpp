// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/friction_band.hpp"

#include <Eigen/Geometry>
#include <array>

#include "core/units.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

/// Two horizontals and the vertical, x nearest to the first.
std::array<Vector3d, 3> axes_of(const Vector3d& gravity) {
  const Vector3d up = -gravity.normalized();
  const Vector3d beside = std::abs(up.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d first = (beside - beside.dot(up) * up).normalized();
  return {first, up.cross(first), up};
}

/// Follows gravity to `most` and back in equal steps; the report of the last.
StaticReport there_and_back(StaticSolver& solver, const Vector3d& gravity, const Vector3d& most,
                            int steps, const std::optional<double>& between) {
  StaticReport report;
  for (int k = 1; k <= 2 * steps; ++k) {
    const double part = static_cast<double>(k <= steps ? k : 2 * steps - k) / steps;
    solver.load(gravity + part * most);
    report = between && k < 2 * steps ? solver.solve_nearly(*between) : solver.solve();
    if (report.status != StaticStatus::at_rest) break;
  }
  return report;
}

}  // namespace

std::vector<FrictionPush> push_along(StaticSolver& solver, const Vector3d& per_weight, int steps,
                                     const std::optional<double>& between) {
  std::vector<FrictionPush> pushes;
  const Vector3d gravity = solver.options().gravity_m_per_s2;
  const Field rest = solver.position;
  const ClothMemory memory = solver.cloth().memory();
  const StaticContacts contacts = solver.contacts();
  const bool paced = solver.options().paced;
  if (between) solver.pace(false);
  const std::array<Vector3d, 3> axes = axes_of(gravity);
  for (int k = 0; k < 3; ++k) {
    if (per_weight[k] <= 0) continue;
    for (const double sign : {-1.0, 1.0}) {
      FrictionPush push;
      push.push_per_weight = sign * per_weight[k] * axes[k];
      push.report =
          there_and_back(solver, gravity, gravity.norm() * push.push_per_weight, steps, between);
      push.position = solver.position;
      push.memory = solver.cloth().memory();
      if (push.report.status != StaticStatus::at_rest) push.ending = "it does not come to rest";
      pushes.push_back(std::move(push));
      solver.contacts() = contacts;
      solver.position = rest;
      solver.cloth().remember(memory);
    }
  }
  solver.load(gravity);
  solver.pace(paced);
  return pushes;
}

FrictionBand push_at_rest(StaticSolver& solver, const StaticOptions& options,
                          const PushOptions& how) {
  const double per_weight = how.part * options.friction;
  return {options.friction, solver.position,
          push_along(solver, Vector3d::Constant(per_weight), how.steps, how.residual)};
}

Json marks_between(const Field& rest, const std::vector<const Field*>& ends, const GridSpec& grid,
                   const Print& print, Json& ends_json) {
  Json marks = Json::array();
  for (std::size_t i = 0; i < ends.size(); ++i)
    if (ends[i] != nullptr) ends_json[i]["moves_mm"] = Json::array();
  for (int k = 0; k < print.rows * print.cols; ++k) {
    const MarkId mark{k / print.cols, k % print.cols};
    const Hold place = hold_at(grid, print.material_m(mark));
    const Vector3d at_rest = mix(rest, place);
    Vector3d low = at_rest, high = at_rest;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (ends[i] == nullptr) continue;
      const Vector3d there = mix(*ends[i], place);
      low = low.cwiseMin(there);
      high = high.cwiseMax(there);
      ends_json[i]["moves_mm"].push_back(to_json_vector((there - at_rest) / mm));
    }
    marks.push_back({{"row", mark.row},
                     {"col", mark.col},
                     {"rest_mm", to_json_vector(at_rest / mm)},
                     {"low_mm", to_json_vector(low / mm)},
                     {"high_mm", to_json_vector(high / mm)}});
  }
  return marks;
}

void add_friction_band(const FrictionBand& band, const GridSpec& grid, const Print& print,
                       Json& json) {
  Json pushes = Json::array();
  std::vector<const Field*> ends;
  for (const FrictionPush& push : band.pushes) {
    pushes.push_back(
        {{"push_per_weight", to_json_vector(push.push_per_weight)}, {"ending", push.ending}});
    ends.push_back(push.counts() ? &push.position : nullptr);
  }
  const Json marks = marks_between(band.rest, ends, grid, print, pushes);
  json["friction_band"] = {{"friction", band.friction}, {"pushes", pushes}, {"marks", marks}};
}

}  // namespace drape::simulate
