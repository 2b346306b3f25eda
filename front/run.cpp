// SPDX-License-Identifier: Apache-2.0
#include "front/run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "core/files/json_file.hpp"
#include "core/program/progress.hpp"
#include "core/program/words.hpp"
#include "core/rig.hpp"
#include "core/run_folder.hpp"
#include "core/run_report.hpp"
#include "core/scene.hpp"
#include "core/simulation_files.hpp"
#include "core/units.hpp"
#include "front/check.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr const char* kMadeByRun = "# Made by `drape run`";

struct Drape {
  Scene scene;
  fs::path folder;
  std::vector<Laying> layings;

  [[nodiscard]] fs::path sheet() const { return folder / "sheet.ply"; }
  [[nodiscard]] fs::path ensemble() const { return folder / "ensemble/branches.json"; }
};

/// Everything that the steps are derived from.
struct Bench {
  RunOptions options;
  Rig rig;
  fs::path recording, store;
  RunFolder files;
  std::vector<Drape> drapes;

  /// The scene to simulate.
  [[nodiscard]] fs::path scene_file(const Drape& drape) const {
    return files.scene(drape.scene, drape.scene.tags.size());
  }
  [[nodiscard]] double spacing_m() const { return options.spacing_m.value_or(rig.spacing_m); }
  [[nodiscard]] std::string spacing() const { return fmt::format("{:g}", spacing_m() / units::mm); }
  /// True if the headline includes sensitivities, without which U lacks scene and fabric.
  [[nodiscard]] bool sensitivities() const {
    return (options.uncertainty || !options.single) && !options.internal_friction;
  }
  /// Path of the headline's sensitivities, beside its sheet.
  [[nodiscard]] fs::path sensitivity(const Drape& drape) const {
    return drape.folder / simulation_folder(spacing_m(), headline_segments()) / kSensitivityName;
  }
  /// Number of segments of the headline result: five, else the largest.
  [[nodiscard]] int headline_segments() const {
    const bool five = std::find(rig.segments.begin(), rig.segments.end(), 5) != rig.segments.end();
    return five ? 5 : *std::max_element(rig.segments.begin(), rig.segments.end());
  }
};

void append(Words& words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
}

/// One call of a command; `output` is the first of its outputs.
RunStep step_of(const std::string& command, const std::string& what, Words words,
                const fs::path& output, const std::string& drape = {}) {
  words.emplace_back("--json");
  StageCall call = call_of(command, std::move(words));
  RunStep step;
  step.stage = command;
  step.what = what;
  step.program = std::move(call.program);
  step.arguments = std::move(call.arguments);
  step.record = run_record_path(output);
  step.outputs = {output};
  if (output.extension() == ".ply")
    step.outputs.push_back(fs::path(output).replace_extension(".json"));
  step.drape = step.scene = drape;
  return step;
}

RunStep detect_step(const Bench& bench, const std::string& what, const std::string& surface,
                    const Words& sets, const fs::path& output, const std::string& drape,
                    const Words& more = {}) {
  Words words = words_of(bench.recording, "--rig", bench.files.rig(), "--surface", surface,
                         "--sets", fmt::format("{}", fmt::join(sets, ",")), "--out", output,
                         "--threads", bench.options.threads);
  append(words, more);
  RunStep step = step_of("detect", what, std::move(words), output, drape);
  step.weight = static_cast<double>(sets.size());
  return step;
}

std::string plate_name(const Drape& drape, const ObjectTags& plate) {
  return fmt::format("{}, object {}", drape.scene.name, plate.object);
}

Group detect_group(const Bench& bench) {
  Words sets;
  for (const TargetStage& stage : bench.rig.stages) sets.push_back(stage.set);
  append(sets, bench.rig.free_poses);
  Group group{"detect",
              {detect_step(bench, "target", "target", sets, bench.files.target_detections(), "")}};
  for (const Drape& drape : bench.drapes) {
    for (const Laying& laying : drape.layings) {
      group.steps.push_back(detect_step(bench, "drape " + laying.name(), "cloth", {laying.set},
                                        bench.files.detections(laying), laying.name()));
      group.steps.back().scene = drape.scene.name;
    }
    for (const ObjectTags& plate : drape.scene.tags)
      group.steps.push_back(
          detect_step(bench, plate_name(drape, plate), "target", {plate.set},
                      bench.files.object(drape.scene, plate.object, "-detections"),
                      drape.scene.name, {"--target", plate.target.string()}));
  }
  return group;
}

