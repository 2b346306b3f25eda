// SPDX-License-Identifier: Apache-2.0
#include "compare/judgement.hpp"

#include <fmt/format.h>

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

}  // namespace

void judge(const DrapeInput& input, const Options& options, Report& report) {
  judge_foundation(input, report);
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
