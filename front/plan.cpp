// SPDX-License-Identifier: Apache-2.0
#include "front/plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/branch_list.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "core/sensitivity.hpp"
#include "core/units.hpp"
#include "front/toml_quoted.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr const char* kMadeByRun = "# Made by `drape run`";

struct Drape {
  Scene scene;
  fs::path folder;
  std::vector<ObjectTags> tags;
  std::vector<DrapeRepeat> repeats;  ///< includes the scene's own laying only if the rig names it

  /// The scene with objects located by the first `plates` plates.
  [[nodiscard]] fs::path scene_file(std::size_t plates) const {
    return plates == 0 ? scene.file
                       : folder / fmt::format("scene_{}.toml", tags[plates - 1].object);
  }
  /// The scene to simulate.
  [[nodiscard]] std::string scene_file() const { return scene_file(tags.size()).string(); }
  [[nodiscard]] fs::path object_file(const ObjectTags& plate, const char* what = "") const {
    return folder / fmt::format("object_{}{}.json", plate.object, what);
  }
  [[nodiscard]] fs::path sheet() const { return folder / "sheet.ply"; }
  [[nodiscard]] fs::path ensemble() const { return folder / "ensemble/branches.json"; }
};

/// One laying of a drape; `repeat` identifies it if the rig does.
struct Laying {
  std::string name, set;  ///< name in messages; frame set of its pictures
  fs::path folder;
  const DrapeRepeat* repeat = nullptr;
};

/// Layings of a drape, its own first.
std::vector<Laying> layings_of(const Drape& drape) {
  std::vector<Laying> layings = {{drape.scene.name, drape.scene.set, drape.folder}};
  for (const DrapeRepeat& repeat : drape.repeats) {
    if (repeat.set == drape.scene.set)
      layings.front().repeat = &repeat;
    else
      layings.push_back({fmt::format("{}, repeat {}", drape.scene.name, repeat.repeat), repeat.set,
                         drape.folder / "repeats" / repeat.repeat, &repeat});
  }
  return layings;
}

/// Everything that the steps are derived from.
struct Bench {
  RunOptions options;
  Rig rig;
  fs::path recording, out, store;
  std::vector<Drape> drapes;

