// SPDX-License-Identifier: Apache-2.0
#include "compare/judgement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// What rests on a NO-GO is NO-GO, in the words of the first cause, said once.
void judge_foundation(const DrapeInput& input, Report& report) {
  if (input.measured.sheet.no_go) report.no_go.push_back(*input.measured.sheet.no_go);
  for (const Simulation& simulation : input.simulations) {
    const auto& cause = simulation.sheet.sheet.no_go;
    if (!cause || cause == input.measured.sheet.no_go) continue;
    report.no_go.push_back(fmt::format("simulation {} was placed by a sheet that is NO-GO: {}",
                                       simulation.label(), *cause));
  }
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

void judge_simulations(const DrapeInput& input, const Options& options, Report& report) {
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    if (!simulation.other_simulator && simulation.source().status != "at rest") {
      (options.accept_unsettled ? report.warnings : report.no_go)
          .push_back(
              fmt::format("simulation {}: {}", simulation.label(), simulation.source().status));
    }
    if (simulation.certificate && simulation.certificate->penetration_accepted == false) {
      (options.accept_penetration ? report.warnings : report.no_go)
          .push_back(fmt::format("simulation {} penetrates the object more than it accepts",
                                 simulation.label()));
    }
  }
}

/// Objects and table of a simulation must be those that the marks were asked about; other values of
/// its scene, such as friction, may differ.
void judge_scenes(const DrapeInput& input, Report& report) {
  const auto& asked = input.measured.asked;
  std::map<std::string, std::string> differences;  // labels by what differs
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

/// One warning for all simulations that another measured sheet placed.
void warn_of_other_starts(const DrapeInput& input, Report& report) {
  std::string labels;
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    const auto& start = simulation.source().start_sha256;
    if (start && *start != input.measured.sha256 && *start != input.measured.ply_sha256)
      labels += (labels.empty() ? "" : "; ") + simulation.label();
  }
  if (!labels.empty())
    report.warnings.push_back("placed by another measured sheet than this one: " + labels);
}

void warn_of_branches(const DrapeInput& input, Report& report) {
  for (const BranchSet& set : report.branch_sets) {
    const Branch& first = *input.simulations[set.branches[0].as_placed.simulation].branch;
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

/// Of one drape are sheets whose scene or frame set is the same; what a file does not say is none.
void require_same(const DrapeInput& input, const std::string& scene, const std::string& set,
                  const std::filesystem::path& file) {
  const SheetFile& measured = input.measured;
  const std::string& own_set = std::get<MeasuredSource>(measured.sheet.source).set;
  std::string own_scene;
  if (measured.asked) own_scene = measured.asked->name;
  if (measured.repeat) own_scene = measured.repeat->scene;
  if (own_scene.empty() && set.empty()) return;
  if (own_scene == scene || own_set == set) return;
  throw bad_input(fmt::format("scene `{}`{} is another drape than that of {}, frame set `{}`{}",
                              scene, set.empty() ? "" : fmt::format(" with frame set `{}`", set),
                              measured.file.string(), own_set,
                              own_scene.empty() ? "" : fmt::format(" of scene `{}`", own_scene)),
                  {.file = file.string(), .field = "source.scene"},
                  "put the measured sheet of each drape before its simulations; one that was taken "
                  "in a set of another name says its scene by drape triangulate --scene");
}

}  // namespace

void require_one_drape(const DrapeInput& input) {
  for (const Simulation& one : input.simulations)
    require_same(input, one.source().scene, one.scene ? one.scene->set : std::string(),
                 one.sheet.file);
  for (const OtherSurface& one : input.surfaces) require_same(input, one.scene, {}, one.file);
}

void judge(const DrapeInput& input, const Options& options, Report& report) {
  judge_foundation(input, report);
  judge_scenes(input, report);
  judge_measurement(options, report);
  judge_simulations(input, options, report);
  warn_of_other_starts(input, report);
  warn_of_branches(input, report);
  if (input.simulations.empty())
    report.no_go.emplace_back(input.surfaces.empty()
                                  ? "no simulation was given"
                                  : "no mark has a place on any mesh that was given: only "
                                    "surfaces could be compared");
}

}  // namespace drape::compare
