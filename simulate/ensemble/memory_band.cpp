// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/memory_band.hpp"

#include <algorithm>

#include "core/units.hpp"
#include "simulate/ensemble/friction_band.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/start/history.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

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