/// Calibrates all cameras together if the rig has free poses of the target, else as the paper.
Group calib_group(const Bench& bench) {
  RunStep step = step_of(
      "calib", fmt::format("{} cameras", bench.rig.cameras.size()),
      words_of(bench.files.target_detections(), "--rig", bench.files.rig(), "--method",
               bench.rig.free_poses.empty() ? "tsai" : "joint", "--out", bench.files.calibration()),
      bench.files.calibration());
  return {"calib", {std::move(step)}};
}

/// Measures the objects by their plates of tags, one after the other, since each step writes the
/// scene that the next one reads.
Group object_group(const Bench& bench) {
  Group group{"object", {}, 1, true};
  for (const Drape& drape : bench.drapes) {
    for (std::size_t k = 0; k < drape.scene.tags.size(); ++k) {
      const ObjectTags& plate = drape.scene.tags[k];
      const fs::path output = bench.files.object(drape.scene, plate.object);
      Words words = object_arguments(bench.files, drape.scene, plate, k,
                                     bench.files.object(drape.scene, plate.object, "-detections"),
                                     bench.files.calibration());
      RunStep step =
          step_of("object", plate_name(drape, plate), std::move(words), output, drape.scene.name);
      step.outputs.push_back(bench.files.scene(drape.scene, k + 1));
      group.steps.push_back(std::move(step));
    }
  }
  return group;
}

Group triangulate_group(const Bench& bench) {
  Group group{"triangulate", {}, bench.options.threads};
  for (const Drape& drape : bench.drapes) {
    for (const Laying& laying : drape.layings) {
      const fs::path output = bench.files.folder(laying) / "sheet.ply";
      Words words =
          words_of(bench.files.detections(laying), "--calibration", bench.files.calibration(),
                   "--set", laying.set, "--scene", bench.scene_file(drape), "--out", output);
      for (const ObjectTags& plate : drape.scene.tags)
        append(words, {"--object", bench.files.object(drape.scene, plate.object).string()});
      for (const Drape& other : bench.drapes)
        if (&other != &drape && other.scene.tags.empty())
          append(words, {"--other-scene", bench.scene_file(other).string()});
      if (laying.named) words.push_back("--repeat=" + laying.repeat);
      if (!laying.face.empty()) words.push_back("--face=" + laying.face);
      RunStep step =
          step_of("triangulate", "drape " + laying.name(), std::move(words), output, laying.name());
      step.scene = drape.scene.name;
      group.steps.push_back(std::move(step));
    }
  }
  return group;
}

/// Command-line words common to a drape and its ensemble.
Words drape_words(const Bench& bench, const Drape& drape, int segments, const fs::path& out) {
  Words words = words_of(bench.scene_file(drape), "--fabric", drape.scene.fabric_file, "--segments",
                         segments, "--start-from", drape.sheet(), "--out", out, "--threads", 1);
  if (bench.options.internal_friction) words.emplace_back("--internal-friction");
  return words;
}

/// One simulation of each drape; `more` holds the words of its discretisation and start.
struct Simulation {
  fs::path folder;  ///< relative to the drape's folder
  std::string what;
  int segments = 0;
  Words more;
  double weight = 0;
};

/// Simulates the cloth from the scene's start with each number of segments, and the headline also
/// from the measured shape; with --paper, also the paper's model on the rig's grids.
std::vector<Simulation> simulations_of(const Bench& bench) {
  std::vector<Simulation> all;
  const double spacing_m = bench.spacing_m();
  Words words = {"--spacing-mm", bench.spacing()};
  const int headline = bench.headline_segments();
  for (const int segments : bench.rig.segments)
    if (!bench.options.paper || segments == headline) {
      all.push_back({simulation_folder(spacing_m, segments), bench.spacing() + " mm", segments,
                     words, 1 / (spacing_m * spacing_m)});
      if (segments == headline && bench.sensitivities())
        all.back().more.emplace_back("--sensitivity");
    }
  if (!bench.options.single) {
    words.emplace_back("--from-measured");
    all.push_back({simulation_folder(spacing_m, headline).string() + "-measured",
                   bench.spacing() + " mm from the measured shape", headline, words,
                   1 / (spacing_m * spacing_m)});
  }
  if (!bench.options.paper) return all;
  for (const int grid : bench.rig.grids)
    for (const int segments : bench.rig.segments)
      all.push_back({fmt::format("simulations/paper-{}-{}", grid, segments),
                     fmt::format("{0}x{0} of the paper", grid),
                     segments,
                     {"--paper", "--grid", std::to_string(grid)},
                     static_cast<double>(grid) * grid * grid});
  return all;
}

