// SPDX-License-Identifier: Apache-2.0
#include "synth/program_options.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/program/command.hpp"
#include "core/units.hpp"

namespace drape::synth {

using units::mm;

void add_options(Command& app, ProgramOptions& o) {
  RenderOptions& render = o.synth.render;
  app.add_option("RIG", o.rig, "rig folder or its rig.toml")->required();
  app.add_option("--out", o.out, "folder of the recording to write");
  app.add_flag("--predict", o.predict, "no pictures: what accuracy will these cameras give?");
  app.add_option("--cameras", o.cameras, "planned cameras (TOML): focal length, position");
  app.add_option("--calibration", o.calibration, "or cameras that are already calibrated");
  app.add_option("--accuracy-mm", o.accuracy_mm, "asked standard deviation of a mark in space")
      ->capture_default_str();
  app.add_option("--height-mm", o.height_mm, "height of the drape's volume above the origin")
      ->capture_default_str();
  app.add_option("--sets", o.synth.sets, "frame sets a,b,c (default: all the rig names)")
      ->delimiter(',');
  app.add_option("--sheet", o.sheets,
                 "SET=sheet.json: shape of the cloth in a set (default: folds)")
      ->one_per_flag();
  app.add_option("--slope-deg", o.synth.folds_slope_deg, "steepest slope of the folds")
      ->capture_default_str();
  app.add_option("--wavelength-mm", o.synth.folds_wavelength_mm, "of the folds")
      ->capture_default_str();
  app.add_option("--white-grey", render.white_grey, "level of the bare cloth")
      ->capture_default_str();
  app.add_option("--ink-ratio", render.ink_ratio, "level of the print by that of the cloth")
      ->capture_default_str();
  app.add_option("--blur-px", render.blur_px, "standard deviation of the lens's blur")
      ->capture_default_str();
  app.add_option("--noise-grey", render.noise_grey, "standard deviation at grey level 128")
      ->capture_default_str();
  app.add_option("--gradient-percent-per-px", o.gradient_percent_per_px, "slope of the light")
      ->capture_default_str();
  app.add_option("--weave-percent", o.weave_percent, "contrast of the weave's texture, RMS")
      ->capture_default_str();
  app.add_option("--seed", render.seed, "of noise, weave, poses and folds")->capture_default_str();
}

void resolve(ProgramOptions& o) {
  if (o.predict == !o.out.empty())
    throw usage_error("neither or both of --out and --predict are given",
                      "give --out RECORDING for pictures, or --predict for the accuracy");
  if (o.cameras.empty() == o.calibration.empty())
    throw usage_error("neither or both of --cameras and --calibration are given",
                      "give --cameras PLAN.toml for a bench to be built, or --calibration FILE");
  for (const std::string& sheet : o.sheets) {
    const std::size_t equals = sheet.find('=');
    if (equals == std::string::npos || equals == 0)
      throw usage_error(fmt::format("--sheet `{}` names no frame set", sheet),
                        "give --sheet SET=sheet.json");
    o.synth.sheets[sheet.substr(0, equals)] = sheet.substr(equals + 1);
  }
  o.synth.render.gradient_per_px = o.gradient_percent_per_px * units::percent;
  o.synth.render.weave_rms = o.weave_percent * units::percent;
  o.synth.check();
  o.prediction.render = o.synth.render;
  o.prediction.asked_sigma_m = o.accuracy_mm * mm;
  o.prediction.height_m = o.height_mm * mm;
  o.prediction.check();
}

std::vector<Camera> cameras_for(const ProgramOptions& o, const Rig& rig) {
  if (!o.cameras.empty()) return read_planned_cameras(o.cameras, rig);
  const Calibration calibration = read_calibration(o.calibration);
  if (calibration.no_go)
    throw bad_input("the calibration is NO-GO: " + *calibration.no_go,
                    {.file = o.calibration.string(), .field = "no_go"},
                    "calibrate again, or plan the cameras in a file for --cameras");
  return cameras_of(calibration, rig);
}

}  // namespace drape::synth
