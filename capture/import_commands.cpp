// SPDX-License-Identifier: Apache-2.0
// The commands that need no camera.
#include "capture/commands.hpp"
#include "capture/ending.hpp"
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

}  // namespace

int run_import(const fs::path& folder, const fs::path& recording_folder,
               const std::optional<std::string>& recorded_on, bool allow_missing,
               std::vector<std::string> arguments, const CommonOptions& common) {
  require_importable(folder, recording_folder);  // before the record makes a folder
  const fs::path manifest = recording_folder / "recording.json";
  RunRecord record("drape-capture", std::move(arguments), run_record_path(manifest));
  Progress progress("import", common.quiet);
  CaptureOptions options = options_with(common, progress);
  options.recorded_on = recorded_on;
  options.allow_missing = allow_missing;
  const ImportResult result = import_folder(folder, recording_folder, options);
  for (const FrameSet& set : result.recording.sets) {
    for (const RecordedFrame& frame : set.frames) record.input(folder / frame.file, frame.sha256);
    if (const fs::path notes = folder / set.name / "capture.json"; fs::exists(notes))
      record.input(notes);
  }
  record.output(manifest);  // which holds the hashes of the copied images
  return finish(ending_of(result, recording_folder), common, record);
}

int run_verify(const fs::path& recording_folder, const CommonOptions& common) {
  Progress progress("verify", common.quiet);
  const auto report = verify_recording(recording_folder, options_with(common, progress));
  finish(ending_of(report), common);
  return report.good() ? 0 : static_cast<int>(ErrorKind::bad_input);
}

}  // namespace drape::capture