Group simulate_group(const Bench& bench) {
  Group group{"simulate", {}, bench.options.threads};
  for (const Simulation& one : simulations_of(bench)) {
    for (const Drape& drape : bench.drapes) {
      const fs::path folder = drape.folder / one.folder;
      Words words = drape_words(bench, drape, one.segments, folder);
      append(words, one.more);
      group.steps.push_back(step_of("simulate",
                                    fmt::format("{}, {}, {} segment{}", drape.scene.name, one.what,
                                                one.segments, one.segments == 1 ? "" : "s"),
                                    std::move(words), folder / "sheet.ply", drape.scene.name));
      group.steps.back().weight = one.weight;
    }
  }
  // Longest first, so that no core waits for the last one.
  std::ranges::stable_sort(group.steps, std::greater(), &RunStep::weight);
  return group;
}

/// Finds the equilibria reached from starts like that of the scene. Its failure only makes the
/// result less complete.
Group ensemble_group(const Bench& bench) {
  Group group{"branches", {}, bench.options.threads};
  for (const Drape& drape : bench.drapes) {
    const fs::path output = drape.ensemble();
    group.steps.push_back(
        step_of("branches", drape.scene.name + ", ensemble",
                drape_words(bench, drape, bench.headline_segments(), output.parent_path()), output,
                drape.scene.name));
    group.steps.back().is_extra = true;
  }
  return group;
}

/// Sheets of the branches, unless their step failed.
Words branch_sheets(const Bench& bench, const Drape& drape, const std::set<fs::path>& failed) {
  const fs::path file = drape.ensemble();
  Words sheets;
  if (bench.options.single || failed.count(run_record_path(file)) != 0 ||
      !fs::is_regular_file(file))
    return sheets;
  const auto list = read_record<BranchList>(file);
  for (const ListedBranch& branch : list.branches)
    sheets.push_back(
        name_inside(file.parent_path(), branch.sheet, list.document.where("branches")).string());
  return sheets;
}

RunStep compare_step(const Bench& bench, const std::set<fs::path>& failed) {
  Words words;
  const auto add = [&](const fs::path& sheet, const Words& option = {}) {
    if (failed.count(run_record_path(sheet)) != 0) return false;
    append(words, option);
    words.push_back(sheet.string());
    return true;
  };
  for (const Drape& drape : bench.drapes) {
    if (!add(drape.sheet())) continue;
    bool simulated = false;
    for (const Simulation& one : simulations_of(bench))
      simulated = add(drape.folder / one.folder / "sheet.ply") || simulated;
    append(words, branch_sheets(bench, drape, failed));
    for (const Laying& laying : drape.layings)
      if (simulated && !laying.is_own) add(bench.files.folder(laying) / "sheet.ply", {"--repeat"});
    // Counts as an input, so that an older comparison is not up to date.
    if (fs::is_regular_file(bench.sensitivity(drape)))
      append(words, {"--sensitivity", bench.sensitivity(drape).string()});
  }
  if (bench.rig.tolerance_m)
    append(words, {"--tolerance-mm", fmt::format("{:g}", *bench.rig.tolerance_m / units::mm)});
  append(words, {"--calibration", bench.files.calibration().string(), "--store",
                 bench.store.string(), "--report", bench.files.report().string()});
  const fs::path acceptance = bench.rig.file.parent_path() / "acceptance.json";
  if (fs::is_regular_file(acceptance)) append(words, {"--acceptance", acceptance.string()});
  if (!bench.options.label.empty()) words.push_back("--label=" + bench.options.label);
  if (!bench.options.operator_name.empty())
    words.push_back("--operator=" + bench.options.operator_name);
  return step_of("compare", "all drapes", std::move(words), bench.files.report());
}

/// Throws for a rig.toml in the output folder that was not written by a run.
void refuse_to_replace(const fs::path& reduced_rig) {
  if (!fs::exists(reduced_rig) || read_text(reduced_rig).starts_with(kMadeByRun)) return;
  throw bad_input("the output folder holds a rig.toml that no run made",
                  {.file = reduced_rig.string()}, "give another folder with --out");
}