  [[nodiscard]] fs::path reduced_rig() const { return out / "rig.toml"; }
  [[nodiscard]] fs::path target_detections() const { return out / "target-detections.json"; }
  [[nodiscard]] fs::path calibration() const { return out / "calibration.json"; }
  [[nodiscard]] fs::path report() const { return out / "report.html"; }
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
Step step_of(const std::string& command, const std::string& what, Words words,
             const fs::path& output, const std::string& drape = {}) {
  words.emplace_back("--json");
  StageCall call = call_of(command, std::move(words));
  Step step;
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

Step detect_step(const Bench& bench, const std::string& what, const std::string& surface,
                 const Words& sets, const fs::path& output, const std::string& drape,
                 const Words& more = {}) {
  Words words = {bench.recording.string(),
                 "--rig",
                 bench.reduced_rig().string(),
                 "--surface",
                 surface,
                 "--sets",
                 fmt::format("{}", fmt::join(sets, ",")),
                 "--out",
                 output.string(),
                 "--threads",
                 std::to_string(bench.options.threads)};
  append(words, more);
  Step step = step_of("detect", what, std::move(words), output, drape);
  step.weight = static_cast<double>(sets.size());
  step.warns = true;
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
              {detect_step(bench, "target", "target", sets, bench.target_detections(), "")}};
  for (const Drape& drape : bench.drapes) {
    for (const Laying& laying : layings_of(drape)) {
      group.steps.push_back(detect_step(bench, "drape " + laying.name, "cloth", {laying.set},
                                        laying.folder / "detections.json", laying.name));
      group.steps.back().scene = drape.scene.name;
    }
    for (const ObjectTags& plate : drape.tags)
      group.steps.push_back(detect_step(bench, plate_name(drape, plate), "target", {plate.set},
                                        drape.object_file(plate, "-detections"), drape.scene.name,
                                        {"--target", plate.target.string()}));
  }
  return group;
}

/// Calibrates all cameras together if the rig has free poses of the target, else as the paper.
Group calib_group(const Bench& bench) {
  Step step = step_of(
      "calib", fmt::format("{} cameras", bench.rig.cameras.size()),
      {bench.target_detections().string(), "--rig", bench.reduced_rig().string(), "--method",
       bench.rig.free_poses.empty() ? "tsai" : "joint", "--out", bench.calibration().string()},
      bench.calibration());
  step.warns = true;
  return {"calib", {std::move(step)}};
}

/// Measures the objects by their plates of tags, one after the other, since each step writes the
/// scene that the next one reads.
Group object_group(const Bench& bench) {
  Group group{"object", {}, 1, true};
  for (const Drape& drape : bench.drapes) {
    for (std::size_t k = 0; k < drape.tags.size(); ++k) {
      const ObjectTags& plate = drape.tags[k];
      const fs::path output = drape.object_file(plate), scene = drape.scene_file(k + 1);
      Words words = {drape.object_file(plate, "-detections").string(),
                     "--calibration",
                     bench.calibration().string(),
                     "--set",
                     plate.set,
                     "--scene",
                     drape.scene_file(k).string(),
                     "--object",
                     std::to_string(plate.object),
                     "--scene-out",
                     scene.string(),
                     "--out",
                     output.string()};
      for (const auto& [option, value] : plate.lies())
        append(words, {option, fmt::format("{}", value)});
      Step step =
          step_of("object", plate_name(drape, plate), std::move(words), output, drape.scene.name);
      step.outputs.push_back(scene);
      step.warns = true;
      group.steps.push_back(std::move(step));
    }
  }
  return group;
}

Group triangulate_group(const Bench& bench) {
  Group group{"triangulate", {}, bench.options.threads};
  for (const Drape& drape : bench.drapes) {
    for (const Laying& laying : layings_of(drape)) {
      const fs::path output = laying.folder / "sheet.ply";
      Words words = {(laying.folder / "detections.json").string(),
                     "--calibration",
                     bench.calibration().string(),
                     "--set",
                     laying.set,
                     "--scene",
                     drape.scene_file(),
                     "--out",
                     output.string()};
      for (const ObjectTags& plate : drape.tags)
        append(words, {"--object", drape.object_file(plate).string()});
      for (const Drape& other : bench.drapes)
        if (&other != &drape && other.tags.empty())
          append(words, {"--other-scene", other.scene_file()});
      if (laying.repeat != nullptr) words.push_back("--repeat=" + laying.repeat->repeat);
      if (laying.repeat != nullptr && !laying.repeat->face.empty())
        words.push_back("--face=" + laying.repeat->face);
      Step step =
          step_of("triangulate", "drape " + laying.name, std::move(words), output, laying.name);
      step.is_measurement = step.warns = true;
      step.scene = drape.scene.name;
      group.steps.push_back(std::move(step));
    }
  }
  return group;
}

/// Command-line words common to a drape and its ensemble.
Words drape_words(const Bench& bench, const Drape& drape, int segments, const fs::path& out) {
  Words words = {drape.scene_file(),
                 "--fabric",
                 drape.scene.fabric_file.string(),
                 "--segments",
                 std::to_string(segments),
                 "--start-from",
                 drape.sheet().string(),
                 "--out",
                 out.string(),
                 "--threads",
                 "1"};
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
  std::stable_sort(group.steps.begin(), group.steps.end(),
                   [](const Step& a, const Step& b) { return a.weight > b.weight; });
  return group;
}

/// Parallel steps of `command` for every drape; if one fails, the result only says less.
Group extra_group(const Bench& bench, const std::string& command, const std::string& what,
                  fs::path (Drape::*output)() const,
                  const std::function<Words(const Drape&)>& words) {
  Group group{command, {}, bench.options.threads};
  for (const Drape& drape : bench.drapes) {
    group.steps.push_back(step_of(command, fmt::format(fmt::runtime(what), drape.scene.name),
                                  words(drape), (drape.*output)(), drape.scene.name));
    group.steps.back().is_extra = true;
  }
  return group;
}

/// Finds the equilibria reached from starts like that of the scene.
Group ensemble_group(const Bench& bench) {
  return extra_group(bench, "branches", "{}, ensemble", &Drape::ensemble, [&](const Drape& drape) {
    return drape_words(bench, drape, bench.headline_segments(), drape.ensemble().parent_path());
  });
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

Step compare_step(const Bench& bench, const std::set<fs::path>& failed) {
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
    for (const Laying& laying : layings_of(drape))
      if (simulated && laying.folder != drape.folder)
        add(laying.folder / "sheet.ply", {"--repeat"});
    // Named as an input, so that a comparison from before it existed is not up to date.
    if (fs::is_regular_file(bench.sensitivity(drape)))
      append(words, {"--sensitivity", bench.sensitivity(drape).string()});
  }
  if (bench.rig.tolerance_m)
    append(words, {"--tolerance-mm", fmt::format("{:g}", *bench.rig.tolerance_m / units::mm)});
  append(words, {"--calibration", bench.calibration().string(), "--store", bench.store.string(),
                 "--report", bench.report().string()});
  const fs::path acceptance = bench.rig.file.parent_path() / "acceptance.json";
  if (fs::is_regular_file(acceptance)) append(words, {"--acceptance", acceptance.string()});
  if (!bench.options.label.empty()) words.push_back("--label=" + bench.options.label);
  if (!bench.options.operator_name.empty())
    words.push_back("--operator=" + bench.options.operator_name);
  return step_of("compare", "all drapes", std::move(words), bench.report());
}

std::vector<Drape> read_drapes(const Rig& rig, const fs::path& out) {
  std::vector<Drape> drapes;
  for (const fs::path& file : rig.scenes) {
    Drape drape{read_scene(file), {}, {}, {}};
    drape.tags = drape.scene.tags;
    drape.folder = out / drape.scene.name;
    for (const DrapeRepeat& repeat : rig.repeats)
      if (repeat.scene == drape.scene.name) drape.repeats.push_back(repeat);
    drapes.push_back(std::move(drape));
  }
  return drapes;
}

/// Throws for a rig.toml in the output folder that was not written by a run.
void refuse_to_replace(const fs::path& reduced_rig) {
  if (!fs::exists(reduced_rig) || read_text(reduced_rig).starts_with(kMadeByRun)) return;
  throw bad_input("the output folder holds a rig.toml that no run made",
                  {.file = reduced_rig.string()}, "give another folder with --out");
}

/// Writes the part of the rig that detect and calib read to a file in the output folder, so that a
/// change of meshes, segments or scenes does not outdate their results. Written only if it
/// changes.
void write_reduced_rig(const Bench& bench) {
  const auto relative = [&](const fs::path& file) {
    return toml_quoted(fs::proximate(file, bench.out).generic_string());
  };
  const Rig& rig = bench.rig;
  std::string text = fmt::format(
      "{}: the part of {} that detect and calib read.\n"
      "schema = \"drapebench/rig/1\"\nname = {}\ntarget = {}\nprint = {}\nrecording = {}\n\n"
      "[calibration]\nestimate_scale_x = {}\n",
      kMadeByRun, rig.file.filename().string(), toml_quoted(rig.name), relative(rig.target_file),
      relative(rig.print_file), relative(bench.recording), rig.estimate_scale_x);
  text += fmt::format("free_poses = {}\n", Json(rig.free_poses).dump());
  for (const TargetStage& stage : rig.stages)
    text += fmt::format("\n[[calibration.stage]]\nset = {}\nz_mm = {:.9f}\n",
                        toml_quoted(stage.set), stage.z_m / units::mm);
  for (const RigCamera& camera : rig.cameras)
    text += fmt::format(
        "\n[[camera]]\nname = {}\nwidth_px = {}\nheight_px = {}\npixel_pitch_um = [{:.9f}, "
        "{:.9f}]\n",
        toml_quoted(camera.name), camera.width_px, camera.height_px,
        camera.pixel_pitch_x_m / units::um, camera.pixel_pitch_y_m / units::um);
  const fs::path file = bench.reduced_rig();
  if (!fs::is_regular_file(file) || read_text(file) != text) write_durable(file, text);
}

/// Canonical path, so that steps stay up to date however a file is spelled.
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
      std::erase_if(group.steps, [](const Step& step) { return !step.drape.empty(); });
    for (Step& step : group.steps)
      step.is_asked = options.drapes.empty() || step.drape.empty() ||
                      std::find(options.drapes.begin(), options.drapes.end(), step.scene) !=
                          options.drapes.end();
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
  bench.out = one_name(options.out.empty() ? fs::path("out") / bench.rig.name : options.out);
  bench.store = options.store.empty() ? bench.out / "results.sqlite" : one_name(options.store);
  bench.drapes = read_drapes(bench.rig, bench.out);
  refuse_to_replace(bench.reduced_rig());
  Plan plan{bench.out, bench.store, bench.report(), {detect_group(bench), calib_group(bench)}};
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

}  // namespace drape
