// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "detect/detect.hpp"
#include "detect/programs/ending.hpp"
#include "detect/programs/places.hpp"

namespace drape::detect {

namespace fs = std::filesystem;

namespace {

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

}  // namespace

int print_command(int argc, char** argv);

int detect_command(int argc, char** argv) {
  Command app("Finds, labels and measures the printed marks of a recording", "drape-detect");
  CommonOptions common;
  DetectOptions options;
  fs::path recording_folder, rig_file, target_file, out, overlay_folder;
  add_common_options(app, common);
  app.add_option("RECORDING", recording_folder, "folder with recording.json")->required();
  app.add_option("--rig", rig_file, "rig folder or its rig.toml")->required();
  app.add_choice<Surface>("--surface", options.surface,
                          {{"target", Surface::target}, {"cloth", Surface::cloth}},
                          "what the frames show")
      ->required();
  app.add_option("--target", target_file,
                 "another target than the rig's, e.g. an object's plate (drape print object-tags)");
  app.add_option("--sets", options.sets, "frame sets a,b,c (default: all the rig names)")
      ->delimiter(',');
  app.add_option("--out", out, "detections.json to write")->required();
  app.add_option("--overlay", overlay_folder, "folder for PNGs with the marks drawn in");
  return run_program(app, argc, argv, common, [&] {
    if (fs::is_directory(rig_file)) rig_file /= "rig.toml";
    require_apart(recording_folder, out, overlay_folder);
    RunRecord record("drape-detect", arguments_of(argc, argv), run_record_path(out),
                     {{out}, {rig_file}});
    Rig rig = read_rig(rig_file);
    if (!target_file.empty()) rig.target_file = target_file;
    if (options.sets.empty()) options.sets = default_sets(rig, options.surface);
    record.input_sets(recording_folder / "recording.json", options.sets);
    const Recording recording = read_recording(recording_folder);
    record.input(options.surface == Surface::target ? rig.target_file : rig.print_file);
    options.threads = thread_count(common);
    if (out.stem() != "detections") options.preview_prefix = out.stem().string() + "_";
    options.overlays = !overlay_folder.empty();
    Progress progress("detect", common.quiet);
    const DetectResult result = drape::detect::detect(
        recording, rig, options,
        [&](double fraction, const std::string& what) { progress.update(fraction, what); });
    const fs::path folder = out.parent_path();
    write_pictures(result.previews, folder, record);
    write_pictures(result.overlays, overlay_folder, record);
    write_detections(out, result.detections);
    note_frames(result, recording, record);
    record.option("surface", options.surface == Surface::target ? "target" : "cloth");
    record.option("sets", fmt::format("{}", fmt::join(options.sets, ",")));
    return finish(ending_of(result.report, options.surface, !target_file.empty(), out.string()),
                  common, record);
  });
}

}  // namespace drape::detect

int main(int argc, char** argv) {
  using namespace drape::detect;
  return drape::run_stage(argc, argv, detect_command,
                          {{"print", print_command, "marks and targets as exactly scaled pages"}});
}
