// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "synth/ending.hpp"
#include "synth/program_options.hpp"
#include "synth/synth.hpp"

namespace fs = std::filesystem;
using namespace drape;
using namespace drape::synth;

namespace {

int predict_rig(const ProgramOptions& options, const Rig& rig, const CommonOptions& common) {
  const auto prediction =
      predict(cameras_for(options, rig), read_print(rig.print_file), options.prediction);
  return finish(ending_of(prediction, options.prediction), common);
}

int write_rig(const ProgramOptions& options, const Rig& rig, const CommonOptions& common,
              RunRecord& record) {
  Progress progress("synth", common.quiet);
  const auto report = write_synthetic_recording(
      rig, cameras_for(options, rig), options.out, options.synth,
      [&](double fraction, const std::string& what) { progress.update(fraction, what); });
  record.input(rig.file);
  record.input(options.cameras.empty() ? options.calibration : options.cameras);
  for (const auto& [set, file] : options.synth.sheets) record.input(file);
  for (const char* file : {"recording.json", "truth.json", "true_calibration.json"})
    record.output(options.out / file);
  record.option("seed", fmt::format("{}", options.synth.render.seed));
  record.option("blur_px", fmt::format("{}", options.synth.render.blur_px));
  record.option("noise_grey", fmt::format("{}", options.synth.render.noise_grey));
  record.option("slope_deg", fmt::format("{}", options.synth.folds_slope_deg));
  record.option("wavelength_mm", fmt::format("{}", options.synth.folds_wavelength_mm));
  return finish(ending_of(report, rig, options.out), common, record);
}

}  // namespace

int main(int argc, char** argv) {
  Command app(
      "A synthetic bench: the pictures that cameras would take of a rig's target and cloth, with "
      "the\n"
      "truth beside them; or what accuracy the cameras can give.\n\n"
      "  drape synth rigs/bench1 --cameras plan.toml --predict --accuracy-mm 0.05\n"
      "  drape synth rigs/bench1 --cameras plan.toml --out recording",
      "drape-synth");
  CommonOptions common;
  ProgramOptions options;
  add_common_options(app, common);
  add_options(app, options);
  return run_program(app, argc, argv, common, [&] {
    resolve(options);
    options.synth.render.threads = thread_count(common);
    if (fs::is_directory(options.rig)) options.rig /= "rig.toml";
    RunRecord record(
        "drape-synth", arguments_of(argc, argv),
        options.predict ? fs::path() : run_record_path(options.out / "recording.json"));
    const Rig rig = read_rig(options.rig);
    return options.predict ? predict_rig(options, rig, common)
                           : write_rig(options, rig, common, record);
  });
}
