// SPDX-License-Identifier: Apache-2.0
#include "capture/ending.hpp"
#include "core/error.hpp"
#include "core/progress.hpp"
#include "core/run_record.hpp"

namespace {

namespace fs = std::filesystem;

drape::CaptureOptions options_with(const drape::CommonOptions& common, drape::Progress& progress) {
  return {drape::thread_count(common), [&progress](double fraction, const std::string& file) {
            progress.update(fraction, file);
          }};
}

int import(const fs::path& folder, const fs::path& recording_folder,
           std::vector<std::string> arguments, const drape::CommonOptions& common) {
  drape::RunRecord record("drape-capture", std::move(arguments));
  drape::Progress progress("import", common.quiet);
  const drape::ImportResult result =
      drape::import_folder(folder, recording_folder, options_with(common, progress));
  for (const drape::FrameSet& set : result.recording.sets) {
    for (const drape::RecordedFrame& frame : set.frames) {
      record.input(folder / frame.file, frame.sha256);
    }
  }
  const fs::path manifest = recording_folder / "recording.json";
  record.output(manifest);  // which holds the hashes of the copied images
  record.write(drape::run_record_path(manifest), 0);
  return finish(ending_of(result, recording_folder), common);
}

int verify(const fs::path& recording_folder, const drape::CommonOptions& common) {
  drape::Progress progress("verify", common.quiet);
  const auto report = drape::verify_recording(recording_folder, options_with(common, progress));
  finish(ending_of(report), common);
  return report.good() ? 0 : static_cast<int>(drape::ErrorKind::bad_input);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Makes recordings of image sets and checks them.\n\n"
      "  drape-capture import photos --out recording    photos/<set>/<camera>.png\n"
      "  drape-capture verify recording                 every image against its SHA-256\n",
      "drape-capture");
  drape::CommonOptions common;
  add_common_options(app, common);
  app.fallthrough();  // so that subcommands take the common options too
  app.require_subcommand(1);
  fs::path folder;
  fs::path recording;
  CLI::App* importing = app.add_subcommand("import", "images from elsewhere to a recording");
  importing->add_option("FOLDER", folder, "FOLDER/<set>/<camera>.png|jpg|jpeg|tif|tiff")
      ->required();
  importing
      ->add_option("--out", recording, "recording to write; FOLDER itself adds only the manifest")
      ->required();
  CLI::App* verifying = app.add_subcommand("verify", "is every image as it was recorded?");
  verifying->add_option("RECORDING", recording, "folder with recording.json")->required();
  return drape::run_program(app, argc, argv, common, [&] {
    return importing->parsed() ? import(folder, recording, drape::arguments_of(argc, argv), common)
                               : verify(recording, common);
  });
}
