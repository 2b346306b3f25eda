// SPDX-License-Identifier: Apache-2.0
// The equilibria of a scene, each before the checker and in the scene's own frame.
#include <algorithm>
#include <utility>

#include "simulate/checker/certify.hpp"
#include "simulate/ensemble/branches.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/world.hpp"

namespace drape::simulate {

using Eigen::Vector3d;

BranchResult simulate_branches(const Scene& scene, const Fabric& fabric, const Print& print,
                               const std::optional<Sheet>& measured, const SimulateOptions& options,
                               const BranchOptions& how) {
  options.check();
  const GridSpec grid{options.rows, options.cols, print.patch_m};
  SimulateReport report;
  const ClothLaws without = make_laws(fabric, options.segments, report, options.reach);
  ClothLaws laws = without;
  if (options.internal_friction)
    add_internal_friction(fabric, options.segments, laws, report, options.reach);
  const LocalScene local = local_scene(scene, measured, Surroundings(scene).top_z_m());
  const Surroundings surroundings(local.scene);
  const StaticCase the_case{local.scene, print, local.measured, surroundings, laws, options.mass};
  BranchResult result;
  Branches& branches = result.branches;
  branches = find_branches(the_case, without, grid, static_options(local.scene, options), how);
  SimulateOptions by_static = options;
  if (by_static.solver == Solver::rk4) by_static.solver = Solver::newton;
  const auto judge_as = [&](const SimulateOptions& as, const ClothLaws& its, const Field& position,
                            const ClothMemory& memory, const StaticReport& found, double friction) {
    SimulateResult judged;
    judged.report = report;
    finish_static({local.scene, print, local.measured, surroundings, its, options.mass}, fabric,
                  grid, as, {{}, position, found, found.iterations, memory}, judged);
    take_to_world(local, mass_kg(fabric, print, options), judged);
    Scene as_run = scene;
    as_run.friction = friction;
    judge_rest(judged, as_run, fabric, print, as);
    return judged;
  };
  const auto judge = [&](const auto& rest, double friction) {
    return judge_as(by_static, laws, rest.position, rest.memory, rest.report, friction);
  };
  std::vector<Branch> found;
  found.swap(branches.found);
  std::vector<std::pair<Branch, Sheet>> accepted;
  for (Branch& branch : found) {
    for (;;) {
      SimulateResult judged = judge(branch, branch.friction);
      if (judged.report.status == RestStatus::at_rest) {
        const double higher_j = local.gravity_offset_j(mass_kg(fabric, print, options));
        branch.energy_j += higher_j;
        for (Branch& other : branch.others) other.energy_j += higher_j;
        accepted.emplace_back(std::move(branch), std::move(judged.sheet));
        break;
      }
      branches.refused.push_back({branches.drop_lowest(branch), judged.report.sentence});
      if (branch.starts.empty()) break;
    }
  }
  std::stable_sort(accepted.begin(), accepted.end(), [](const auto& a, const auto& b) {
    return a.first.energy_j < b.first.energy_j;
  });
  for (auto& [branch, sheet] : accepted) {
    branches.found.push_back(std::move(branch));
    if (measured) sheet.no_go = measured->no_go;
    result.sheets.push_back(std::move(sheet));
  }
  if (branches.members.front().empty()) {
    branches.friction_band.reset();
    branches.memory_band.reset();
  }
  double same_m = how.same_m;
  if (branches.memory_band) {
    SimulateOptions by_means = by_static;
    by_means.internal_friction = false;
    MemoryBand& band = *branches.memory_band;
    same_m = band.reach_m(how.same_m);
    const int folds = label_hem(grid, band.rest).nodes;
    for (MemoryEnd& end : band.ends) {
      if (!end.counts()) continue;
      const SimulateResult judged =
          end.remembers ? judge(end, scene.friction)
                        : judge_as(by_means, without, end.position, {}, end.report, scene.friction);
      if (judged.report.status != RestStatus::at_rest) end.ending = judged.report.sentence;
      if (mean_distance_m(end.position, band.rest, branches.round) > same_m ||
          label_hem(grid, end.position).nodes != folds)
        end.ending = "on another branch";
    }
  }
  if (branches.friction_band) {
    for (FrictionPush& push : branches.friction_band->pushes) {
      if (!push.counts()) continue;
      const SimulateResult judged = judge(push, scene.friction);
      if (judged.report.status != RestStatus::at_rest) push.ending = judged.report.sentence;
      if (mean_distance_m(push.position, branches.friction_band->rest, branches.round) > same_m)
        push.ending = "on another branch";
    }
  }
  const auto take_there = [&](Field& field) {
    for (int i = 0, n = static_cast<int>(field.size() / 3); i < n; ++i)
      put_at(field, i, local.to_world(at(field, i)));
  };
  const auto turn = [&](Vector3d& direction) {
    direction = local.to_world(direction) - local.to_world(Vector3d::Zero());
  };
  for (Branch& branch : branches.found) take_there(branch.position);
  for (Field& member : branches.members) take_there(member);
  if (branches.memory_band) {
    take_there(branches.memory_band->rest);
    for (MemoryEnd& end : branches.memory_band->ends) {
      take_there(end.position);
      if (end.push_per_weight) turn(*end.push_per_weight);
    }
  }
  if (branches.friction_band) {
    take_there(branches.friction_band->rest);
    for (FrictionPush& push : branches.friction_band->pushes) {
      take_there(push.position);
      turn(push.push_per_weight);
    }
  }
  return result;
}

}  // namespace drape::simulate
