// SPDX-License-Identifier: Apache-2.0
#include "triangulate/ending.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/files/files.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"

namespace drape::triangulate {
namespace {

using units::mm;

/// Number of gaps by kind of reason, without figures and details, which are in the file.
std::map<std::string, int> gaps_by_kind(const Sheet& sheet) {
  std::map<std::string, int> kinds;
  for (const Gap& gap : sheet.gaps) {
    const std::size_t end = std::min(gap.reason.find(';'), gap.reason.find(':'));
    ++kinds[gap.reason.substr(0, end)];
  }
  return kinds;
}

std::string views_text(const std::vector<int>& marks_by_views) {
  std::string text;
  for (std::size_t views = 0; views < marks_by_views.size(); ++views) {
    if (marks_by_views[views] == 0) continue;
    text +=
        fmt::format("{}{} mark{} from {} view{}", text.empty() ? "" : ", ", marks_by_views[views],
                    marks_by_views[views] == 1 ? "" : "s", views, views == 1 ? "" : "s");
  }
  return text.empty() ? "none" : text;
}

std::string pairs_text(const TriangulateReport& report) {
  std::string text = "miss each other by";
  for (const PairAgreement& pair : report.pairs) {
    text += fmt::format("{} {:.2f} sigma ({}, {})", &pair == &report.pairs.front() ? "" : ",",
                        pair.median_sigmas, pair.first, pair.second);
  }
  return text + fmt::format(", limit {:g}", PairAgreement::max_sigmas);
}

std::string budget_text(const ErrorBudget& budget) {
  return fmt::format(
      "{:.4f} mm RMS in space: detection {:.4f}, calibration {}{}, dot shape {:.4f} mm",
      budget.total_m / mm, budget.detection_m / mm,
      budget.calibration_m ? fmt::format("{:.4f}", *budget.calibration_m / mm) : "unknown",
      budget.target_m ? fmt::format(" (target {:.4f})", *budget.target_m / mm) : "",
      budget.dot_shape_m / mm);
}

/// Names the worst marks, worst first, and counts the rest.
std::string worst_of(std::vector<std::pair<double, MarkId>> marks, const std::string& unit) {
  constexpr std::size_t kNamed = 5;
  std::stable_sort(marks.begin(), marks.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text;
  for (std::size_t i = 0; i < std::min(kNamed, marks.size()); ++i)
    text += fmt::format("{} {} at ({}, {})", i == 0 ? "" : ",",
                        fmt::format(fmt::runtime(unit), marks[i].first), marks[i].second.row,
                        marks[i].second.col);
  if (marks.size() > kNamed) text += fmt::format(" and {} more", marks.size() - kNamed);
  return text;
}

/// Adds one line for each reason.
void add_doubts(Ending& ending, const std::vector<Doubt>& doubts,
                const TriangulateOptions& options) {
  std::vector<std::pair<double, MarkId>> uncertain, apart;
  for (const Doubt& doubt : doubts) {
    if (doubt.sigma_mm) uncertain.emplace_back(*doubt.sigma_mm, doubt.mark);
    if (doubt.sigmas) apart.emplace_back(*doubt.sigmas, doubt.mark);
  }
  if (!uncertain.empty()) {
    ending.warnings.push_back(fmt::format(
        "doubtful, but measured: {} mark{} less certain than {:g} mm in space:{}", uncertain.size(),
        uncertain.size() == 1 ? "" : "s", options.doubt_mm, worst_of(uncertain, "{:.3f} mm")));
  }
  if (!apart.empty()) {
    ending.warnings.push_back(fmt::format(
        "doubtful, but measured: {} mark{} whose views miss each other by more than {:g} sigma:{}",
        apart.size(), apart.size() == 1 ? "" : "s", options.doubt_sigmas,
        worst_of(apart, "{:.1f} sigma")));
  }
}

}  // namespace

Ending ending_of(const TriangulateResult& result, const TriangulateOptions& options,
                 const std::filesystem::path& out) {
  const TriangulateReport& report = result.report;
  Ending ending;
  ending.go = report.no_go.empty();
  ending.verdict = ending.go ? fmt::format("{} marks measured, {} gap{}", report.measured,
                                           report.gaps, report.gaps == 1 ? "" : "s")
                             : report.no_go.front();
  for (std::size_t i = 1; i < report.no_go.size(); ++i)
    ending.warnings.push_back("NO-GO also because " + report.no_go[i]);
  ending.numbers = {
      {"views", views_text(report.marks_by_views)},
      {"median reprojection", fmt::format("{:.4f} px RMS", report.median_reprojection_px)},
      {"median uncertainty",
       fmt::format("{:.4f} mm per axis, of which calibration {}", report.median_sigma_mm,
                   report.has_calibration_covariance
                       ? fmt::format("{:.4f} mm", report.median_calibration_sigma_mm)
                       : "unknown (no covariance in the file)")},
      {"agreement of the views",
       fmt::format("{:.2f} of what the uncertainty predicts (median)", report.median_chi_per_dof)},
      {"correction of dot shape",
       fmt::format("median {:.4f} mm, largest {:.4f} mm", report.median_shape_shift_mm,
                   report.largest_shape_shift_mm)}};
  if (result.sheet.error_budget)
    ending.numbers.emplace_back("error budget", budget_text(*result.sheet.error_budget));
  if (!report.pairs.empty()) ending.numbers.emplace_back("pairs of cameras", pairs_text(report));
  for (const Unseen& unseen : report.unseen)
    ending.numbers.emplace_back("unseen errors, " + unseen.of, unseen.limits);
  if (report.islands > 0) {
    ending.numbers.emplace_back(
        "islands", fmt::format("{} of {} pieces without labels merged, {} dots",
                               report.merged_islands, report.islands, report.merged_dots));
  }
  for (const auto& [kind, count] : gaps_by_kind(result.sheet))
    ending.rejected.push_back(fmt::format("{} mark{}: {}", count, count == 1 ? "" : "s", kind));
  add_doubts(ending, report.doubts, options);
  for (const std::string& view : report.dropped_views) ending.rejected.push_back(view);
  for (const std::string& fate : report.island_fates) ending.rejected.push_back(fate);
  ending.warnings.insert(ending.warnings.end(), report.warnings.begin(), report.warnings.end());
  if (ending.go) {
    ending.next_command =
        fmt::format("drape simulate SCENE.toml --segments 5 --start-from {} --out DIR",
                    shell_word(out.string()));
  }
  return ending;
}

void note_scene(MeasuredSource& source, const Scene& scene, const RepeatId& repeat) {
  source.asked_scene = {scene.name, scene.document.sha256(),
                        surroundings_of(scene, sha256_of_file)};
  if (!repeat.name.empty()) source.repeat = repeat;
}

}  // namespace drape::triangulate
