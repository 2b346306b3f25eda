// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "calib/acceptance/ending.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"

namespace fs = std::filesystem;
using namespace drape;
using namespace drape::calib;

int main(int argc, char** argv) {
  Command app(
      "Accepts a calibrated rig by measuring its own target: lengths and flatness at seven or "
      "more\n"
      "positions, a known shift of the z stage, and the noise of repeats, each with its expanded\n"
      "uncertainty and limit (after VDI/VDE 2634-1 and ISO 10360-13). Record sets that the\n"
      "calibration did not use.\n\n"
      "  drape accept detections.json --calibration calibration.json --rig rigs/bench1 \\\n"
      "    --repeats rest_1,rest_2,rest_3 --date 2026-01-31 --out acceptance.json",
      "drape-accept");
  CommonOptions common;
  AcceptanceOptions options;
  fs::path detections_file, calibration_file, rig_file, out;
  std::vector<std::string> repeats;
  std::string date = "no date";
  app.add_option("DETECTIONS", detections_file, "detections.json of the target")->required();
  app.add_option("--calibration", calibration_file, "calibration.json to accept")->required();
  app.add_option("--rig", rig_file, "rig folder or its rig.toml")->required();
  app.add_option("--out", out, "acceptance.json to write; a page for printing beside it")
      ->required();
  app.add_option("--repeats", repeats, "sets of the target at rest, for the noise floor")
      ->delimiter(',');
  app.add_option("--date", date, "day of the test, for the protocol");
  app.add_option("--max-length-error-mm", options.max_length_error_mm, "limit")
      ->capture_default_str();
  app.add_option("--max-flatness-mm", options.max_flatness_mm, "limit")->capture_default_str();
  app.add_option("--max-shift-error-mm", options.max_shift_error_mm, "limit")
      ->capture_default_str();
  app.add_option("--max-noise-ratio", options.max_noise_ratio, "limit, of the stated noise")
      ->capture_default_str();
  app.add_option("--shift-uncertainty-mm", options.shift_uncertainty_mm,
                 "standard uncertainty of a height in rig.toml")
      ->capture_default_str();
  app.add_option("--least-positions", options.least_positions, "with all five lengths")
      ->capture_default_str();
  add_common_options(app, common);
  return run_program(app, argc, argv, common, [&] {
    if (fs::is_directory(rig_file)) rig_file /= "rig.toml";
    RunRecord record("drape-accept", arguments_of(argc, argv), run_record_path(out));
    const Rig rig = read_rig(rig_file);
    for (const fs::path& input : {rig.file, rig.target_file, detections_file, calibration_file})
      record.input(input);
    Acceptance acceptance =
        accept(read_detections(detections_file), read_calibration(calibration_file), rig,
               read_target(rig.target_file), repeats, options);
    acceptance.calibration_sha256 = sha256_of_file(calibration_file);
    const fs::path page = fs::path(out).replace_extension(".html");
    write_json(out, json_of(acceptance));
    write_durable(page, protocol_page(acceptance, date));
    record.output(out);
    record.output(page);
    return finish(ending_of(acceptance, page), common, record);
  });
}
