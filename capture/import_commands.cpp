// SPDX-License-Identifier: Apache-2.0
// Commands of drape-capture that need no camera.
#include "capture/commands.hpp"
#include "capture/ending.hpp"
#include "core/error.hpp"
#include "core/fields/fields.hpp"
#include "core/program/command.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;

struct ImportOptions {
  fs::path folder, recording;
  std::optional<std::string> recorded_on;
  bool allow_missing = false;
};

void fields(Fields& f, ImportOptions& o) {
  f(Field{"folder", "FOLDER/<set>/<camera>.png|jpg|jpeg|tif|tiff"}.called("FOLDER"), o.folder);
  f({"out", "recording to write; FOLDER itself adds only the manifest"}, o.recording);
  f({"recorded_on", "date of the recording, e.g. 2026-01-31"}, o.recorded_on);
  f.otherwise({"allow_missing", "warn instead of failing if a set lacks a camera's image"},
              o.allow_missing);
}

struct VerifyOptions {
  fs::path recording;
};

void fields(Fields& f, VerifyOptions& o) {
  f(Field{"recording", "folder with recording.json"}.called("RECORDING"), o.recording);
}

CaptureOptions options_with(const CommonOptions& common, Progress& progress) {
  CaptureOptions options;
  options.threads = thread_count(common);
  options.progress = [&progress](double fraction, const std::string& file) {
    progress.update(fraction, file);
  };
  return options;
}

}  // namespace

int import_command(int argc, char** argv) {
  const auto run = [](const ImportOptions& o, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    require_importable(o.folder, o.recording);  // before the run record creates a folder
    const fs::path manifest = o.recording / "recording.json";
    RunRecord record("drape-capture", words, run_record_path(manifest));
    Progress progress("import", common.quiet);
    CaptureOptions options = options_with(common, progress);
    options.recorded_on = o.recorded_on;
    options.allow_missing = o.allow_missing;
    const ImportResult result = import_folder(o.folder, o.recording, options);
    for (const FrameSet& set : result.recording.sets) {
      for (const RecordedFrame& frame : set.frames)
        record.input(o.folder / frame.file, frame.sha256);
      if (const fs::path notes = o.folder / set.name / "capture.json"; fs::exists(notes))
        record.input(notes);
    }
    record.output(manifest);  // recording.json holds the hashes of the copies
    return finish(ending_of(result, o.recording), common, record);
  };
  return run_command<ImportOptions>(
      argc, argv, "drape-capture import",
      "Makes a recording of images from elsewhere: FOLDER/<set>/<camera>.png|jpg|tif", run);
}

int verify_command(int argc, char** argv) {
  const auto run = [](const VerifyOptions& o, const CommonOptions& common) {
    Progress progress("verify", common.quiet);
    const auto report = verify_recording(o.recording, options_with(common, progress));
    finish(ending_of(report), common);
    return report.good() ? 0 : static_cast<int>(ErrorKind::bad_input);
  };
  return run_command<VerifyOptions>(
      argc, argv, "drape-capture verify",
      "Compares every image of a recording with the hash that was recorded", run);
}

}  // namespace drape::capture
