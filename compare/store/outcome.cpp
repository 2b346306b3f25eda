// SPDX-License-Identifier: Apache-2.0
#include "compare/store/outcome.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "compare/judgement.hpp"
#include "compare/repeats/repeat_sheets.hpp"
#include "compare/tables/budget.hpp"
#include "compare/tables/match.hpp"
#include "compare/tables/tables.hpp"
#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::compare {

namespace fs = std::filesystem;
using units::mm;

namespace {

constexpr double kManyGaps = 0.05;  // fraction of the print's marks

/// The mean covers only measured marks, and U does not include the others. The warning states how
/// far the choice of marks can change the mean, if many are missing or this exceeds U.
std::optional<std::string> warning_of_gaps(const DrapeFiles& drape, const Report& report) {
  if (!report.headline || report.measurement.gaps == 0) return std::nullopt;
  const auto& interval = report.real_virtual[*report.headline].statistics.mean.bootstrap;
  const double expanded_m = report.budget ? report.budget->expanded_m : 0;
  const int marks = report.measurement.marks, gaps = report.measurement.gaps;
  if (!interval) return std::nullopt;
  if (gaps < kManyGaps * (marks + gaps) && interval->high - interval->low <= 2 * expanded_m)
    return std::nullopt;
  std::string views;
  if (drape.detections)
    for (const FrameDetections& frame : drape.detections->frames)
      if (frame.set == std::get<MeasuredSource>(drape.input.measured.sheet.source).set)
        views += fmt::format("{}{} {}", views.empty() ? " (with a label: " : ", ", frame.camera,
                             frame.detections.size());
  return fmt::format(
      "{} of {} marks of the print are not measured{}: the mean is that of the other {}, U = "
      "{:.3f} "
      "mm holds for these alone; as many marks drawn again from them give {:.2f} to {:.2f} mm "
      "(95 %), a region that is missing may move it further",
      report.measurement.gaps, marks + report.measurement.gaps, views.empty() ? "" : views + ")",
      marks, expanded_m / mm, interval->low / mm, interval->high / mm);
}

/// Names of the drapes; those of one scene are followed by repeat, set or file.
std::vector<std::string> labels_of(const std::vector<DrapeFiles>& drapes) {
  using Words = std::string (*)(const SheetFile&);
  constexpr std::array<Words, 3> kWords{
      [](const SheetFile& sheet) {
        return sheet.repeat ? "repeat " + sheet.repeat->name : std::string();
      },
      [](const SheetFile& sheet) { return std::get<MeasuredSource>(sheet.sheet.source).set; },
      [](const SheetFile& sheet) { return sheet.file.string(); }};
  std::vector<std::string> labels;
  labels.reserve(drapes.size());
  for (const DrapeFiles& drape : drapes) labels.push_back(drape.input.name());
  for (const Words words : kWords) {
    const std::vector<std::string> before = labels;
    for (std::size_t i = 0; i < drapes.size(); ++i) {
      const std::string more = words(drapes[i].input.measured);
      if (!more.empty() && std::count(before.begin(), before.end(), before[i]) > 1)
        labels[i] += " (" + more + ")";
    }
  }
  return labels;
}

}  // namespace

bool Outcome::go() const {
  return reasons().empty();
}

std::vector<std::string> Outcome::reasons() const {
  std::vector<std::string> list;
  for (const Report& drape : reports)
    for (const std::string& reason : drape.no_go) list.push_back(drape.called() + ": " + reason);
  for (const VirtualGroup& group : groups)
    for (const std::string& reason : group.no_go) list.push_back(group.name + ": " + reason);
  list.insert(list.end(), not_compared.begin(), not_compared.end());
  return list;
}

