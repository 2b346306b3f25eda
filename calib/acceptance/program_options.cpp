// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/program_options.hpp"

#include <string>

#include "core/error.hpp"
#include "core/program/command.hpp"

namespace drape::calib {

void add_acceptance_options(Command& app, AcceptanceArguments& arguments) {
  AcceptanceOptions& options = arguments.options;
  app.add_option("DETECTIONS", arguments.detections, "detections.json of the target")->required();
  app.add_option("--calibration", arguments.calibration, "calibration.json to accept")->required();
  app.add_option("--rig", arguments.rig, "rig folder or its rig.toml")->required();
  app.add_option("--out", arguments.out,
                 "acceptance.json to write, beside rig.toml for `drape run` and `drape doctor`; a "
                 "page for printing beside it")
      ->required();
  app.add_option("--target", arguments.target,
                 "target file of another plate than the one that calibrated: with its own "
                 "[known_length] it tests the scale too");
  app.add_option("--bow-mm", arguments.bow_mm,
                 "how far the plate's edges stand above its middle along x and y, as `drape calib` "
                 "found it (default: flat)")
      ->expected(2, 2);
  app.add_option("--bow-sd-mm", arguments.bow_sd_mm,
                 "standard uncertainty of that bow along x and y (default: exact)")
      ->expected(2, 2);
  app.add_option("--repeats", arguments.repeats, "sets of the target at rest, for the noise floor")
      ->delimiter(',');
  app.add_option("--sphere", arguments.sphere,
                 "detections.json of a ball that carries the print, all its marks on the ball");
  app.add_option("--sphere-diameter-mm", arguments.sphere_diameter_mm, "over the print");
  app.add_option("--sphere-uncertainty-mm", arguments.sphere_uncertainty_mm,
                 "standard uncertainty of the diameter")
      ->capture_default_str();
  app.add_option("--date", arguments.date, "day of the test, as 2026-01-31");
  app.add_option("--valid-days", arguments.valid_days,
                 "days after which `drape run` and `drape doctor` ask for another test")
      ->capture_default_str();
  app.add_option("--max-length-error-mm", options.max_length_error_mm,
                 "limit; a change of plate or cameras that it permits is a warning");
  app.add_option("--max-flatness-mm", options.max_flatness_mm, "limit");
  app.add_option("--max-shift-error-mm", options.max_shift_error_mm, "limit");
  app.add_option("--max-sphere-form-mm", options.max_sphere_form_mm, "limit");
  app.add_option("--max-sphere-size-mm", options.max_sphere_size_mm, "limit, of the diameter");
  app.add_option("--max-noise-ratio", options.max_noise_ratio, "limit, of the stated noise")
      ->capture_default_str();
  app.add_option("--shift-uncertainty-mm", options.shift_uncertainty_mm,
                 "standard uncertainty of a height in rig.toml")
      ->capture_default_str();
  app.add_option("--least-positions", options.least_positions,
                 "places of the target with all five lengths; sets of one place are one")
      ->capture_default_str();
}

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

}  // namespace drape::calib