/// Writes the part of the rig that detect and calib read to a file in the output folder,
/// only if it changes. A change of meshes, segments or scenes then does not outdate their
/// results.
void write_reduced_rig(const Bench& bench) {
  Rig rig = bench.rig;
  rig.recording = bench.recording;
  rig.scenes.clear();
  rig.repeats.clear();
  rig.tolerance_m.reset();
  write_where_new(bench.files.rig(),
                  fmt::format("{}: the part of {} that detect and calib read.\n{}", kMadeByRun,
                              rig.file.filename().string(), text_in(bench.files.out, rig)));
}

/// Canonical path, so that steps stay up to date under any spelling of a file.
fs::path one_name(const fs::path& path) {
  return fs::proximate(fs::absolute(path).lexically_normal());
}

/// Marks the steps of the requested drapes; for a calibration alone, there are none.
void keep_asked(const Bench& bench, Plan& plan) {
  const RunOptions& options = bench.options;
  for (const std::string& name : options.drapes)
    if (std::none_of(bench.drapes.begin(), bench.drapes.end(),
                     [&](const Drape& drape) { return drape.scene.name == name; }))
      throw usage_error(fmt::format("the rig has no drape `{}`", name),
                        "name one of its scenes: `drape check` lists them");
  for (Group& group : plan.groups) {
    if (options.until == LastStage::calib)
      std::erase_if(group.steps, [](const RunStep& step) { return !step.drape.empty(); });
    for (RunStep& step : group.steps)
      step.is_asked = options.drapes.empty() || step.drape.empty() ||
                      std::ranges::find(options.drapes, step.scene) != options.drapes.end();
  }
}

}  // namespace

void fields(Fields& f, RunOptions& options) {
  f(Field{"rig", "folder of the rig, or its rig.toml"}.called("RIG"), options.rig);
  f.otherwise({"recording", "another recording than the rig's"}, options.recording);
  f.otherwise({"out", "output folder (default: out/<rig name>)"}, options.out);
  f.otherwise({"store", "results store (default: <out>/results.sqlite)"}, options.store);
  f.otherwise({"label", "name of this run in the store, e.g. \"after washing\""}, options.label);
  f.otherwise(
      {"uncertainty",
       "with --single: what each value moves, without which the total uncertainty lacks scene "
       "and fabric values"},
      options.uncertainty);
  f.otherwise({"single",
               "no ensemble, sensitivity and start from the measured shape: each drape from the "
               "scene's own start only"},
              options.single);
  f({"spacing_mm", "spacing of the cloth's finest mesh (default: the rig's, 2.5)", units::mm, 0.5,
     50},
    options.spacing_m);
  f.otherwise({"paper", "beside the cloth the paper's model on the rig's grids"}, options.paper);
  f.otherwise({"internal_friction", "simulate with both branches of the bending and shear loops"},
              options.internal_friction);
  f.otherwise({"operator", "who ran it, for the store"}, options.operator_name);
  f.otherwise({"until", "last stage"}, options.until);
  f.otherwise(Field{"drape",
                    "name of a drape to make (default: all); of the others the report keeps what "
                    "is up to date"}
                  .per_flag(),
              options.drapes);
}

Plan make_plan(const RunOptions& options) {
  Bench bench;
  bench.options = options;
  if (options.uncertainty && options.internal_friction)
    throw usage_error("--uncertainty speaks of a cloth without internal friction",
                      "leave out one of both");
  bench.rig = read_rig(one_name(options.rig));
  bench.recording = one_name(options.recording.empty() ? bench.rig.recording : options.recording);
  bench.files.out = one_name(options.out.empty() ? fs::path("out") / bench.rig.name : options.out);
  bench.store = options.store.empty() ? bench.files.store() : one_name(options.store);
  for (const fs::path& file : bench.rig.scenes) {
    const Scene scene = read_scene(file);
    bench.drapes.push_back({scene, bench.files.out / scene.name, layings_of(scene, bench.rig)});
  }
  refuse_to_replace(bench.files.rig());
  Plan plan{bench.files.out,
            bench.store,
            bench.files.report(),
            {detect_group(bench), calib_group(bench)}};
  if (options.until != LastStage::calib) {
    if (Group objects = object_group(bench); !objects.steps.empty())
      plan.groups.push_back(std::move(objects));
    plan.groups.push_back(triangulate_group(bench));
  }
  if (options.until == LastStage::compare) {
    plan.groups.push_back(simulate_group(bench));
    if (!options.single) plan.groups.push_back(ensemble_group(bench));
    plan.compare = [bench](const std::set<fs::path>& failed) {
      return compare_step(bench, failed);
    };
  }
  plan.write_reduced_rig = [bench] { write_reduced_rig(bench); };
  keep_asked(bench, plan);
  return plan;
}