std::string Outcome::sentence() const {
  const std::vector<std::string> list = reasons();
  if (!list.empty()) {
    return list.front() + (list.size() > 2 ? fmt::format(" (and {} more reasons)", list.size() - 1)
                           : list.size() == 2 ? " (and one more reason)"
                                              : "");
  }
  std::string text;
  for (const VirtualGroup& group : groups)
    text +=
        fmt::format("{}{} pairs of {}", text.empty() ? "" : ", ", group.pairs.size(), group.name);
  if (reports.empty()) return "simulations compared with each other: " + text;
  text.clear();
  for (const Report& drape : reports) {
    text += fmt::format("{}{} {:.2f} mm, {}", text.empty() ? "" : "; ", drape.called(),
                        drape.real_virtual[*drape.headline].statistics.mean_m / mm,
                        name_of(drape.match.match));
  }
  return "measured; mean distance real to virtual and match: " + text;
}

void compare_session(const Session& session, const Options& options, Outcome& outcome) {
  if (!outcome.store.empty() && std::filesystem::weakly_canonical(outcome.store) ==
                                    std::filesystem::weakly_canonical(outcome.report))
    throw usage_error("the report would replace the results store", "give another --report");
  for (const auto& [file, sha256] : session.read) {
    std::error_code absent;
    if (std::filesystem::equivalent(file, outcome.report, absent))
      throw usage_error(
          fmt::format("the report would replace {}, which it is made of", file.string()),
          "give another --report");
  }
  const bool bad_calibration = session.calibration && session.calibration->no_go;
  const std::vector<std::string> labels = labels_of(session.drapes);
  std::vector<const SheetFile*> layings;
  for (const DrapeFiles& drape : session.drapes) {
    layings.push_back(&drape.input.measured);
    for (const SheetFile& repeat : drape.input.repeats) layings.push_back(&repeat);
  }
  const std::map<std::string, std::string> twice = layings_twice(layings, Among::different_drapes),
                                           unmoved = layings_twice(layings, Among::one_drape);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const DrapeFiles& drape = session.drapes[i];
    outcome.reports.push_back(compare_drape(drape.input, options));
    Report& report = outcome.reports.back();
    report.label = labels[i];
    if (bad_calibration && !drape.input.measured.sheet.no_go)
      report.no_go.insert(report.no_go.begin(),
                          "the calibration is NO-GO: " + *session.calibration->no_go);
    const auto& source = std::get<MeasuredSource>(drape.input.measured.sheet.source);
    if (const auto why = outcome.not_accepted.find(source.calibration_sha256);
        why != outcome.not_accepted.end())
      report.no_go.insert(report.no_go.begin() + (bad_calibration ? 1 : 0), why->second);
    const auto reasons = [&](const std::map<std::string, std::string>& known) {
      std::set<std::string> own;
      const auto note = [&](const SheetFile& sheet) {
        if (const auto found = known.find(sheet.sha256); found != known.end())
          own.insert(found->second);
      };
      note(drape.input.measured);
      std::for_each(drape.input.repeats.begin(), drape.input.repeats.end(), note);
      return own;
    };
    const std::set<std::string> same = reasons(twice), still = reasons(unmoved);
    report.no_go.insert(report.no_go.end(), same.begin(), same.end());
    report.warnings.insert(report.warnings.end(), still.begin(), still.end());
    if (report.headline)
      report.budget = budget_of(budget_inputs_of(drape.input, report, drape.error_split));
    judge_repeats(drape.input, options, report);
    report.match = match_of(drape.input, options, report);
    if (auto warning = warning_of_gaps(drape, report))
      report.warnings.push_back(std::move(*warning));
    for (const std::string& warning : report.warnings)
      outcome.warnings.push_back(report.label + ": " + warning);
  }
  for (const auto& simulations : session.virtual_only) {
    outcome.groups.push_back(compare_virtual_group(simulations));
    judge_group(options, outcome.groups.back(), outcome.warnings);
    if (outcome.groups.back().pairs.empty()) {
      outcome.warnings.push_back(outcome.groups.back().name +
                                 ": no two simulations make a pair of the paper's tables");
    }
  }
}

}  // namespace drape::compare
