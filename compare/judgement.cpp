// SPDX-License-Identifier: Apache-2.0
#include "compare/judgement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Passes on the NO-GO of a sheet that positioned a simulation, with its first cause, stated once,
/// and that of another simulator's mesh.
void judge_placing(const Simulation& simulation, const std::optional<std::string>& said,
                   std::vector<std::string>& no_go) {
  const auto& cause = simulation.sheet.sheet.no_go;
  if (cause && simulation.other_simulator)
    no_go.push_back(fmt::format("simulation {}: {}", simulation.label(), *cause));
  else if (cause && cause != said)
    no_go.push_back(fmt::format("simulation {} was placed by a sheet that is NO-GO: {}",
                                simulation.label(), *cause));
}

void judge_foundation(const DrapeInput& input, Report& report) {
  const auto& measured = input.measured.sheet.no_go;
  if (measured) report.no_go.push_back(*measured);
  for (const Simulation& simulation : input.simulations)
    judge_placing(simulation, measured, report.no_go);
}

void judge_measurement(const Options& options, Report& report) {
  for (const RealVirtual& row : report.real_virtual) {
    if (row.statistics.marks >= options.min_marks) continue;
    report.no_go.push_back(fmt::format("only {} marks could be compared, {} are asked for",
                                       row.statistics.marks, options.min_marks));
    break;
  }
  if (!report.measurement.sigma_median_m) {
    report.no_go.emplace_back(
        "the measured marks carry no covariance, so their uncertainty is "
        "unknown");
    return;
  }
  if (!report.headline) return;
  const double limit =
      options.max_sigma_ratio * report.real_virtual[*report.headline].statistics.mean_m;
  if (*report.measurement.sigma_median_m > limit) {
    report.no_go.push_back(fmt::format(
        "the uncertainty of a mark (median {:.3f} mm) is above {:g} % of the mean distance "
        "({:.3f} mm)",
        *report.measurement.sigma_median_m / mm, options.max_sigma_ratio * 100,
        report.real_virtual[*report.headline].statistics.mean_m / mm));
  }
}

void judge_simulation(const Simulation& simulation, const Options& options,
                      std::vector<std::string>& no_go, std::vector<std::string>& warnings) {
  if (!simulation.other_simulator && simulation.source().status != "at rest")
    (options.accept_unsettled ? warnings : no_go)
        .push_back(
            fmt::format("simulation {}: {}", simulation.label(), simulation.source().status));
}

/// Requires that objects and table of a simulation are those with which the marks were measured;
/// other values of its scene, such as friction, may differ.
void judge_scenes(const DrapeInput& input, Report& report) {
  const auto& asked = input.measured.asked;
  std::map<std::string, std::string> differences;  // labels by difference
  std::string unknown, without_mesh;
  const auto add = [](const Simulation& simulation, std::string& labels) {
    labels += (labels.empty() ? "" : "; ") + simulation.label();
  };
  for (const Simulation& simulation : input.simulations) {
    if (!asked || simulation.other_simulator) continue;
    if (simulation.scene) {
      if (const auto why = difference_of(asked->surroundings, simulation.scene->surroundings))
        add(simulation, differences[*why]);
    } else if (simulation.source().scene_sha256 != asked->sha256) {
      add(simulation, unknown);
    } else if (std::any_of(asked->surroundings.begin(), asked->surroundings.end(),
                           [](const auto& value) { return value.first.ends_with(".file"); })) {
      add(simulation, without_mesh);
    }
  }
  if (!without_mesh.empty())
    report.warnings.push_back(
        "no run record names the mesh that was simulated, so nothing says that it is the one that "
        "the marks were asked about: " +
        without_mesh);
  if (!unknown.empty())
    report.no_go.push_back(
        "simulated from another content of the scene file than the marks were asked about, which "
        "is not there any more, so nothing says that its objects are the same (simulation " +
        unknown + "); simulate again");
  for (const auto& [why, labels] : differences)
    report.no_go.push_back(
        fmt::format("the simulated objects are not those that the marks were asked about: {} "
                    "(simulation {}); correct the scene and simulate again, or ask the marks about "
                    "it by drape triangulate --scene",
                    why, labels));
  if (!asked && !input.simulations.empty())
    report.warnings.emplace_back(
        "the marks were asked about no scene, so nothing says whether they contradict the "
        "simulation's objects and table: measure with drape triangulate --scene SCENE.toml");
}

/// Adds one warning for all simulations positioned by another measured sheet.
void warn_of_other_starts(const DrapeInput& input, Report& report) {
  std::string labels;
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    const auto& start = simulation.source().start_sha256;
    if (start && !input.measured.has_content(*start))
      labels += (labels.empty() ? "" : "; ") + simulation.label();
  }
  if (!labels.empty())
    report.warnings.push_back("placed by another measured sheet than this one: " + labels);
}