namespace {

// ---- run --------------------------------------------------------------------------------------

struct StepEnding {
  RunStep step;
  int exit_code = 0;
  bool made = false;   ///< false if it was up to date
  Ending ending = {};  ///< for a failed step only the reason

  [[nodiscard]] std::string name() const { return fmt::format("{} ({})", step.stage, step.what); }
};

/// True if the outputs of a step belong to its inputs, whatever its arguments were.
bool is_as_made(const RunStep& step) {
  if (!fs::is_regular_file(step.record)) return false;
  try {
    const RunFile run = read_run_file(step.record);
    const auto holds = [&](const RecordedFile& file) { return is_as_recorded(step.record, file); };
    return (run.exit_code == 0 || run.exit_code == 1) &&
           run.program_sha256 == sha256_of_file(step.program) &&
           std::ranges::all_of(run.inputs, holds) && std::ranges::all_of(run.outputs, holds);
  } catch (const Error&) {
    return false;
  }
}

/// Draws one progress line for all running steps of a stage.
class StageProgress {
 public:
  StageProgress(const Group& group, bool quiet)
      : steps_(group.steps.size()), progress_(group.stage, quiet) {
    for (const RunStep& step : group.steps) total_ += step.weight;
  }

  /// `ended`: the step is over. The step itself may report this too, more than once.
  void update(const RunStep& step, double fraction, const std::string& what, bool ended) {
    fractions_[step.what] = std::min(fraction, 1.0) * step.weight;
    if (ended) ended_.insert(step.what);
    double sum = 0;
    for (const auto& [name, part] : fractions_) sum += part;
    const std::string detail = ended ? step.what : step.what + ", " + what;
    progress_.update(sum / total_,
                     fmt::format("{} ({} of {} done)", detail, ended_.size(), steps_));
  }

 private:
  std::size_t steps_;
  Progress progress_;
  double total_ = 0;
  std::set<std::string> ended_;
  std::map<std::string, double> fractions_;
};

/// One run of a bench: its steps in order, with their results.
class BenchRun {
 public:
  BenchRun(const Plan& plan, const CommonOptions& common) : plan_(plan), common_(common) {}

  /// Runs all steps and returns the exit code.
  int run() {
    bool stopped = false;
    for (const Group& group : plan_.groups) {
      const std::vector<StepEnding> endings = run_group(group);
      if (Interrupts::signal() != 0) return interrupted();
      if (const int code = sort_out(endings)) return given_up(code);
      const auto first = std::find_if(endings.begin(), endings.end(),
                                      [](const StepEnding& one) { return one.exit_code > 1; });
      const bool any = std::any_of(endings.begin(), endings.end(), [](const StepEnding& one) {
        return one.exit_code <= 1 && !one.step.drape.empty();
      });
      // If every drape failed there is nothing to compare; the first error is the run's.
      if (any || first == endings.end() || first->step.is_extra) continue;
      if (group.is_for_some && !all_are_out()) continue;
      if (no_go_of({}).empty()) return given_up(first->exit_code);
      stopped = true;
      break;
    }
    if (!plan_.compare) return end_as_asked();
    // A drape that was NO-GO before the comparison is NO-GO in the store and its lists too.
    const bool measured = std::ranges::any_of(
        kept_, [](const StepEnding& one) { return one.step.stage == "triangulate"; });
    if (stopped && !measured) return end_early("there is no measured sheet");
    leave_out_old_drapes();
    const StepEnding compared = run_group(compare_group()).front();
    if (Interrupts::signal() != 0) return interrupted();
    if (compared.exit_code > 1)
      return stopped ? end_early(compared.ending.verdict) : given_up(compared.exit_code);
    print(compared);
    return conclude(compared);
  }

 private:
  [[nodiscard]] bool is_out(const std::string& drape) const {
    return std::ranges::any_of(failed_, [&](const auto& one) { return one.first == drape; });
  }

  /// True for a drape that was not requested and whose measurement is not up to date.
  [[nodiscard]] bool lacks(const std::string& scene) const {
    return not_up_to_date_.count(scene) != 0;
  }

