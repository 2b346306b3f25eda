// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "calib/calib.hpp"
#include "calib/joint.hpp"
#include "calib/programs/commands.hpp"
#include "calib/programs/drift_ending.hpp"
#include "calib/programs/ending.hpp"
#include "calib/programs/joint_ending.hpp"
#include "calib/programs/program_options.hpp"
#include "core/error.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"

namespace drape::calib {

namespace fs = std::filesystem;

namespace {

/// NO-GO for a cause that comes before the program's own.
void refuse(Ending& ending, const std::string& cause) {
  if (!ending.go) ending.warnings.push_back("NO-GO also because " + ending.verdict);
  ending.go = false;
  ending.verdict = cause;
  ending.next_command.clear();
}

/// The calibration and how the program ends, by either method.
std::pair<Calibration, Ending> calibrate(const Detections& detections, const Rig& rig,
                                         const std::string& method, const JointOptions& options,
                                         const fs::path& out) {
  const Target target = read_target(rig.target_file);
  const auto judged = [&](Calibration calibration, Ending ending) {
    if (const auto against = detections.reason_against(calibration.sets)) refuse(ending, *against);
    if (options.known_lenses && options.known_lenses->no_go)
      refuse(ending, "the lenses' calibration is NO-GO: " + *options.known_lenses->no_go);
    if (!ending.go) calibration.no_go = ending.verdict;
    return std::pair{std::move(calibration), ending};
  };
  if (method == "tsai") {
    const CalibResult result = calibrate_tsai(detections, rig, target, options.common);
    return judged(result.calibration, ending_of(result, out));
  }
  const JointResult result = calibrate_joint(detections, rig, target, options);
  return judged(result.calibration, ending_of(result, out));
}

}  // namespace

int calib_command(int argc, char** argv) {
  Command app("Calibrates the cameras of a rig from detections of its target", "drape-calib");
  CommonOptions common;
  JointOptions options;
  fs::path detections_file, rig_file, out, lens_from, compare;
  std::string method = "tsai", lens = "held-out";
  add_common_options(app, common);
  app.add_option("DETECTIONS", detections_file, "detections.json of the target")->required();
  app.add_option("--rig", rig_file, "rig folder or its rig.toml")->required();
  app.add_option(
         "--method", method,
         "tsai: each camera from the z stages; joint: all cameras from stages and free poses")
      ->one_of({"tsai", "joint"})
      ->capture_default_str();
  app.add_option("--out", out, "calibration.json to write")->required();
  add_options(app, options.common);
  app.add_option("--lens", lens, "joint: the lens's terms, or held-out to choose by unseen views")
      ->one_of({"held-out", "k1", "k1k2", "k1k2p1p2", "k1k2p1p2k3"})
      ->capture_default_str();
  add_joint_options(app, options);
  app.add_option("--lens-from", lens_from,
                 "joint: calibration.json whose cameras of the same names have these lenses");
  app.add_option("--compare", compare, "older calibration.json: how far each camera drifted since");
  return run_program(app, argc, argv, common, [&] {
    options.check();
    refuse_joint_options(app, method);
    options.lens = lens_named(lens);
    if (!lens_from.empty()) options.known_lenses = read_calibration(lens_from);
    if (fs::is_directory(rig_file)) rig_file /= "rig.toml";
    StepFiles files{{out}, {rig_file, detections_file}};
    for (const fs::path& file : {lens_from, compare})
      if (!file.empty()) files.inputs.push_back(file);
    RunRecord record("drape-calib", arguments_of(argc, argv), run_record_path(out), files);
    const Rig rig = read_rig(rig_file);
    record.input(rig.target_file);
    auto [calibration, ending] =
        calibrate(read_detections(detections_file), rig, method, options, out);
    if (!compare.empty())
      add_drift(ending, read_calibration(compare), calibration, rig, read_target(rig.target_file));
    write_calibration(out, calibration);
    note_options(record, options.common, method);
    record.option("lens", lens);
    note_joint_options(record, options);
    return finish(ending, common, record);
  });
}

}  // namespace drape::calib

int main(int argc, char** argv) {
  using namespace drape::calib;
  return drape::run_stage(
      argc, argv, calib_command,
      {{"accept", accept_command, "accepts a calibrated rig by what it measures"},
       {"convert", convert_command, "calibrations for other tools, or theirs"}});
}
