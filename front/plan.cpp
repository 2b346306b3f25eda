// SPDX-License-Identifier: Apache-2.0
#include "front/plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "core/error.hpp"
#include "core/program/run_record.hpp"
#include "core/recording.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

constexpr int kEnsembleGrid = 21;  // particles per side, at most

struct Drape {
  Scene scene;
  fs::path folder;
};

/// Everything the steps are made of.
struct Bench {
  RunOptions options;
  Rig rig;
  fs::path recording;
  std::vector<Drape> drapes;
  fs::path out, store;

  [[nodiscard]] fs::path target_detections() const { return out / "target-detections.json"; }
  [[nodiscard]] fs::path calibration() const { return out / "calibration.json"; }
};

Step step(const std::string& stage, const std::string& what, std::vector<std::string> arguments,
          const fs::path& output, double weight = 1) {
  return {stage, what, stage_program(stage), std::move(arguments), run_record_path(output), weight};
}

std::string threads_text(const Bench& bench) {
  return std::to_string(bench.options.threads);
}

Step detect_step(const Bench& bench, const std::string& what, const std::string& surface,
                 const std::vector<std::string>& sets, const fs::path& output) {
  return step("detect", what,
              {bench.recording.string(), "--rig", bench.rig.file.string(), "--surface", surface,
               "--sets", fmt::format("{}", fmt::join(sets, ",")), "--out", output.string(),
               "--threads", threads_text(bench), "--json"},
              output, static_cast<double>(sets.size()));
}

/// Stages first, then free poses: the sets that calibrate.
std::vector<std::string> target_sets(const Rig& rig) {
  std::vector<std::string> sets;
  for (const TargetStage& stage : rig.stages) sets.push_back(stage.set);
  sets.insert(sets.end(), rig.free_poses.begin(), rig.free_poses.end());
  return sets;
}

Group detect_group(const Bench& bench) {
  Group group{"detect", {}, 1};
  group.steps.push_back(
      detect_step(bench, "target", "target", target_sets(bench.rig), bench.target_detections()));
  for (const Drape& drape : bench.drapes) {
    group.steps.push_back(detect_step(bench, "drape " + drape.scene.name, "cloth",
                                      {drape.scene.set}, drape.folder / "detections.json"));
  }
  return group;
}

/// All cameras together where the rig has free poses of the target, else the paper's method.
Group calib_group(const Bench& bench) {
  const std::string method = bench.rig.free_poses.empty() ? "tsai" : "joint";
  return {"calib",
          {step("calib", fmt::format("{} cameras", bench.rig.cameras.size()),
                {bench.target_detections().string(), "--rig", bench.rig.file.string(), "--method",
                 method, "--out", bench.calibration().string(), "--json"},
                bench.calibration())},
          1};
}

Group triangulate_group(const Bench& bench) {
  Group group{"triangulate", {}, bench.options.threads};
  for (const Drape& drape : bench.drapes) {
    const fs::path output = drape.folder / "sheet.ply";
    group.steps.push_back(step(
        "triangulate", "drape " + drape.scene.name,
        {(drape.folder / "detections.json").string(), "--calibration", bench.calibration().string(),
         "--set", drape.scene.set, "--out", output.string(), "--json"},
        output));
  }
  return group;
}

fs::path simulation_folder(const Drape& drape, int grid, int segments) {
  return drape.folder / "simulations" / fmt::format("{}-{}", grid, segments);
}

Group simulate_group(const Bench& bench) {
  Group group{"simulate", {}, bench.options.threads};
  for (const int grid : bench.rig.grids) {
    for (const Drape& drape : bench.drapes) {
      for (const int segments : bench.rig.segments) {
        const fs::path folder = simulation_folder(drape, grid, segments);
        group.steps.push_back(
            step("simulate",
                 fmt::format("{}, {}x{}, {} segment{}", drape.scene.name, grid, grid, segments,
                             segments == 1 ? "" : "s"),
                 {drape.scene.file.string(), "--fabric", drape.scene.fabric_file.string(), "--grid",
                  std::to_string(grid), "--segments", std::to_string(segments), "--start-from",
                  (drape.folder / "sheet.ply").string(), "--solver", "fall", "--out",
                  folder.string(), "--threads", "1", "--json"},
                 folder / "sheet.ply", static_cast<double>(grid) * grid * grid));
      }
    }
  }
  // The longest first, so that no core waits for the last one.
  std::stable_sort(group.steps.begin(), group.steps.end(),
                   [](const Step& a, const Step& b) { return a.weight > b.weight; });
  return group;
}