  [[nodiscard]] bool all_are_out() const {
    for (const Group& group : plan_.groups)
      for (const RunStep& step : group.steps)
        if (!step.drape.empty() && !is_out(step.drape)) return false;
    return true;
  }

  /// Runs the steps that are not up to date. Stores each ending immediately, so that an interrupted
  /// group resumes where it stopped.
  std::vector<StepEnding> run_group(const Group& group) {
    std::vector<StepEnding> endings;
    std::vector<Step> to_do;
    std::vector<std::size_t> index;
    StageProgress progress(group, common_.quiet || common_.json);
    for (const RunStep& step : group.steps) {
      if (!step.drape.empty() && is_out(step.drape)) continue;
      if (!step.is_asked && (lacks(step.scene) || !is_as_made(step))) {
        // A missing simulation leaves the others of the drape.
        if (group.stage != "simulate" && !step.is_extra) not_up_to_date_.insert(step.scene);
        continue;
      }
      StepEnding& ending = endings.emplace_back();
      ending.step = step;
      if (step.is_asked && !is_up_to_date(step.record, step.program, step.arguments)) {
        // Stages remove their record themselves, but another lab's may not.
        remove_durable(step.record);
        remove_durable(ending_path(step.record));
        index.push_back(endings.size() - 1);
        to_do.push_back(step);
        continue;
      }
      ending.exit_code = read_run_file(step.record).exit_code;
      ending.ending = kept_ending(step.record).value_or(Ending{});
      progress.update(step, 1, step.what, true);
    }
    bool disk_is_full = false;
    run_steps(
        to_do, group.at_once,
        [&](std::size_t step, double fraction, const std::string& what) {
          progress.update(endings[index[step]].step, fraction, what, false);
        },
        [&](std::size_t step, const StepResult& result) {
          StepEnding& ending = endings[index[step]];
          take(result, ending, disk_is_full);
          progress.update(ending.step, 1, ending.step.what, true);
        },
        Interrupts::signal);
    return endings;
  }

  static void take(const StepResult& result, StepEnding& ending, bool& disk_is_full) {
    ending.made = true;
    ending.exit_code = result.exit_code;
    const auto error = error_in(result);
    // A full disk stops all parallel steps; it is reported once.
    const bool full = error && error->what_failed().ends_with(std::strerror(ENOSPC));
    if (!full || !disk_is_full) std::fputs(result.errors.c_str(), stderr);
    disk_is_full = disk_is_full || full;
    if (!error) {
      // Another lab's stage may store no ending; its output is used then.
      ending.ending =
          kept_ending(ending.step.record).value_or(ending_in(result.output).value_or(Ending{}));
      return;
    }
    ending.exit_code = std::max(ending.exit_code, 2);
    ending.ending.verdict = error->what_failed();
    if (result.fault.empty() || Interrupts::signal() != 0) return;
    ending.exit_code = static_cast<int>(ErrorKind::internal);
    print_error(*error, "drape");
  }

  /// Sorts steps by outcome; returns the exit code of a failed one that all drapes need, or 0.
  int sort_out(const std::vector<StepEnding>& endings) {
    for (const StepEnding& ending : endings) {
      const std::string& why = ending.ending.verdict;
      if (ending.exit_code > 1 && ending.step.drape.empty()) return ending.exit_code;
      print(ending);
      if (ending.exit_code <= 1) kept_.push_back(ending);
      if (ending.step.is_extra && ending.exit_code > 0)
        lacking_.push_back(ending.name() +
                           (ending.exit_code == 1
                                ? ": NO-GO: "
                                : ": failed, so nothing of it is in the result: ") +
                           why);
      else if (ending.exit_code > 1)
        failed_.emplace_back(ending.step.drape, ending.step.what == "drape " + ending.step.drape
                                                    ? why
                                                    : ending.step.what + ": " + why);
    }
    return 0;
  }

  void print(const StepEnding& ending) const {
    if (common_.quiet || common_.json) return;
    const char* state = ending.exit_code > 1   ? "FAILED"
                        : ending.exit_code > 0 ? "NO-GO"
                        : ending.made          ? "done"
                                               : "up to date";
    const std::string shown =
        ending.exit_code > 0 ? coloured(state, "1;31", stdout) : std::string(state);
    print_text(fmt::format(
        "{} {}{}  {}\n",
        printable(fmt::format("{:<12} {:<24}", ending.step.stage, ending.step.what)), shown,
        std::string(10 - std::strlen(state), ' '), printable(ending.ending.verdict)));
  }

