// SPDX-License-Identifier: Apache-2.0
// Steps from measured sheets to virtual ones.
#include <fmt/format.h>

#include <algorithm>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "front/plan_bench.hpp"

namespace drape::plan {
namespace {

namespace fs = std::filesystem;

constexpr int kEnsembleGrid = 15;  // particles per side, at most

/// What a drape and its ensemble have in common.
std::vector<std::string> drape_arguments(const Bench& bench, const Drape& drape, int grid,
                                         int segments, const fs::path& out) {
  std::vector<std::string> arguments = {drape.scene_file().string(),
                                        "--fabric",
                                        drape.scene.fabric_file.string(),
                                        "--grid",
                                        std::to_string(grid),
                                        "--segments",
                                        std::to_string(segments),
                                        "--start-from",
                                        (drape.folder / "sheet.ply").string(),
                                        "--out",
                                        out.string(),
                                        "--threads",
                                        "1",
                                        "--json"};
  if (bench.options.internal_friction) arguments.emplace_back("--internal-friction");
  return arguments;
}

/// The segments that speak for a drape: five, else the most.
int headline_segments(const Rig& rig) {
  const bool five = std::find(rig.segments.begin(), rig.segments.end(), 5) != rig.segments.end();
  return five ? 5 : *std::max_element(rig.segments.begin(), rig.segments.end());
}

fs::path refinement_file(const Drape& drape) {
  return drape.folder / "refined" / "refinement.json";
}

fs::path ensemble_file(const Drape& drape) {
  return drape.folder / "ensemble" / "branches.json";
}

}  // namespace

fs::path simulation_folder(const Drape& drape, int grid, int segments) {
  return drape.folder / "simulations" / fmt::format("{}-{}", grid, segments);
}

Group simulate_group(const Bench& bench) {
  Group group{"simulate", {}, bench.options.threads};
  for (const int grid : bench.rig.grids) {
    for (const Drape& drape : bench.drapes) {
      for (const int segments : bench.rig.segments) {
        const fs::path folder = simulation_folder(drape, grid, segments);
        std::vector<std::string> arguments = drape_arguments(bench, drape, grid, segments, folder);
        arguments.insert(arguments.end(), {"--solver", "fall"});
        group.steps.push_back(step("simulate",
                                   fmt::format("{}, {}x{}, {} segment{}", drape.scene.name, grid,
                                               grid, segments, segments == 1 ? "" : "s"),
                                   std::move(arguments), folder / "sheet.ply",
                                   static_cast<double>(grid) * grid * grid));
        group.steps.back().drape = drape.scene.name;
      }
    }
  }
  // The longest first, so that no core waits for the last one.
  std::stable_sort(group.steps.begin(), group.steps.end(),
                   [](const Step& a, const Step& b) { return a.weight > b.weight; });
  return group;
}

Group refine_group(const Bench& bench) {
  Group group{"refine", {}, bench.options.threads};
  const int finest = *std::max_element(bench.rig.grids.begin(), bench.rig.grids.end());
  for (const Drape& drape : bench.drapes) {
    const fs::path file = refinement_file(drape);
    std::vector<std::string> arguments = {
        simulation_folder(drape, finest, headline_segments(bench.rig)).string(),
        "--scene",
        drape.scene_file().string(),
        "--fabric",
        drape.scene.fabric_file.string(),
        "--start-from",
        (drape.folder / "sheet.ply").string(),
        "--out",
        file.parent_path().string(),
        "--threads",
        "1",
        "--json"};
    if (bench.options.finest) {
      arguments.emplace_back("--finest");
      arguments.push_back(std::to_string(*bench.options.finest));
    }
    group.steps.push_back(step("refine", "drape " + drape.scene.name, std::move(arguments), file));
    group.steps.back().drape = drape.scene.name;
  }
  return group;
}

std::optional<fs::path> refined_sheet(const Bench& bench, const Drape& drape,
                                      const std::set<fs::path>& failed) {
  const fs::path list = refinement_file(drape);
  if (!bench.refines() || failed.count(run_record_path(list)) != 0 || !fs::is_regular_file(list))
    return std::nullopt;
  const JsonNode root = JsonNode::open(list, "refinement", 1);
  const std::optional<double> used = root.optional_number("used");
  const std::vector<JsonNode> grids = root.items("grids");
  if (!used || !(*used >= 0 && *used < static_cast<double>(grids.size()))) return std::nullopt;
  const JsonNode& grid = grids[static_cast<std::size_t>(*used)];
  return name_inside(list.parent_path(), grid.text("sheet"), grid.where("sheet"));
}

Group ensemble_group(const Bench& bench) {
  Group group{"branches", {}, bench.options.threads};
  const int finest = *std::max_element(bench.rig.grids.begin(), bench.rig.grids.end());
  const int grid = std::min(kEnsembleGrid, finest);
  for (const Drape& drape : bench.drapes) {
    std::vector<std::string> arguments = drape_arguments(
        bench, drape, grid, headline_segments(bench.rig), ensemble_file(drape).parent_path());
    group.steps.push_back(step("branches",
                               fmt::format("{}, {}x{}, ensemble", drape.scene.name, grid, grid),
                               std::move(arguments), ensemble_file(drape)));
    group.steps.back().drape = drape.scene.name;
  }
  return group;
}

std::vector<fs::path> branch_sheets(const Bench& bench, const Drape& drape,
                                    const std::set<fs::path>& failed) {
  const fs::path list = ensemble_file(drape);
  if (bench.options.single || failed.count(run_record_path(list)) != 0 ||
      !fs::is_regular_file(list))
    return {};
  std::vector<fs::path> sheets;
  for (const JsonNode& branch : JsonNode::open(list, "branches", 1).items("branches"))
    sheets.push_back(name_inside(list.parent_path(), branch.text("sheet"), branch.where("sheet")));
  return sheets;
}

Group sensitivity_group(const Bench& bench) {
  constexpr int kGrid = 21;
  Group group{"sensitivity", {}, bench.options.threads};
  const int chosen = headline_segments(bench.rig);
  // One of the rig's own, so that U speaks of a drape that is compared.
  int grid = *std::min_element(bench.rig.grids.begin(), bench.rig.grids.end());
  for (const int one : bench.rig.grids)
    if (one <= kGrid) grid = std::max(grid, one);
  for (const Drape& drape : bench.drapes) {
    const fs::path folder = drape.folder / "sensitivity";
    group.steps.push_back(
        step("sensitivity", "drape " + drape.scene.name,
             {drape.scene_file().string(), "--fabric", drape.scene.fabric_file.string(),
              "--reference", (drape.folder / "sheet.ply").string(), "--grid", std::to_string(grid),
              "--segments", std::to_string(chosen), "--only-first-order", "--out", folder.string(),
              "--threads", "1", "--json"},
             folder / "sensitivity.json"));
    group.steps.back().drape = drape.scene.name;
  }
  return group;
}

}  // namespace drape::plan
