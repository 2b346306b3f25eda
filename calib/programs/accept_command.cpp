// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "calib/acceptance/ending.hpp"
#include "calib/acceptance/positions.hpp"
#include "calib/programs/commands.hpp"
#include "core/error.hpp"
#include "core/fields/fields.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"

namespace drape::calib {

namespace fs = std::filesystem;

namespace {

struct AcceptanceArguments {
  fs::path detections, calibration, rig, out;
  std::optional<fs::path> target, sphere;
  std::optional<double> sphere_diameter_mm;
  double sphere_uncertainty_mm = 0.01;
  std::vector<std::string> repeats;
  std::string date;
  int valid_days = 365;
  AcceptanceOptions options;
};

void fields(Fields& f, AcceptanceArguments& a) {
  f(Field{"detections", "detections.json of the target"}.called("DETECTIONS"), a.detections);
  f({"calibration", "calibration.json to accept"}, a.calibration);
  f({"rig", "rig folder or its rig.toml"}, a.rig);
  f({"out",
     "acceptance.json to write, beside rig.toml for `drape run` and `drape doctor`; a page for "
     "printing beside it"},
    a.out);
  f.if_any({"target",
            "target file of a plate other than the calibration's: its own [known_length] also "
            "tests the scale"},
           a.target);
  f.if_any(Field{"repeats", "sets of the target at rest, for the noise floor"}.plain_name(),
           a.repeats);
  f.if_any({"sphere", "detections.json of a ball with the print on it, all marks on the ball"},
           a.sphere);
  f.if_any({"sphere_diameter_mm", "diameter of the ball including the print, mm", 1, above_zero},
           a.sphere_diameter_mm);
  f.otherwise({"sphere_uncertainty_mm", "standard uncertainty of the diameter, mm", 1, 0},
              a.sphere_uncertainty_mm);
  f.otherwise({"date", "date of the test, e.g. 2026-01-31"}, a.date);
  f.otherwise(
      {"valid_days", "days after which `drape run` and `drape doctor` ask for another test", 1, 1},
      a.valid_days);
  fields(f, a.options);
}

/// Throws Error(usage) for an option without effect, of a ball without --sphere or of a date
/// without --date, and for a ball of unknown size.
void refuse_idle_options(const Command& app) {
  const auto needs = [&](const std::string& option, const std::string& other) {
    if (app.count(option) > 0 && app.count(other) == 0)
      throw usage_error(option + " says nothing without " + other,
                        "add " + other + ", or leave " + option + " out");
  };
  for (const char* option : {"--sphere-diameter-mm", "--sphere-uncertainty-mm",
                             "--max-sphere-form-mm", "--max-sphere-size-mm"})
    needs(option, "--sphere");
  needs("--sphere", "--sphere-diameter-mm");
  needs("--valid-days", "--date");
}

}  // namespace

int accept_command(int argc, char** argv) {
  Command app(
      "Tests and accepts a calibrated rig by its measurements: lengths and flatness of a plate at "
      "seven or "
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
  add_common_options(app, common);
  app.add_record(arguments);
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
      input.sphere = SphereInput{read_detections(*arguments.sphere), *arguments.sphere_diameter_mm,
                                 arguments.sphere_uncertainty_mm};
    AcceptanceOptions options = arguments.options;
    options.own_target = !arguments.target.has_value();
    Acceptance acceptance = accept(input, read_calibration(arguments.calibration), rig,
                                   read_target(target_file), options);
    acceptance.calibration_sha256 = sha256_of_file(arguments.calibration);
    write_record(arguments.out, file_of(acceptance, dates));
    write_durable(page, protocol_page(acceptance, dates));
    return finish(ending_of(acceptance, page), common, record);
  });
}

}  // namespace drape::calib
