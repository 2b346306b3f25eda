// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/error.hpp"
#include "core/fields/fields.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "detect/detect.hpp"

namespace drape::detect {

namespace fs = std::filesystem;

namespace {

/// Throws before any measurement if the overlay folder (empty: none) is not a
/// folder, or lies in the recording, where overlays could overwrite a camera's
/// pictures.
void require_apart(const fs::path& recording, const fs::path& out, const fs::path& overlays) {
  const fs::path folder =
      fs::weakly_canonical(fs::absolute(recording / "recording.json")).parent_path();
  const auto is_inside = [&](const fs::path& place) {
    const fs::path real = fs::weakly_canonical(fs::absolute(place));
    return std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first ==
           folder.end();
  };
  for (const auto& [option, place] : {std::pair("--out", out), std::pair("--overlay", overlays)})
    if (!place.empty() && is_inside(place))
      throw usage_error(fmt::format("{} {} lies inside the recording {}", option, place.string(),
                                    recording.string()),
                        "give a place outside: a recording stays as it was taken");
  if (!overlays.empty() && fs::exists(overlays) && !fs::is_directory(overlays))
    throw bad_input("a file stands where a folder is to be made", {.file = overlays.string()},
                    "give --overlay another place");
}

/// Ending of the command; `is_plate`: the target is on an object, not the rig's own.
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

void write_pictures(const std::vector<Picture>& pictures, const fs::path& folder,
                    RunRecord& record) {
  for (const Picture& picture : pictures) {
    const fs::path file = folder / picture.file_name;
    write_durable(file,
                  {reinterpret_cast<const char*>(picture.bytes.data()), picture.bytes.size()});
    record.output(file);
  }
}

void note_frames(const DetectResult& result, const Recording& recording, RunRecord& record) {
  for (const FrameDetections& frame : result.detections.frames) {
    for (const RecordedFrame& recorded : recording.set(frame.set).frames) {
      if (recorded.camera == frame.camera) {
        record.input(recording.folder / recorded.file, recorded.sha256);
      }
    }
  }
}

struct DetectArguments {
  fs::path recording, rig, target, out, overlay;
  Surface surface = Surface::cloth;
  std::vector<std::string> sets;
};

void fields(Fields& f, DetectArguments& a) {
  f(Field{"recording", "folder with recording.json"}.called("RECORDING"), a.recording);
  f({"rig", "rig folder or its rig.toml"}, a.rig);
  f({"surface", "surface in the pictures"}, a.surface);
  f.otherwise(
      {"target", "a target other than the rig's, e.g. an object's plate (drape print object-tags)"},
      a.target);
  f.if_any(Field{"sets", "frame sets a,b,c (default: all the rig names)"}.plain_name(), a.sets);
  f({"out", "detections.json to write"}, a.out);
  f.otherwise({"overlay", "folder for PNGs with the marks drawn in"}, a.overlay);
}

}  // namespace

int print_command(int argc, char** argv);

int detect_command(int argc, char** argv) {
  const auto run = [](DetectArguments& given, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    if (fs::is_directory(given.rig)) given.rig /= "rig.toml";
    require_apart(given.recording, given.out, given.overlay);
    RunRecord record("drape-detect", words, run_record_path(given.out), {{given.out}, {given.rig}});
    Rig rig = read_rig(given.rig);
    if (!given.target.empty()) rig.target_file = given.target;
    DetectOptions options;
    options.surface = given.surface;
    options.sets = given.sets.empty() ? default_sets(rig, given.surface) : given.sets;
    record.input_sets(given.recording / "recording.json", options.sets);
    const Recording recording = read_recording(given.recording);
    record.input(given.surface == Surface::target ? rig.target_file : rig.print_file);
    options.threads = thread_count(common);
    if (given.out.stem() != "detections") options.preview_prefix = given.out.stem().string() + "_";
    options.overlays = !given.overlay.empty();
    Progress progress("detect", common.quiet);
    const DetectResult result = drape::detect::detect(
        recording, rig, options,
        [&](double fraction, const std::string& what) { progress.update(fraction, what); });
    const fs::path folder = given.out.parent_path();
    write_pictures(result.previews, folder, record);
    write_pictures(result.overlays, given.overlay, record);
    write_detections(given.out, result.detections);
    note_frames(result, recording, record);
    record.option("surface", std::string(name_of(given.surface)));
    record.option("sets", fmt::format("{}", fmt::join(options.sets, ",")));
    return finish(
        ending_of(result.report, given.surface, !given.target.empty(), given.out.string()), common,
        record);
  };
  return run_command<DetectArguments>(argc, argv, "drape-detect",
                                      "Finds, labels and measures the printed marks of a recording",
                                      run);
}

}  // namespace drape::detect

int main(int argc, char** argv) {
  using namespace drape::detect;
  return drape::run_stage(argc, argv, detect_command,
                          {{"print", print_command, "marks and targets as exactly scaled pages"}});
}
