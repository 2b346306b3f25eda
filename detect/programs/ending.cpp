// SPDX-License-Identifier: Apache-2.0
#include "detect/programs/ending.hpp"
#include "core/program/shell_word.hpp"

#include <fmt/format.h>

namespace drape::detect {

Ending ending_of(const DetectReport& report, Surface surface, bool is_plate,
                 const std::string& out) {
  Ending ending;
  ending.go = report.good();
  ending.verdict = fmt::format("{} marks measured in {} frames", report.marks, report.frames);
  if (!report.frames_without_marks.empty())
    ending.verdict = fmt::format("no mark in {} of {} frames, the first is {}",
                                 report.frames_without_marks.size(), report.frames,
                                 report.frames_without_marks.front());
  ending.numbers.emplace_back("marks per frame",
                              fmt::format("{:.1f}", report.marks / double(report.frames)));
  if (report.median_sigma_px) {
    ending.numbers.emplace_back("median standard deviation",
                                fmt::format("{:.4f} px", *report.median_sigma_px));
  }
  if (report.dot_size_ratio) {
    ending.numbers.emplace_back("diameter of the dots",
                                fmt::format("{:.3f} of the stated one", *report.dot_size_ratio));
  }
  if (report.islands > 0) {
    ending.numbers.emplace_back("marks in islands, without a label",
                                fmt::format("{}", report.islands));
  }
  ending.numbers.emplace_back("tags recognised", fmt::format("{}", report.tags));
  for (const auto& [reason, count] : report.rejections_by_reason) {
    ending.rejected.push_back(fmt::format("{} x {}", count, reason));
  }
  for (const auto& [camera, count] : report.not_in_rig)
    ending.rejected.push_back(
        fmt::format("{} x picture of {}, a camera that the rig does not name", count, camera));
  ending.warnings = report.poor_views;
  ending.warnings.insert(ending.warnings.end(), report.warnings.begin(), report.warnings.end());
  if (!report.refused.empty()) ending.verdict = report.refused;
  if (!report.other_print.empty()) ending.verdict = report.other_print;
  if (!ending.go && !report.poor_views.empty()) ending.verdict += "; " + report.poor_views.front();
  if (!ending.go) {
    ending.next_command = "look at the frames: run the same command with --overlay DIR";
  } else if (is_plate) {
    ending.next_command = fmt::format(
        "drape object {} --calibration calibration.json --set NAME --scene SCENE.toml --out "
        "object.json",
        shell_word(out));
  } else if (surface == Surface::target) {
    ending.next_command = fmt::format(
        "drape calib {} --rig RIG --method joint --out calibration.json", shell_word(out));
  } else {
    ending.next_command = fmt::format(
        "drape triangulate {} --calibration calibration.json --set NAME --scene SCENE.toml --out "
        "sheet.ply",
        shell_word(out));
  }
  return ending;
}

}  // namespace drape::detect
