// SPDX-License-Identifier: Apache-2.0
#include "detect/ending.hpp"

#include <fmt/format.h>

namespace drape {

Ending ending_of(const DetectReport& report, Surface surface, const std::string& out) {
  Ending ending;
  ending.go = report.frames_without_marks.empty();
  ending.verdict = ending.go
                       ? fmt::format("{} marks measured in {} frames", report.marks, report.frames)
                       : fmt::format("no mark in {} of {} frames, the first is {}",
                                     report.frames_without_marks.size(), report.frames,
                                     report.frames_without_marks.front());
  ending.numbers = {
      {"marks per frame", fmt::format("{:.1f}", report.marks / double(report.frames))},
      {"median standard deviation", fmt::format("{:.4f} px", report.median_sigma_px)},
      {"tags recognised", fmt::format("{}", report.tags)}};
  for (const auto& [reason, count] : report.rejections_by_reason) {
    ending.rejected.push_back(fmt::format("{} x {}", count, reason));
  }
  for (const std::string& warning : report.warnings) ending.rejected.push_back(warning);
  ending.next_command =
      surface == Surface::target
          ? fmt::format("drape calib {} --rig RIG --method tsai --out calibration.json", out)
          : fmt::format(
                "drape triangulate {} --calibration calibration.json --set NAME "
                "--out sheet.ply",
                out);
  return ending;
}

}  // namespace drape
