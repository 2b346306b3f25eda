// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/fields/records.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/units.hpp"
#include "synth/synth.hpp"

namespace fs = std::filesystem;
using namespace drape;
using namespace drape::synth;

namespace {

using units::mm;

struct SynthArguments {
  fs::path rig, out, calibration, cameras;
  bool predict = false;
  SynthOptions synth;
  PredictOptions prediction;
};

void fields(Fields& f, SynthArguments& a) {
  f(Field{"rig", "rig folder or its rig.toml"}.called("RIG"), a.rig);
  f.otherwise({"out", "folder of the recording to write"}, a.out);
  f.otherwise({"predict", "predict the accuracy of these cameras instead of drawing pictures"},
              a.predict);
  f.otherwise({"cameras", "planned cameras (TOML): focal length, position"}, a.cameras);
  f.otherwise({"calibration",
               "calibration.json of cameras that are already calibrated, instead of --cameras"},
              a.calibration);
  fields(f, a.prediction);
  fields(f, a.synth);
  f.rule(a.predict == a.out.empty(), "out", "neither or both of --out and --predict are given",
         "give --out RECORDING for pictures, or --predict for the accuracy");
  f.rule(a.cameras.empty() != a.calibration.empty(), "cameras",
         "neither or both of --cameras and --calibration are given",
         "give --cameras PLAN.toml for a bench to be built, or --calibration FILE");
}

/// The given cameras in the order of the rig.
std::vector<Camera> cameras_for(const SynthArguments& o, const Rig& rig) {
  if (!o.cameras.empty()) return read_planned_cameras(o.cameras, rig);
  const Calibration calibration = read_calibration(o.calibration);
  if (calibration.no_go)
    throw bad_input("the calibration is NO-GO: " + *calibration.no_go,
                    {.file = o.calibration.string(), .field = "no_go"},
                    "calibrate again, or plan the cameras in a file for --cameras");
  return cameras_of(calibration, rig);
}

Ending ending_of(const SynthReport& report, const Rig& rig, const std::filesystem::path& out) {
  Ending ending;
  ending.verdict =
      fmt::format("{} pictures of {} cameras written", report.pictures, rig.cameras.size());
  ending.numbers = {
      {"marks with known truth", fmt::format("{}", report.marks)},
      {"of them seen whole", fmt::format("{} times by a camera", report.whole_views)}};
  for (const std::string& set : report.not_over_objects)
    ending.warnings.push_back(
        fmt::format("{}: folds that rest on none of its scene's objects or pins, so drape run "
                    "calls them NO-GO; "
                    "--sheet {}=SHEET.json takes a drape, as drape simulate makes it",
                    set, shell_word(set)));
  ending.next_command =
      fmt::format("drape run {} --recording {} --out DIR",
                  shell_word(rig.file.parent_path().string()), shell_word(out.string()));
  return ending;
}

Ending ending_of(const Prediction& prediction, const PredictOptions& options) {
  Ending ending;
  ending.go = prediction.go;
  ending.verdict = fmt::format(
      "{:.1f} % of the marks that two cameras see, on slopes up to 45 degrees, reach {:g} mm in "
      "space; {:.0f} % is asked",
      100 * prediction.reached_fraction, options.asked_sigma_m / mm, 100 * options.asked_fraction);
  for (const PredictedSlope& slope : prediction.slopes) {
    const std::string name = fmt::format("slope {:g} degrees", slope.slope_deg);
    const double seen = 100.0 * slope.seen_by_two / slope.marks;
    if (slope.seen_by_two == 0) {
      ending.numbers.emplace_back(name, "seen by no two cameras");
      continue;
    }
    ending.numbers.emplace_back(
        name, fmt::format("seen by two cameras {:.0f} %; in space {:.4f} mm (median), {:.4f} mm "
                          "(95 % below), height {:.4f} mm; centre {:.4f} px",
                          seen, slope.median_m / mm, slope.p95_m / mm, slope.median_height_m / mm,
                          slope.median_px));
  }
  ending.rejected.push_back(fmt::format(
      "not in these figures: the calibration's part and dots on bends; {:.0f} % of the marks on "
      "slopes up to 45 degrees are seen by fewer than two cameras",
      100 * (1 - prediction.seen_fraction)));
  ending.next_command = prediction.go ? "the same cameras with --out RECORDING give pictures to try"
                                      : "bring the cameras nearer, apart, or take longer lenses";
  return ending;
}

int write_rig(const SynthArguments& options, const Rig& rig, const CommonOptions& common,
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
  for (const auto& [name, text] : flat(value_of(options.synth))) record.option(name, text);
  return finish(ending_of(report, rig, options.out), common, record);
}

}  // namespace

int main(int argc, char** argv) {
  const auto run = [](SynthArguments& options, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    options.prediction.render = options.synth.render;
    options.synth.render.threads = thread_count(common);
    if (fs::is_directory(options.rig)) options.rig /= "rig.toml";
    RunRecord record(
        "drape-synth", words,
        options.predict ? fs::path() : run_record_path(options.out / "recording.json"));
    const Rig rig = read_rig(options.rig);
    if (!options.predict) return write_rig(options, rig, common, record);
    const Prediction prediction =
        predict(cameras_for(options, rig), read_print(rig.print_file), options.prediction);
    return finish(ending_of(prediction, options.prediction), common);
  };
  return run_command<SynthArguments>(
      argc, argv, "drape-synth",
      "A synthetic bench: the pictures that cameras would take of a rig's target and cloth, with "
      "the\n"
      "truth beside them; or a prediction of the accuracy that the cameras can give.\n\n"
      "  drape synth rigs/bench1 --cameras plan.toml --predict --accuracy-mm 0.05\n"
      "  drape synth rigs/bench1 --cameras plan.toml --out recording",
      run);
}
