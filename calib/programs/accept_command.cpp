// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "calib/acceptance/ending.hpp"
#include "calib/acceptance/positions.hpp"
#include "calib/acceptance/program_options.hpp"
#include "calib/programs/commands.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"

namespace drape::calib {

namespace fs = std::filesystem;

int accept_command(int argc, char** argv) {
  Command app(
      "Accepts a calibrated rig by what it measures: lengths and flatness of a plate at seven or "
      "more\n"
      "positions, a known shift of the z stage, a ball with the print on it, the noise of "
      "repeats,\n"
      "each with its expanded uncertainty and limit (after VDI/VDE 2634 and ISO 10360-13); and\n"
      "whether the plate or a camera changed since the calibration. Record sets that the\n"
      "calibration did not use. A limit that is not given follows from the uncertainties of\n"
      "calibration, marks and print: it is what this instrument can prove.\n\n"
      "  drape calib accept detections.json --calibration calibration.json --rig rigs/bench1 \\\n"
      "    --repeats rest_1,rest_2,rest_3 --date 2026-01-31 --out rigs/bench1/acceptance.json",
      "drape-calib accept");
  CommonOptions common;
  AcceptanceArguments arguments;
  add_acceptance_options(app, arguments);
  add_common_options(app, common);
  return run_program(app, argc, argv, common, [&] {
    refuse_idle_options(app);
    fs::path rig_file = arguments.rig;
    if (fs::is_directory(rig_file)) rig_file /= "rig.toml";
    const AcceptanceDates dates = dates_of(arguments.date, arguments.valid_days);
    const fs::path page = fs::path(arguments.out).replace_extension(".html");
    StepFiles files{{arguments.out, page}, {rig_file, arguments.detections, arguments.calibration}};
    if (arguments.sphere) files.inputs.push_back(*arguments.sphere);
    RunRecord record("drape-calib", arguments_of(argc, argv), run_record_path(arguments.out),
                     files);
    const Rig rig = read_rig(rig_file);
    const fs::path target_file = arguments.target.value_or(rig.target_file);
    record.input(target_file);
    AcceptanceInput input{read_detections(arguments.detections), arguments.repeats, {}};
    input.calibrated = detections_behind(arguments.calibration, arguments.detections);
    input.file = arguments.detections.string();
    if (arguments.sphere)
      input.sphere = SphereInput{read_detections(*arguments.sphere), arguments.sphere_diameter_mm,
                                 arguments.sphere_uncertainty_mm};
    AcceptanceOptions options = arguments.options;
    if (arguments.bow_mm.size() == 2) options.bow_mm = {arguments.bow_mm[0], arguments.bow_mm[1]};
    if (arguments.bow_sd_mm.size() == 2)
      options.bow_sd_mm = {arguments.bow_sd_mm[0], arguments.bow_sd_mm[1]};
    options.own_target = !arguments.target.has_value();
    Acceptance acceptance = accept(input, read_calibration(arguments.calibration), rig,
                                   read_target(target_file), options);
    acceptance.calibration_sha256 = sha256_of_file(arguments.calibration);
    write_json(arguments.out, json_of(acceptance, dates));
    write_durable(page, protocol_page(acceptance, dates));
    return finish(ending_of(acceptance, page), common, record);
  });
}

}  // namespace drape::calib
