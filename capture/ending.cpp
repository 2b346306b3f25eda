// SPDX-License-Identifier: Apache-2.0
#include "capture/ending.hpp"

#include <fmt/format.h>

namespace drape {

Ending ending_of(const ImportResult& result, const std::filesystem::path& recording_folder) {
  const ImportReport& report = result.report;
  Ending ending;
  ending.verdict = fmt::format("imported {}{}", report.in_place ? "in place: " : "to ",
                               (recording_folder / "recording.json").string());
  ending.numbers = {{"sets", fmt::format("{}", result.recording.sets.size())},
                    {"cameras", fmt::format("{}", report.cameras.size())},
                    {"images", fmt::format("{} whole, {:.1f} MB", report.images,
                                           static_cast<double>(report.image_bytes) / 1e6)}};
  for (const auto& [file, reason] : report.ignored) {
    ending.rejected.push_back(fmt::format("{}: {}", file, reason));
  }
  for (std::size_t i = 0; i < report.warnings.size(); ++i) {
    ending.numbers.emplace_back(fmt::format("warning {}", i + 1), report.warnings[i]);
  }
  ending.next_command =
      fmt::format("drape detect {} --rig RIG --surface target --sets SETS --out detections.json",
                  recording_folder.string());
  return ending;
}

Ending ending_of(const VerifyReport& report) {
  Ending ending;
  ending.go = report.good();
  ending.verdict = report.good() ? "every image is as recorded" : "the recording is damaged";
  ending.numbers = {{"sets", fmt::format("{}", report.sets)},
                    {"images", fmt::format("{} listed, {} missing or altered", report.images,
                                           report.faults.size())}};
  for (const auto& [set, camera, file, what] : report.faults) {
    ending.rejected.push_back(
        fmt::format("set `{}`, camera `{}`, {}: {}", set, camera, file, what));
  }
  for (const std::string& file : report.not_listed) {
    ending.rejected.push_back(fmt::format("{}: not listed in recording.json", file));
  }
  return ending;
}

}  // namespace drape
