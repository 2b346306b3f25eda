// SPDX-License-Identifier: Apache-2.0
#include "triangulate/sheet_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::triangulate {
namespace {

using units::mm;

double rms_sigma_m(const Eigen::Matrix3d& covariance) {
  return std::sqrt(covariance.trace() / 3);
}

/// Residuals of all marks seen by a pair of cameras. Creases and wrong labels affect a few marks, a
/// camera that moved affects most.
struct PairMisses {
  std::vector<double> sigmas, px;
};

}  // namespace

ErrorBudget budget_of(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                      const Sheet& sheet, bool has_calibration_covariance) {
  double detection = 0, calibration = 0, target = 0, shape = 0;
  bool states_target = false;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (sheet.find(marks[i].mark) == nullptr) continue;
    const Point& point = *placed[i].agreed.point;
    detection += point.detection_covariance_m2.trace();
    calibration += point.calibration_covariance_m2.trace();
    target += point.target_covariance_m2.trace();
    shape += point.shape_covariance_m2.trace();
    const InJointCovariance* joint = marks[i].views.front().joint;
    states_target |= joint != nullptr && joint->target != nullptr;
  }
  const auto rms = [&](double sum_m2) {
    return std::sqrt(sum_m2 / static_cast<double>(sheet.marks.size()));
  };
  ErrorBudget budget{rms(detection), std::nullopt, rms(shape),
                     rms(detection + calibration + shape)};
  if (has_calibration_covariance) budget.calibration_m = rms(calibration);
  if (states_target) budget.target_m = rms(target);
  return budget;
}

void note_statistics(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                     const Sheet& sheet, TriangulateReport& report) {
  std::vector<double> reprojection, sigma, calibration, agreement, shift;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const SheetMark* mark = sheet.find(marks[i].mark);
    if (mark == nullptr) continue;
    const Point& point = *placed[i].agreed.point;
    reprojection.push_back(point.rms_px());
    sigma.push_back(rms_sigma_m(*mark->covariance_m2) / mm);
    calibration.push_back(rms_sigma_m(point.calibration_covariance_m2) / mm);
    agreement.push_back(std::sqrt(point.chi2 / point.degrees_of_freedom));
    shift.push_back(placed[i].shape_shift_m / mm);
    const auto views = placed[i].agreed.used.size();
    if (report.marks_by_views.size() <= views) report.marks_by_views.resize(views + 1);
    ++report.marks_by_views[views];
    if (placed[i].agreed.dropped) {
      report.dropped_views.push_back(fmt::format(
          "mark ({}, {}): {} left out, with it the views miss each other by {:.1f} sigma",
          marks[i].mark.row, marks[i].mark.col,
          marks[i].views[*placed[i].agreed.dropped].camera->camera.name,
          placed[i].agreed.disagreement_sigmas));
    }
  }
  if (shift.empty()) return;
  report.largest_shape_shift_mm = *std::max_element(shift.begin(), shift.end());
  report.median_reprojection_px = median(reprojection);
  report.median_sigma_mm = median(sigma);
  report.median_calibration_sigma_mm = median(calibration);
  report.median_chi_per_dof = median(agreement);
  report.median_shape_shift_mm = median(shift);
}

std::vector<Doubt> doubts_of(const std::vector<MarkViews>& marks, const std::vector<Placed>& placed,
                             const Sheet& sheet, const TriangulateOptions& options) {
  std::vector<Doubt> doubts;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const SheetMark* mark = sheet.find(marks[i].mark);
    if (mark == nullptr) continue;
    Doubt doubt{mark->mark, std::nullopt, std::nullopt};
    const double sigma_mm = std::sqrt(mark->covariance_m2->trace()) / mm;
    const double sigmas = placed[i].agreed.point->disagreement_sigmas();
    if (sigma_mm > options.doubt_mm) doubt.sigma_mm = sigma_mm;
    if (sigmas > options.doubt_sigmas) doubt.sigmas = sigmas;
    if (doubt.sigma_mm || doubt.sigmas) doubts.push_back(doubt);
  }
  return doubts;
}

std::vector<std::string> costs_of_views(const std::vector<MarkViews>& marks, const Sheet& sheet) {
  constexpr int kLeast = 3;  // fewer are individual dots, not a poor view
  constexpr std::string_view kWord = " rejected it: ";
  std::map<std::pair<std::string, std::string>, int> counts;
  for (const MarkViews& mark : marks) {
    if (mark.views.size() >= 2 || sheet.find(mark.mark) != nullptr) continue;
    for (const std::string& refused : mark.refused) {
      const std::size_t at = refused.find(kWord);
      if (at == std::string::npos) continue;
      const std::string reason = refused.substr(at + kWord.size());
      ++counts[{refused.substr(0, at), reason.substr(0, reason.find_first_of(":;,("))}];
    }
  }
  std::vector<std::string> lines;
  for (const auto& [what, count] : counts) {
    if (count < kLeast) continue;
    const bool bright = what.second.find("saturated") != std::string::npos;
    lines.push_back(fmt::format("{} cost {} marks: {}{}", what.first, count, what.second,
                                bright ? "; lower its exposure or the light" : ""));
  }
  return lines;
}

void note_calibration(const Calibration& calibration, const std::string& rig,
                      TriangulateReport& report) {
  if (calibration.rig != rig)
    report.warnings.push_back(
        fmt::format("the calibration is of rig {}, the marks are of rig {}", calibration.rig, rig));
  const std::vector<std::string>& warnings = calibration.warnings;
  if (warnings.empty()) return;
  std::string text = "calibration: " + warnings.front();
  if (warnings.size() > 1)
    text += fmt::format(" (the first of {} warnings in its file)", warnings.size());
  report.warnings.push_back(text);
}

std::vector<PairAgreement> pair_agreements(const std::vector<MarkViews>& marks,
                                           const std::vector<Placed>& placed, double min_angle_rad,
                                           int least_marks) {
  std::map<std::pair<std::string, std::string>, PairMisses> pairs;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const std::vector<View>& views =
        placed[i].shaped_views.empty() ? marks[i].views : placed[i].shaped_views;
    for (std::size_t a = 0; a < views.size(); ++a) {
      for (std::size_t b = a + 1; b < views.size(); ++b) {
        const Point point = solve_point({views[a], views[b]}, min_angle_rad);
        if (point.status != PointStatus::good) continue;
        PairMisses& pair = pairs[{views[a].camera->camera.name, views[b].camera->camera.name}];
        pair.sigmas.push_back(point.disagreement_sigmas());
        pair.px.push_back(point.rms_px());
      }
    }
  }
  std::vector<PairAgreement> result;
  for (auto& [cameras, misses] : pairs) {
    if (static_cast<int>(misses.sigmas.size()) < least_marks) continue;
    result.push_back({cameras.first, cameras.second, static_cast<int>(misses.sigmas.size()),
                      median(misses.sigmas), median(misses.px)});
  }
  return result;
}

}  // namespace drape::triangulate
