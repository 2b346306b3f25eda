// SPDX-License-Identifier: Apache-2.0
#include "capture/commands.hpp"
#include "capture/doctor/commands.hpp"
#include "core/program/command.hpp"

namespace drape::capture {
namespace {

int import_command(int argc, char** argv) {
  Command app("Makes a recording of images from elsewhere: FOLDER/<set>/<camera>.png|jpg|tif",
              "drape-capture import");
  CommonOptions common;
  std::filesystem::path folder, recording;
  std::optional<std::string> recorded_on;
  bool allow_missing = false;
  add_common_options(app, common);
  app.add_option("FOLDER", folder, "FOLDER/<set>/<camera>.png|jpg|jpeg|tif|tiff")->required();
  app.add_option("--out", recording, "recording to write; FOLDER itself adds only the manifest")
      ->required();
  app.add_option("--recorded-on", recorded_on, "day of the recording, as 2026-01-31");
  app.add_flag("--allow-missing", allow_missing,
               "a set may lack a camera's image: a warning, not an error");
  return run_program(app, argc, argv, common, [&] {
    return run_import(folder, recording, recorded_on, allow_missing, arguments_of(argc, argv),
                      common);
  });
}

int verify_command(int argc, char** argv) {
  Command app("Compares every image of a recording with the hash that was recorded",
              "drape-capture verify");
  CommonOptions common;
  std::filesystem::path recording;
  add_common_options(app, common);
  app.add_option("RECORDING", recording, "folder with recording.json")->required();
  return run_program(app, argc, argv, common, [&] { return run_verify(recording, common); });
}

int capture_command(int argc, char** argv) {
  Command app(
      "Captures sets of frames from the cameras of a rig, makes recordings of images from\n"
      "elsewhere, and checks recordings.\n\n"
      "  drape-capture rigs/lab --set drape_A --out recording    one set, all cameras at once\n"
      "  drape-capture rigs/lab --out recording                  a session: Enter takes the next "
      "set\n"
      "  drape-capture import photos --out recording             photos/<set>/<camera>.png\n"
      "  drape-capture verify recording                          every image against its SHA-256\n",
      "drape-capture");
  CommonOptions common;
  CaptureCommand command;
  add_common_options(app, common);
  app.add_option("RIG", command.rig, "folder with rig.toml and cameras.toml");
  app.add_option("--set", command.set, "name of the set to record; without it a session");
  app.add_option("--out", command.recording, "recording to make, or to add the set to");
  app.add_option("--frames", command.frames, "frames per camera: sets NAME_000, NAME_001, ...")
      ->range(1, 1000);
  app.add_flag("--average", command.average, "store one set, the mean of all frames");
  app.add_choice<FrameFormat>("--format", command.format,
                              {{"png", FrameFormat::png}, {"pgm", FrameFormat::pgm}},
                              "pgm is faster to write and takes twice the space");
  app.add_option("--calibration", command.calibration, "tells the cloth's speed in mm/s");
  app.add_option("--preview", command.preview,
                 "of a session: folder, best in memory, in which each camera's picture is renewed");
  app.add_option("--patience-s", command.patience_s, "give up when no frame comes for that long");
  return run_program(app, argc, argv, common,
                     [&] { return run_capture(command, arguments_of(argc, argv), common); });
}

}  // namespace
}  // namespace drape::capture

int main(int argc, char** argv) {
  using namespace drape::capture;
  return drape::run_stage(argc, argv, capture_command,
                          {{"import", import_command, "images from elsewhere to a recording"},
                           {"verify", verify_command, "is every image as it was recorded?"},
                           {"cameras", cameras_command, "lists the cameras that answer"},
                           {"doctor", doctor_command, "is the bench fit to measure?"}});
}
