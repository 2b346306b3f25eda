// SPDX-License-Identifier: Apache-2.0
#include "capture/commands.hpp"

#include <algorithm>
#include <ctime>

#include "capture/ending.hpp"
#include "capture/live/record.hpp"
#include "core/error.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;

CaptureOptions options_with(const CommonOptions& common, Progress& progress) {
  CaptureOptions options;
  options.threads = thread_count(common);
  options.progress = [&progress](double fraction, const std::string& file) {
    progress.update(fraction, file);
  };
  return options;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
  return text;
}

}  // namespace

int run_capture(const CaptureCommand& command, std::vector<std::string> arguments,
                const CommonOptions& common) {
  if (command.rig.empty() || command.set.empty() || command.recording.empty())
    throw usage_error("a capture needs RIG, --set and --out", "see `drape capture --help`");
  RunRecord record("drape-capture", std::move(arguments));
  const CamerasFile cameras = read_cameras_file(command.rig);
  RecordOptions storing;
  storing.folder = command.recording;
  storing.set = command.set;
  storing.average = command.average;
  storing.largest_spread_s = cameras.largest_spread_s;
  storing.recorded_on = today();
  storing.format = command.format;
  storing.still.calibration = command.calibration;
  require_new_set(storing);

  Progress progress("capture", common.quiet);
  LiveOptions options;
  options.frames = command.frames;
  options.patience_s = command.patience_s;
  options.opening_s = std::max(options.opening_s, command.patience_s);
  options.host_program = camera_host_program();
  options.progress = [&progress](double done, const std::string& what) {
    progress.update(done, what);
  };
  const LiveResult live = capture_live(cameras, options);
  const RecordResult stored = record_live(live, cameras, storing);
  const Ending ending = ending_of(live.report, stored, command.frames, command.recording);
  record.input(cameras.file);
  if (command.calibration) record.input(*command.calibration);
  if (!stored.sets.empty()) {
    const fs::path manifest = command.recording / "recording.json";
    record.output(manifest);
    record.write(run_record_path(manifest), ending.go ? 0 : 1);
  }
  return finish(ending, common);
}

int run_import(const fs::path& folder, const fs::path& recording_folder,
               const std::optional<std::string>& recorded_on, std::vector<std::string> arguments,
               const CommonOptions& common) {
  RunRecord record("drape-capture", std::move(arguments));
  Progress progress("import", common.quiet);
  CaptureOptions options = options_with(common, progress);
  options.recorded_on = recorded_on;
  const ImportResult result = import_folder(folder, recording_folder, options);
  for (const FrameSet& set : result.recording.sets) {
    for (const RecordedFrame& frame : set.frames) record.input(folder / frame.file, frame.sha256);
  }
  const fs::path manifest = recording_folder / "recording.json";
  record.output(manifest);  // which holds the hashes of the copied images
  record.write(run_record_path(manifest), 0);
  return finish(ending_of(result, recording_folder), common);
}

int run_verify(const fs::path& recording_folder, const CommonOptions& common) {
  Progress progress("verify", common.quiet);
  const auto report = verify_recording(recording_folder, options_with(common, progress));
  finish(ending_of(report), common);
  return report.good() ? 0 : static_cast<int>(ErrorKind::bad_input);
}

}  // namespace drape::capture