/// The equilibria that starts like the scene's come to, on the finest grid up to kEnsembleGrid: 32
/// drapes cost as much as all others together already there.
Group ensemble_group(const Bench& bench) {
  Group group{"branches", {}, 1};
  if (bench.options.single || bench.rig.grids.empty() || bench.rig.segments.empty()) return group;
  int grid = *std::min_element(bench.rig.grids.begin(), bench.rig.grids.end());
  for (const int one : bench.rig.grids) grid = one <= kEnsembleGrid ? std::max(grid, one) : grid;
  const int segments = *std::max_element(bench.rig.segments.begin(), bench.rig.segments.end());
  for (const Drape& drape : bench.drapes) {
    const fs::path folder = drape.folder / "ensemble";
    group.steps.push_back(
        step("branches", fmt::format("{}, {}x{}, ensemble", drape.scene.name, grid, grid),
             {drape.scene.file.string(), "--fabric", drape.scene.fabric_file.string(), "--grid",
              std::to_string(grid), "--segments", std::to_string(segments), "--start-from",
              (drape.folder / "sheet.ply").string(), "--out", folder.string(), "--threads",
              threads_text(bench), "--json"},
             folder / "branches.json"));
  }
  return group;
}

Group compare_group(const Bench& bench, const fs::path& report) {
  std::vector<std::string> arguments;
  for (const Drape& drape : bench.drapes) {
    arguments.push_back((drape.folder / "sheet.ply").string());
    for (const int grid : bench.rig.grids) {
      for (const int segments : bench.rig.segments) {
        arguments.push_back((simulation_folder(drape, grid, segments) / "sheet.ply").string());
      }
    }
  }
  for (const std::string& more :
       {std::string("--calibration"), bench.calibration().string(), std::string("--store"),
        bench.store.string(), std::string("--report"), report.string()}) {
    arguments.push_back(more);
  }
  return {"compare", {step("compare", "all drapes", arguments, report)}, 1};
}

void check_rig(const Rig& rig) {
  if (rig.cameras.size() < 2) {
    throw bad_input(fmt::format("{} camera in the rig", rig.cameras.size()),
                    {.file = rig.file.string(), .field = "camera"},
                    "a point in space needs two views: add [[camera]] tables");
  }
  const Where where{.file = rig.file.string(), .field = "calibration.stage"};
  const bool joint = !rig.free_poses.empty();
  if (rig.stages.size() < (joint ? 1 : 2)) {
    throw bad_input(
        joint ? std::string("no target stage: the target's reference pose defines the world")
              : fmt::format("{} target stage(s): Tsai's method needs points at two heights or more",
                            rig.stages.size()),
        where, "add [[calibration.stage]] tables with set and z_mm");
  }
  if (rig.scenes.empty()) {
    throw bad_input("the rig names no scene", {.file = rig.file.string(), .field = "scenes"},
                    "add the scene files, e.g. scenes = [\"scenes/A.toml\"]");
  }
}

/// Each set a step will read must be there with an image of each camera.
void check_recording(const Bench& bench) {
  const Recording recording = read_recording(bench.recording);
  std::vector<std::string> needed = target_sets(bench.rig);
  for (const Drape& drape : bench.drapes) needed.push_back(drape.scene.set);
  for (const std::string& name : needed) {
    const FrameSet& set = recording.set(name);
    for (const RigCamera& camera : bench.rig.cameras) {
      const bool found =
          std::any_of(set.frames.begin(), set.frames.end(),
                      [&](const RecordedFrame& frame) { return frame.camera == camera.name; });
      if (!found) {
        throw bad_input("a camera of the rig is missing in the recording",
                        {.file = (recording.folder / "recording.json").string(),
                         .camera = camera.name,
                         .set = name},
                        "record the set with all cameras, or remove the camera from rig.toml");
      }
    }
  }
}

std::vector<Drape> read_drapes(const Rig& rig, const fs::path& out) {
  std::vector<Drape> drapes;
  std::set<std::string> names;
  for (const fs::path& file : rig.scenes) {
    Scene scene = read_scene(file);
    if (scene.set.empty()) {
      throw bad_input("the scene names no frame set", {.file = file.string(), .field = "set"},
                      "add `set = \"...\"`: the set of the recording that shows this drape");
    }
    if (!names.insert(scene.name).second) {
      throw bad_input(fmt::format("two scenes are called `{}`", scene.name),
                      {.file = file.string(), .field = "name"}, "give each scene its own name");
    }
    static_cast<void>(read_print(scene.print_file));
    const fs::path folder = out / scene.name;
    drapes.push_back({std::move(scene), folder});
  }
  return drapes;
}

}  // namespace

Plan make_plan(const RunOptions& options) {
  Bench bench;
  bench.options = options;
  bench.rig = read_rig(options.rig);
  check_rig(bench.rig);
  static_cast<void>(read_target(bench.rig.target_file));
  static_cast<void>(read_print(bench.rig.print_file));
  bench.recording = options.recording.empty() ? bench.rig.recording : options.recording;
  bench.out = options.out.empty() ? fs::path("out") / bench.rig.name : options.out;
  bench.store = options.store.empty() ? bench.out / "results.sqlite" : options.store;
  bench.drapes = read_drapes(bench.rig, bench.out);
  check_recording(bench);
  const fs::path report = bench.out / "report.html";
  Plan plan{bench.out, bench.store, report, {}};
  for (Group& group :
       std::vector{detect_group(bench), calib_group(bench), triangulate_group(bench),
                   simulate_group(bench), ensemble_group(bench), compare_group(bench, report)}) {
    if (!group.steps.empty()) plan.groups.push_back(std::move(group));
  }
  return plan;
}

}  // namespace drape
