// SPDX-License-Identifier: Apache-2.0
#include "capture/ending.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace drape::capture {

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

Ending ending_of(const LiveReport& report, const RecordResult& stored, int frames,
                 const std::filesystem::path& recording_folder) {
  Ending ending;
  const std::size_t captured =
      report.cameras.empty() ? 0 : static_cast<std::size_t>(report.cameras[0].ledger.in_set);
  ending.go = stored.refused.empty() && captured >= static_cast<std::size_t>(frames);
  ending.verdict = stored.sets.empty()
                       ? "nothing was stored"
                       : fmt::format("{} of {} sets captured, stored in {}", captured, frames,
                                     (recording_folder / "recording.json").string());
  ending.numbers.emplace_back("sets", fmt::format("{}", fmt::join(stored.sets, ", ")));
  ending.numbers.emplace_back("sync", to_string(report.method));
  if (!report.why_fallen_back.empty())
    ending.numbers.emplace_back("fallen back", report.why_fallen_back);
  if (stored.still.motion_px)
    ending.numbers.emplace_back(
        "cloth",
        fmt::format("{}: largest motion {:.3f} px{}", stored.still.cloth_moved ? "moved" : "still",
                    *stored.still.motion_px,
                    stored.still.sync_error_mm
                        ? fmt::format(", {:.2f} mm/s, {:.4f} mm during the spread",
                                      *stored.still.speed_mm_per_s, *stored.still.sync_error_mm)
                        : ""));
  if (stored.still.background_shift_px)
    ending.numbers.emplace_back(
        "background",
        fmt::format("{:.2f} px from the reference set at most", *stored.still.background_shift_px));
  for (const LiveCameraReport& camera : report.cameras) {
    const CameraLedger& l = camera.ledger;
    ending.numbers.emplace_back(
        camera.name,
        fmt::format("{} frames expected: {} in sets, {} unpaired, {} incomplete, {} never arrived; "
                    "{} packets resent{}",
                    l.expected, l.in_set, l.unpaired, l.incomplete, l.never_arrived,
                    camera.counters.packets_resent,
                    camera.longest_gap_s > 0
                        ? fmt::format("; lost: noticed after {:.2f} s, back {:.2f} s later",
                                      camera.longest_unnoticed_s, camera.longest_gap_s)
                        : ""));
  }
  for (const auto& [camera, what, to_do] : report.faults)
    ending.rejected.push_back(fmt::format("camera `{}`: {}; to do: {}", camera, what, to_do));
  const auto moved = stored.still.cloth_fault();
  ending.go = ending.go && !moved;
  if (moved)
    ending.rejected.push_back(fmt::format("{}; to do: {}", moved->what, moved->what_to_do));
  for (const auto& [camera, what, to_do] : stored.refused)
    ending.rejected.push_back(fmt::format(
        "{}{}; to do: {}", camera.empty() ? "" : "camera `" + camera + "`, ", what, to_do));
  ending.next_command = ending.go
                            ? fmt::format("drape-capture verify {}", recording_folder.string())
                            : "drape doctor RIG";
  return ending;
}

}  // namespace drape::capture