  /// Quotes the first stage that is NO-GO; for one drape if `drape` is given.
  [[nodiscard]] std::string no_go_of(const std::string& drape) const {
    for (const StepEnding& ending : kept_) {
      const bool speaks = drape.empty() || ending.step.drape.empty() || ending.step.drape == drape;
      if (ending.exit_code != 0 && speaks && !ending.step.is_extra)
        return ending.name() + ": " + ending.ending.verdict;
    }
    return {};
  }

  /// First cause: what failed, or was NO-GO before it failed, else the first stage that is
  /// NO-GO.
  [[nodiscard]] std::string cause_of(const StepEnding& compared) const {
    std::string cause = no_go_of(failed_.empty() ? "" : failed_.front().first);
    if (cause.empty() && !failed_.empty())
      cause = fmt::format(
          "drape {} could not be measured or simulated: {}{}", failed_.front().first,
          failed_.front().second,
          failed_.size() > 1 ? fmt::format(" (and {} more)", failed_.size() - 1) : std::string());
    if (cause.empty() && compared.exit_code != 0)
      cause = compared.name() + ": " + compared.ending.verdict;
    return cause;
  }

  /// Warnings of the steps that belong to the result, each with its step.
  [[nodiscard]] std::vector<std::string> stage_warnings() const {
    std::vector<std::string> warnings;
    for (const StepEnding& ending : kept_)
      if (ending.step.stage != "simulate" && ending.step.stage != "branches")
        for (const std::string& warning : ending.ending.warnings)
          warnings.push_back(ending.name() + ": " + warning);
    return warnings;
  }

  [[nodiscard]] std::vector<std::string> rejected() const {
    std::vector<std::string> lines;
    for (const auto& [drape, why] : failed_)
      lines.push_back(fmt::format("drape {}: {}", drape, why));
    return lines;
  }

  /// Removes drapes that were not requested and have no up-to-date simulation from the
  /// comparison.
  void leave_out_old_drapes() {
    std::set<std::string> simulated;
    for (const StepEnding& ending : kept_)
      if (ending.step.stage == "simulate") simulated.insert(ending.step.scene);
    for (const Group& group : plan_.groups)
      for (const RunStep& step : group.steps)
        if (!step.is_asked && simulated.count(step.scene) == 0) not_up_to_date_.insert(step.scene);
    std::erase_if(kept_, [&](const StepEnding& one) { return lacks(one.step.scene); });
    for (const std::string& drape : not_up_to_date_)
      lacking_.push_back(fmt::format(
          "drape {} is not up to date and was not asked for, so nothing of it is in the result",
          drape));
  }

  /// Compares all sheets made in this run; those of earlier runs have other inputs.
  [[nodiscard]] Group compare_group() const {
    std::set<fs::path> not_made;
    for (const Group& group : plan_.groups)
      for (const RunStep& step : group.steps) not_made.insert(step.record);
    for (const StepEnding& ending : kept_) not_made.erase(ending.step.record);
    RunStep step = plan_.compare(not_made);
    for (const auto& warnings : {stage_warnings(), lacking_})
      for (const std::string& warning : warnings) step.arguments.push_back("--warning=" + warning);
    for (const std::string& line : rejected()) step.arguments.push_back("--no-go=" + line);
    // A repeated step has a new record, which the report shows.
    if (std::ranges::any_of(kept_, &StepEnding::made)) remove_durable(step.record);
    return {step.stage, {step}, 1};
  }

  /// Ends a run at the stage given by --until.
  [[nodiscard]] int end_as_asked() const {
    Ending ending;
    ending.verdict = no_go_of({});
    if (ending.verdict.empty() && !failed_.empty())
      ending.verdict = fmt::format("drape {}: {}", failed_.front().first, failed_.front().second);
    ending.go = ending.verdict.empty();
    if (ending.go && !kept_.empty()) ending.verdict = kept_.back().ending.verdict;
    ending.warnings = stage_warnings();
    ending.rejected = rejected();
    if (common_.json)
      return print_json(kept_, ending.go ? "" : ending.verdict, ending.warnings, ending.verdict);
    return finish(ending, common_);
  }

