// SPDX-License-Identifier: Apache-2.0
#include "capture/ending.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "capture/pixel/pixel_format.hpp"
#include "core/program/shell_word.hpp"

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
  ending.warnings = report.warnings;
  ending.next_command =
      fmt::format("drape detect {} --rig RIG --surface target --sets SETS --out detections.json",
                  shell_word(recording_folder.string()));
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
  for (const std::string& why : report.no_go)
    ending.warnings.push_back("no measurement, as recorded: " + why);
  for (const std::string& set : report.in_journal)
    ending.warnings.push_back(
        fmt::format("set `{}` is in the journal of a capture that goes on, or was ended; the next "
                    "capture takes it over",
                    set));
  return ending;
}

std::string line_of(const LiveFault& fault) {
  return fmt::format("{}{}{}{}{}",
                     fault.camera.empty() ? "" : "camera `" + fault.camera + "`: ", fault.what,
                     fault.times > 1 ? fmt::format(" ({} times)", fault.times) : "",
                     fault.what_to_do.empty() ? "" : "; to do: ", fault.what_to_do);
}

namespace {

std::string ledger_line(const LiveCameraReport& camera) {
  const CameraLedger& l = camera.ledger;
  std::string line =
      fmt::format("{} frames expected: {} in sets, {} unpaired, {} incomplete, {} never arrived",
                  l.expected, l.in_set, l.unpaired, l.incomplete, l.never_arrived);
  if (l.repeated > 0) line += fmt::format(", {} repeated", l.repeated);
  line += fmt::format("; {} packets resent", camera.counters.packets_resent);
  if (camera.frames_without_room > 0)
    line +=
        fmt::format("; {} found no room while this machine was busy", camera.frames_without_room);
  if (camera.longest_gap_s > 0)
    line += fmt::format("; lost: noticed after {:.2f} s, back {:.2f} s later",
                        camera.longest_unnoticed_s, camera.longest_gap_s);
  return line;
}

}  // namespace

Ending ending_of(const LiveReport& report, const RecordResult& stored, int sets_wanted,
                 const std::filesystem::path& recording_folder) {
  Ending ending;
  const auto moved = stored.still.cloth_fault();
  const auto wanted = static_cast<std::size_t>(sets_wanted);
  ending.go =
      stored.refused.empty() && stored.sets.size() >= wanted && !moved && !stored.short_average;
  ending.verdict = stored.sets.empty()
                       ? "nothing was stored"
                       : fmt::format("{} of {} sets stored in {}", stored.sets.size(), wanted,
                                     (recording_folder / "recording.json").string());
  ending.numbers.emplace_back("sets", fmt::format("{}", fmt::join(stored.sets, ", ")));
  if (stored.averaged > 0)
    ending.numbers.emplace_back("averaged", fmt::format("{} frames", stored.averaged));
  ending.numbers.emplace_back("sync", to_string(report.method));
  if (report.paired_by == PairedBy::arrival)
    ending.numbers.emplace_back("paired by", "arrival: the spread of a set is not known");
  if (!stored.spread_bounds_s.empty())
    ending.numbers.emplace_back(
        "spread", fmt::format("not known without clocks; at most {:.0f} ms, from the trigger to "
                              "the last frame's arrival",
                              1e3 * *std::max_element(stored.spread_bounds_s.begin(),
                                                      stored.spread_bounds_s.end())));
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
  for (const LiveCameraReport& camera : report.cameras)
    ending.numbers.emplace_back(camera.name, ledger_line(camera));
  for (const LiveCameraReport& camera : report.cameras)
    for (const SettingReadBack& one : camera.settings)
      if (const PixelFormat* format = find_pixel_format(one.value);
          one.name == "pixel_format" && format != nullptr && format->lossy())
        ending.warnings.push_back(
            fmt::format("{} sends {}, which is lossy: a dot's centre is less sure "
                        "(capture/README.md, Pixels)",
                        camera.name, one.value));
  if (const auto& why = stored.still.calibration_no_go)
    ending.warnings.push_back("no speed in mm/s: the calibration is NO-GO: " + *why);
  for (const std::string& camera : stored.still.not_judged())
    ending.warnings.push_back(
        fmt::format("{}: stillness could not be judged: its pictures have structure in one "
                    "direction only, or none above their noise",
                    camera));
  for (const LiveFault& fault : report.faults) ending.rejected.push_back(line_of(fault));
  if (moved) ending.rejected.push_back(line_of(*moved));
  if (stored.short_average) ending.rejected.push_back(line_of(*stored.short_average));
  for (const LiveFault& fault : stored.refused) ending.rejected.push_back(line_of(fault));
  ending.next_command =
      ending.go ? fmt::format("drape-capture verify {}", shell_word(recording_folder.string()))
                : "drape doctor RIG";
  return ending;
}

}  // namespace drape::capture