void warn_of_branches(const DrapeInput& input, Report& report) {
  for (const BranchSet& set : report.branch_sets) {
    const Simulation& one = input.simulations[set.branches[0].as_placed.simulation];
    const Branch& first = *one.branch;
    if (!one.is_of_cloth_of(*input.speaker()))
      report.warnings.push_back(fmt::format(
          "branches of {}: of another model, fabric or scene than {}, which speaks for the drape, "
          "so that they count for neither match nor U",
          set.label, input.speaker()->label()));
    if (first.round && !set.branches[0].turned) {
      report.warnings.push_back(fmt::format(
          "branches of {}: the scene is round, but its file was not found, so that a branch turned "
          "about the vertical counts as another shape",
          set.label));
    }
    if (set.branches.size() < static_cast<std::size_t>(first.of)) {
      report.warnings.push_back(
          fmt::format("branches of {}: {} of the {} that were found are given", set.label,
                      set.branches.size(), first.of));
    }
  }
}

/// Scene and set stated by a simulation or mesh; the set is empty if unknown.
struct SaidDrape {
  std::string scene, set, label;
  std::filesystem::path file;
};

std::vector<SaidDrape> said_drapes(const DrapeInput& input) {
  std::map<std::string, std::string> sets;  // set of each scene, from the simulations that state it
  for (const Simulation& one : input.simulations)
    if (one.scene && !one.scene->set.empty()) sets.emplace(one.source().scene, one.scene->set);
  const auto set_of = [&](const std::string& scene) {
    const auto found = sets.find(scene);
    return found == sets.end() ? std::string() : found->second;
  };
  std::vector<SaidDrape> drapes;
  for (const Simulation& one : input.simulations) {
    const std::string& scene = one.source().scene;
    drapes.push_back(
        {scene, one.scene ? one.scene->set : set_of(scene), one.label(), one.sheet.file});
  }
  for (const OtherSurface& one : input.surfaces)
    drapes.push_back({one.scene, set_of(one.scene), one.simulator, one.file});
  return drapes;
}

/// Refuses a scene of another name whose set is unknown, since it may be another drape.
void judge_drapes(const DrapeInput& input, Report& report) {
  const std::string own = input.measured.scene();
  for (const SaidDrape& drape : said_drapes(input)) {
    if (own.empty() || drape.scene == own || !drape.set.empty()) continue;
    report.no_go.push_back(
        fmt::format("nothing says that scene `{}` of {} is the drape of scene `{}` that was "
                    "measured; simulate again, or write `{}` as the scene of a mesh that is",
                    drape.scene, drape.label, own, own));
  }
}

}  // namespace

void require_one_drape(const DrapeInput& input) {
  const SheetFile& measured = input.measured;
  const std::string& own_set = measured.measured().set;
  const std::string own_scene = measured.scene();
  for (const SaidDrape& drape : said_drapes(input)) {
    if (drape.scene == own_scene || drape.set == own_set || drape.set.empty()) continue;
    throw bad_input(
        fmt::format("scene `{}` with frame set `{}` is another drape than that of {}, frame set "
                    "`{}`{}",
                    drape.scene, drape.set, measured.file.string(), own_set,
                    own_scene.empty() ? "" : fmt::format(" of scene `{}`", own_scene)),
        {.file = drape.file.string(), .field = "source.scene"},
        "put the measured sheet of each drape before its simulations; one that was taken in a set "
        "of another name says its scene by drape triangulate --scene");
  }
}

void judge_group(const Options& options, VirtualGroup& group, std::vector<std::string>& warnings) {
  for (const Simulation& simulation : group.simulations) {
    judge_placing(simulation, std::nullopt, group.no_go);
    judge_simulation(simulation, options, group.no_go, warnings);
  }
}

void judge(const DrapeInput& input, const Options& options, Report& report) {
  judge_foundation(input, report);
  judge_drapes(input, report);
  judge_scenes(input, report);
  judge_measurement(options, report);
  for (const RealVirtual& row : report.real_virtual)
    judge_simulation(input.simulations[row.simulation], options, report.no_go, report.warnings);
  warn_of_other_starts(input, report);
  warn_of_branches(input, report);
  if (input.simulations.empty())
    report.no_go.emplace_back(input.surfaces.empty()
                                  ? "no simulation was given"
                                  : "no mark has a place on any mesh that was given: only "
                                    "surfaces could be compared");
}

}  // namespace drape::compare
