// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/friction_band.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "core/units.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/start/history.hpp"
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

/// With the curves of a cloth that has none, from the rest on.
MemoryEnd without_friction(const StaticCase& the_case, const ClothLaws& without,
                           const GridSpec& grid, StaticSolver& from) {
  Cloth cloth(grid, without, the_case.mass);
  MemoryEnd end;
  end.what = "without internal friction, from there";
  end.remembers = false;
  const auto let_go = [&](const StaticOptions& options) {
    StaticSolver solver(cloth, the_case.surroundings, options);
    solver.contacts() = from.contacts();
    solver.position = from.position;
    solver.load(options.gravity_m_per_s2);
    end.report = solver.solve();
    end.position = solver.position;
  };
  StaticOptions how = from.options();
  let_go(how);
  if (has_to_meet_itself(grid, how, end.position, end.report)) {
    how.meets_itself = true;
    let_go(how);
  }
  return end;
}

/// The whole drape, after another history.
MemoryEnd draped_after(const std::vector<std::string>& history, const std::string& what,
                       const StaticCase& the_case, const GridSpec& grid,
                       const StaticOptions& options) {
  Scene scene = the_case.scene;
  scene.start.history = history;
  const StaticCase other{scene,         the_case.print, the_case.measured, the_case.surroundings,
                         the_case.laws, the_case.mass};
  StaticDrape drape = drape_statically(other, grid, options);
  return {what, "at rest", std::move(drape.position), std::move(drape.memory),
          std::move(drape.report)};
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

std::optional<double> MemoryBand::place_of_rest() const {
  double below = 0, width = 0;
  for (int i = 0, n = static_cast<int>(rest.size() / 3); i < n; ++i) {
    const double z = at(rest, i).z();
    double low = z, high = z;
    for (const MemoryEnd& end : ends) {
      if (!end.counts()) continue;
      low = std::min(low, at(end.position, i).z());
      high = std::max(high, at(end.position, i).z());
    }
    below += z - low;
    width += high - low;
  }
  return width > 0 ? std::optional(below / width) : std::nullopt;
}

double MemoryBand::reach_m(double least_m) const {
  for (const MemoryEnd& end : ends)
    if (!end.remembers && end.counts())
      return std::max(least_m, 2 * mean_distance_m(end.position, rest));
  return least_m;
}

MemoryBand ends_of_memory(const StaticCase& the_case, const ClothLaws& without,
                          const GridSpec& grid, StaticSolver& solver, const StaticOptions& options,
                          const StaticReport& found, const MemoryPushes& how) {
  MemoryBand band;
  band.rest = solver.position;
  band.ends.push_back(without_friction(the_case, without, grid, solver));
  const double sideways = found.touching + found.between > 0 ? 0 : how.part;
  for (FrictionPush& push : push_along(solver, {sideways, sideways, how.part}, how.steps)) {
    band.ends.push_back({"pushed and let go", push.ending, std::move(push.position),
                         std::move(push.memory), std::move(push.report), true,
                         push.push_per_weight});
  }
  std::vector<std::string> once_more = the_case.scene.start.history;
  const bool shaken = shakes_of(history_of(the_case.scene)).times > 0;
  once_more.insert(once_more.end() - (shaken ? 1 : 0), "draped 1 times");
  band.ends.push_back(draped_after(once_more, "draped once more", the_case, grid, options));
  if (!the_case.scene.start.history.empty())
    band.ends.push_back(draped_after({}, "as if it had no history", the_case, grid, options));
  for (MemoryEnd& end : band.ends)
    if (end.report.status != StaticStatus::at_rest) end.ending = "it does not come to rest";
  return band;
}

void add_memory_band(const MemoryBand& band, const GridSpec& grid, const Print& print, Json& json) {
  Json ends_json = Json::array();
  std::vector<const Field*> ends;
  for (const MemoryEnd& end : band.ends) {
    ends_json.push_back({{"what", end.what}, {"ending", end.ending}});
    if (end.push_per_weight)
      ends_json.back()["push_per_weight"] = to_json_vector(*end.push_per_weight);
    ends.push_back(end.counts() ? &end.position : nullptr);
  }
  const Json marks = marks_between(band.rest, ends, grid, print, ends_json);
  const std::optional<double> place = band.place_of_rest();
  json["internal_friction_band"] = {{"place_of_rest", place ? Json(*place) : Json(nullptr)},
                                    {"ends", ends_json},
                                    {"marks", marks}};
}

}  // namespace drape::simulate