  /// Prints the end of a run for --json; there is no report if nothing was compared.
  int print_json(const std::vector<StepEnding>& endings, const std::string& cause,
                 const std::vector<std::string>& warnings,
                 const std::string& sentence = "the bench ran to stored millimetres") const {
    Json json;
    json["verdict"] = cause.empty() ? "GO" : "NO-GO";
    json["sentence"] = cause.empty() ? sentence : cause;
    json["cause"] = cause.empty() ? Json() : Json(cause);
    json["warnings"] = warnings;
    json["rejected"] = rejected();
    json["steps"] = Json::array();
    for (const StepEnding& ending : endings)
      json["steps"].push_back({{"stage", ending.step.stage},
                               {"what", ending.step.what},
                               {"made", ending.made},
                               {"exit_code", ending.exit_code},
                               {"sentence", ending.ending.verdict}});
    json["report"] = fs::is_regular_file(plan_.report) ? Json(plan_.report.string()) : Json();
    json["store"] = plan_.store.string();
    print_text(pretty(json));
    return cause.empty() ? 0 : 1;
  }

  int conclude(const StepEnding& compared) {
    const std::string cause = cause_of(compared);
    kept_.push_back(compared);
    if (common_.json) return print_json(kept_, cause, compared.ending.warnings);
    const auto made = std::ranges::count_if(kept_, &StepEnding::made);
    if (common_.quiet) return cause.empty() ? 0 : 1;
    print_text(printable(fmt::format("\nsteps: {} made, {} up to date\n", made,
                                     static_cast<std::ptrdiff_t>(kept_.size()) - made)));
    const fs::path found = fs::path(plan_.report).replace_extension(".json");
    if (!fs::is_regular_file(found)) {  // comparison made by another lab
      print_text(printable(printed(compared.ending)));
      return cause.empty() ? 0 : 1;
    }
    const auto report = read_record<RunReport>(found);
    const std::string first = cause.empty() ? first_line(report) : "NO-GO: " + cause;
    const std::string text = printable(ending_text(report, first, plan_.report.string()));
    const std::size_t end = text.find(':');
    const char* colour = !cause.empty() ? "1;31" : is_all_good(report) ? "32" : "1";
    print_text(coloured(text.substr(0, end), colour, stdout) + text.substr(end) +
               printable(fmt::format("next    drape results show {} --store {}\n",
                                     report.run.value_or(1), shell_word(plan_.store.string()))));
    return cause.empty() ? 0 : 1;
  }

  /// Ends a run that could not store any result, for the reason `why`.
  int end_early(const std::string& why) const {
    remove_report();
    Ending ending{.go = false,
                  .verdict = no_go_of({}),
                  .warnings = {"nothing was compared, stored or reported: " + why}};
    if (fs::is_regular_file(plan_.store))
      ending.warnings.push_back(fmt::format(
          "what {} holds of these photographs is of an earlier run", plan_.store.string()));
    for (std::string& warning : stage_warnings()) ending.warnings.push_back(std::move(warning));
    if (common_.json) return print_json(kept_, ending.verdict, ending.warnings);
    return finish(ending, common_);
  }

  /// Removes the report of an earlier run, which would contradict this one.
  void remove_report() const {
    std::error_code absent;
    fs::remove(plan_.report, absent);
  }

  [[nodiscard]] int given_up(int exit_code) const {
    remove_report();
    return exit_code;
  }

  [[nodiscard]] static int interrupted() {
    print_message("drape: interrupted: what was finished is kept, run again to go on\n");
    return 128 + Interrupts::signal();
  }

  const Plan& plan_;
  const CommonOptions& common_;
  std::vector<StepEnding> kept_;                             ///< steps with a verdict
  std::vector<std::pair<std::string, std::string>> failed_;  ///< failed drapes, with reasons
  std::set<std::string> not_up_to_date_;                     ///< drapes that were not requested
  std::vector<std::string> lacking_;  ///< failed optional steps, whose results are missing
};

}  // namespace

int run_bench(const RunOptions& options, const CommonOptions& common) {
  const BenchCheck check =
      check_bench(options.rig, options.recording, options.until == LastStage::calib);
  if (!check.problems.empty()) return report_check(check, "drape run", common);
  if (!common.quiet && !common.json)
    for (const std::string& warning : check.warnings)
      print_text(printable(fmt::format("warning: {}\n", warning)));
  RunOptions all = options;
  all.threads = thread_count(common);
  const Plan plan = make_plan(all);
  const WriterLock lock(plan.out / ".lock", "another `drape run` works on this folder");
  const Interrupts interrupts;
  plan.write_reduced_rig();
  return BenchRun(plan, common).run();
}

}  // namespace drape
