// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "capture/capture.hpp"
#include "core/error.hpp"
#include "core/program.hpp"
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
  drape::Progress progress("capture", common.quiet);
  const auto [recording, report] =
      drape::import_folder(folder, recording_folder, options_with(common, progress));
  for (const drape::FrameSet& set : recording.sets) {
    for (const drape::RecordedFrame& frame : set.frames) {
      record.input(folder / frame.file, frame.sha256);
    }
  }
  const fs::path manifest = recording_folder / "recording.json";
  record.output(manifest);

  drape::Ending ending;
  ending.verdict = fmt::format("imported {} into {}",
                               report.in_place ? "in place" : folder.string(), manifest.string());
  ending.numbers = {{"sets", fmt::format("{}", recording.sets.size())},
                    {"cameras", fmt::format("{}", report.cameras.size())},
                    {"images", fmt::format("{} whole, {:.1f} MB", report.images,
                                           static_cast<double>(report.image_bytes) / 1e6)}};
  for (const auto& [file, reason] : report.ignored) {
    ending.rejected.push_back(fmt::format("{}: {}", file, reason));
  }
  for (const std::string& warning : report.warnings) ending.rejected.push_back(warning);
  ending.next_command =
      fmt::format("drape-detect {} --rig RIG --surface target --sets SETS --out detections.json",
                  recording_folder.string());
  record.write(drape::run_record_path(manifest), 0);
  return finish(ending, common);
}

int verify(const fs::path& recording_folder, const drape::CommonOptions& common) {
  drape::Progress progress("verify", common.quiet);
  const auto report = drape::verify_recording(recording_folder, options_with(common, progress));
  drape::Ending ending;
  ending.go = report.good();
  ending.verdict = report.good() ? "every image is as recorded" : "the recording is damaged";
  ending.numbers = {{"sets", fmt::format("{}", report.sets)},
                    {"images", fmt::format("{} listed, {} missing or altered", report.images,
                                           report.faults.size())}};
  for (const auto& fault : report.faults) {
    ending.rejected.push_back(fmt::format("set `{}`, camera `{}`, {}: {}", fault.set, fault.camera,
                                          fault.file, fault.what));
  }
  for (const std::string& file : report.not_listed) {
    ending.rejected.push_back(fmt::format("{}: not listed in recording.json", file));
  }
  finish(ending, common);
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
  app.require_subcommand(1);
  fs::path folder;
  fs::path recording;
  CLI::App* import_command = app.add_subcommand("import", "Images from elsewhere to a recording");
  import_command->add_option("FOLDER", folder, "FOLDER/<set>/<camera>.png|jpg|jpeg|tif|tiff")
      ->required();
  import_command
      ->add_option("--out", recording, "Recording to write; FOLDER itself adds only the manifest")
      ->required();
  CLI::App* verify_command = app.add_subcommand("verify", "Is every image as it was recorded?");
  verify_command->add_option("RECORDING", recording, "Folder with recording.json")->required();
  app.fallthrough();
  return drape::run_program(app, argc, argv, common, [&] {
    return import_command->parsed()
               ? import(folder, recording, drape::arguments_of(argc, argv), common)
               : verify(recording, common);
  });
}
