// SPDX-License-Identifier: Apache-2.0
#include "front/plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"
#include "front/object_tags.hpp"
#include "front/repeats.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

constexpr int kEnsembleGrid = 15;  // particles per side, at most

struct Drape {
  Scene scene;
  fs::path folder;
  std::vector<ObjectTags> tags;
  std::vector<DrapeRepeat> repeats;  ///< its own laying among them only where the rig names it

  /// object.json of a plate of tags.
  [[nodiscard]] fs::path object_file(const ObjectTags& plate) const {
    return folder / fmt::format("object_{}.json", plate.object);
  }
  /// The scene with its objects where the first `plates` plates show them.
  [[nodiscard]] fs::path scene_file(std::size_t plates) const {
    return plates == 0 ? scene.file
                       : folder / fmt::format("scene_{}.toml", tags[plates - 1].object);
  }
  /// What is simulated.
  [[nodiscard]] fs::path scene_file() const { return scene_file(tags.size()); }

  [[nodiscard]] bool is_own(const DrapeRepeat& repeat) const { return repeat.set == scene.set; }
  [[nodiscard]] fs::path folder_of(const DrapeRepeat& repeat) const {
    return is_own(repeat) ? folder : folder / "repeats" / repeat.repeat;
  }
  /// Who fails where a step of it does.
  [[nodiscard]] std::string name_of(const DrapeRepeat& repeat) const {
    return is_own(repeat) ? scene.name : fmt::format("{}, repeat {}", scene.name, repeat.repeat);
  }
};

/// Everything the steps are made of.
struct Bench {
  RunOptions options;
  Rig rig;
  fs::path recording;
  std::vector<Drape> drapes;
  fs::path out, store, reduced_rig;

  [[nodiscard]] bool refines() const {
    return options.refine && !options.single && !options.internal_friction;
  }
  [[nodiscard]] fs::path target_detections() const { return out / "target-detections.json"; }
  [[nodiscard]] fs::path calibration() const { return out / "calibration.json"; }
};

Step step(const std::string& stage, const std::string& what, std::vector<std::string> arguments,
          const fs::path& output, double weight = 1) {
  std::vector<fs::path> outputs = {output};
  if (output.extension() == ".ply") outputs.push_back(fs::path(output).replace_extension(".json"));
  return {stage,  what,   stage_program(stage), std::move(arguments), run_record_path(output),
          weight, outputs};
}

std::string threads_text(const Bench& bench) {
  return std::to_string(bench.options.threads);
}

Step detect_step(const Bench& bench, const std::string& what, const std::string& surface,
                 const std::vector<std::string>& sets, const fs::path& output,
                 const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {bench.recording.string(),
                                        "--rig",
                                        bench.reduced_rig.string(),
                                        "--surface",
                                        surface,
                                        "--sets",
                                        fmt::format("{}", fmt::join(sets, ",")),
                                        "--out",
                                        output.string(),
                                        "--threads",
                                        threads_text(bench),
                                        "--json"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return step("detect", what, std::move(arguments), output, static_cast<double>(sets.size()));
}

std::string what_of(const Drape& drape, const ObjectTags& plate) {
  return fmt::format("{}, object {}", drape.scene.name, plate.object);
}

fs::path plate_detections(const Drape& drape, const ObjectTags& plate) {
  return drape.folder / fmt::format("object_{}-detections.json", plate.object);
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
    group.steps.back().drape = drape.scene.name;
    for (const DrapeRepeat& repeat : drape.repeats) {
      if (drape.is_own(repeat)) continue;
      group.steps.push_back(detect_step(bench, "drape " + drape.name_of(repeat), "cloth",
                                        {repeat.set}, drape.folder_of(repeat) / "detections.json"));
      group.steps.back().drape = drape.name_of(repeat);
    }
    for (const ObjectTags& plate : drape.tags) {
      group.steps.push_back(detect_step(bench, what_of(drape, plate), "target", {plate.set},
                                        plate_detections(drape, plate),
                                        {"--target", plate.target.string()}));
      group.steps.back().drape = drape.scene.name;
    }
  }
  return group;
}

/// Where the objects are, from their plates of tags. One after the other: each writes the scene
/// that the next one reads.
Group object_group(const Bench& bench) {
  Group group{"object", {}, 1};
  for (const Drape& drape : bench.drapes) {
    for (std::size_t k = 0; k < drape.tags.size(); ++k) {
      const ObjectTags& plate = drape.tags[k];
      const fs::path output = drape.object_file(plate);
      Step measure = step(
          "object", what_of(drape, plate),
          {plate_detections(drape, plate).string(), "--calibration", bench.calibration().string(),
           "--set", plate.set, "--scene", drape.scene_file(k).string(), "--object",
           std::to_string(plate.object), "--scene-out", drape.scene_file(k + 1).string(), "--out",
           output.string(), "--json"},
          output);
      for (const auto& [option, value] : plate.lies) {
        measure.arguments.push_back(option);
        measure.arguments.push_back(fmt::format("{}", value));
      }
      measure.outputs.push_back(drape.scene_file(k + 1));
      measure.drape = drape.scene.name;
      group.steps.push_back(std::move(measure));
    }
  }
  return group;
}

/// All cameras together where the rig has free poses of the target, else the paper's method.
Group calib_group(const Bench& bench) {
  const std::string method = bench.rig.free_poses.empty() ? "tsai" : "joint";
  return {"calib",
          {step("calib", fmt::format("{} cameras", bench.rig.cameras.size()),
                {bench.target_detections().string(), "--rig", bench.reduced_rig.string(),
                 "--method", method, "--out", bench.calibration().string(), "--json"},
                bench.calibration())},
          1};
}

/// Marks of one laying; `repeat` says which, where the rig does.
Step triangulate_step(const Bench& bench, const Drape& drape, const DrapeRepeat* repeat) {
  const fs::path folder = repeat == nullptr ? drape.folder : drape.folder_of(*repeat);
  const std::string name = repeat == nullptr ? drape.scene.name : drape.name_of(*repeat);
  const fs::path output = folder / "sheet.ply";
  Step measure =
      step("triangulate", "drape " + name,
           {(folder / "detections.json").string(), "--calibration", bench.calibration().string(),
            "--set", repeat == nullptr ? drape.scene.set : repeat->set, "--scene",
            drape.scene_file().string(), "--out", output.string(), "--json"},
           output);
  for (const ObjectTags& plate : drape.tags) {
    measure.arguments.emplace_back("--object");
    measure.arguments.push_back(drape.object_file(plate).string());
  }
  if (repeat != nullptr) measure.arguments.push_back("--repeat=" + repeat->repeat);
  if (repeat != nullptr && !repeat->face.empty())
    measure.arguments.push_back("--face=" + repeat->face);
  measure.drape = name;
  return measure;
}

Group triangulate_group(const Bench& bench) {
  Group group{"triangulate", {}, bench.options.threads};
  for (const Drape& drape : bench.drapes) {
    const DrapeRepeat* own = nullptr;
    for (const DrapeRepeat& repeat : drape.repeats)
      if (drape.is_own(repeat)) own = &repeat;
    group.steps.push_back(triangulate_step(bench, drape, own));
    for (const DrapeRepeat& repeat : drape.repeats)
      if (!drape.is_own(repeat)) group.steps.push_back(triangulate_step(bench, drape, &repeat));
  }
  return group;
}

fs::path simulation_folder(const Drape& drape, int grid, int segments) {
  return drape.folder / "simulations" / fmt::format("{}-{}", grid, segments);
}

/// What a drape and its ensemble have in common.
std::vector<std::string> drape_arguments(const Bench& bench, const Drape& drape, int grid,
                                         int segments, const fs::path& out) {
  std::vector<std::string> arguments = {drape.scene_file().string(),
                                        "--fabric",
                                        drape.scene.fabric_file.string(),
                                        "--grid",
                                        std::to_string(grid),
                                        "--segments",
                                        std::to_string(segments),
                                        "--start-from",
                                        (drape.folder / "sheet.ply").string(),
                                        "--out",
                                        out.string(),
                                        "--threads",
                                        "1",
                                        "--json"};
  if (bench.options.internal_friction) arguments.emplace_back("--internal-friction");
  return arguments;
}

Group simulate_group(const Bench& bench) {
  Group group{"simulate", {}, bench.options.threads};
  for (const int grid : bench.rig.grids) {
    for (const Drape& drape : bench.drapes) {
      for (const int segments : bench.rig.segments) {
        const fs::path folder = simulation_folder(drape, grid, segments);
        std::vector<std::string> arguments = drape_arguments(bench, drape, grid, segments, folder);
        arguments.insert(arguments.end(), {"--solver", "fall"});
        group.steps.push_back(step("simulate",
                                   fmt::format("{}, {}x{}, {} segment{}", drape.scene.name, grid,
                                               grid, segments, segments == 1 ? "" : "s"),
                                   std::move(arguments), folder / "sheet.ply",
                                   static_cast<double>(grid) * grid * grid));
        group.steps.back().drape = drape.scene.name;
      }
    }
  }
  // The longest first, so that no core waits for the last one.
  std::stable_sort(group.steps.begin(), group.steps.end(),
                   [](const Step& a, const Step& b) { return a.weight > b.weight; });
  return group;
}

/// The segments that speak for a drape: five, else the most.
int headline_segments(const Rig& rig) {
  const bool five = std::find(rig.segments.begin(), rig.segments.end(), 5) != rig.segments.end();
  return five ? 5 : *std::max_element(rig.segments.begin(), rig.segments.end());
}

fs::path refinement_file(const Drape& drape) {
  return drape.folder / "refined" / "refinement.json";
}

/// The drape that speaks for each scene on finer grids. A cloth with internal friction has a memory
/// that belongs to its grid.
Group refine_group(const Bench& bench) {
  Group group{"refine", {}, bench.options.threads};
  const int finest = *std::max_element(bench.rig.grids.begin(), bench.rig.grids.end());
  for (const Drape& drape : bench.drapes) {
    const fs::path file = refinement_file(drape);
    std::vector<std::string> arguments = {
        simulation_folder(drape, finest, headline_segments(bench.rig)).string(),
        "--scene",
        drape.scene_file().string(),
        "--fabric",
        drape.scene.fabric_file.string(),
        "--start-from",
        (drape.folder / "sheet.ply").string(),
        "--out",
        file.parent_path().string(),
        "--threads",
        "1",
        "--json"};
    if (bench.options.finest) {
      arguments.emplace_back("--finest");
      arguments.push_back(std::to_string(*bench.options.finest));
    }
    group.steps.push_back(step("refine", "drape " + drape.scene.name, std::move(arguments), file));
    group.steps.back().drape = drape.scene.name;
  }
  return group;
}

/// The sheet of the finest grid that came to rest, as far as the drape was refined.
std::optional<fs::path> refined_sheet(const Bench& bench, const Drape& drape,
                                      const std::set<fs::path>& failed) {
  const fs::path list = refinement_file(drape);
  if (!bench.refines() || failed.count(run_record_path(list)) != 0 || !fs::is_regular_file(list))
    return std::nullopt;
  const JsonNode root = JsonNode::open(list, "refinement", 1);
  const std::optional<double> used = root.optional_number("used");
  const std::vector<JsonNode> grids = root.items("grids");
  if (!used || !(*used >= 0 && *used < static_cast<double>(grids.size()))) return std::nullopt;
  const JsonNode& grid = grids[static_cast<std::size_t>(*used)];
  return name_inside(list.parent_path(), grid.text("sheet"), grid.where("sheet"));
}

fs::path ensemble_file(const Drape& drape) {
  return drape.folder / "ensemble" / "branches.json";
}

/// The equilibria that starts like the scene's come to, on at most kEnsembleGrid particles per
/// side: beyond, 32 drapes cost more than all other steps together.
Group ensemble_group(const Bench& bench) {
  Group group{"branches", {}, bench.options.threads};
  const int finest = *std::max_element(bench.rig.grids.begin(), bench.rig.grids.end());
  const int grid = std::min(kEnsembleGrid, finest);
  for (const Drape& drape : bench.drapes) {
    std::vector<std::string> arguments = drape_arguments(
        bench, drape, grid, headline_segments(bench.rig), ensemble_file(drape).parent_path());
    group.steps.push_back(step("branches",
                               fmt::format("{}, {}x{}, ensemble", drape.scene.name, grid, grid),
                               std::move(arguments), ensemble_file(drape)));
    group.steps.back().drape = drape.scene.name;
  }
  return group;
}

/// The sheets of its branches, as far as the ensemble was made and found any.
std::vector<fs::path> branch_sheets(const Bench& bench, const Drape& drape,
                                    const std::set<fs::path>& failed) {
  const fs::path list = ensemble_file(drape);
  if (bench.options.single || failed.count(run_record_path(list)) != 0 ||
      !fs::is_regular_file(list))
    return {};
  std::vector<fs::path> sheets;
  for (const JsonNode& branch : JsonNode::open(list, "branches", 1).items("branches"))
    sheets.push_back(name_inside(list.parent_path(), branch.text("sheet"), branch.where("sheet")));
  return sheets;
}

/// What the total uncertainty needs: how each distance answers to fabric and scene values, on a
/// grid that is quick (21) with the headline's segments.
Group sensitivity_group(const Bench& bench) {
  constexpr int kGrid = 21;
  Group group{"sensitivity", {}, bench.options.threads};
  const int chosen = headline_segments(bench.rig);
  const int grid =
      std::min(kGrid, *std::max_element(bench.rig.grids.begin(), bench.rig.grids.end()));
  for (const Drape& drape : bench.drapes) {
    const fs::path folder = drape.folder / "sensitivity";
    group.steps.push_back(
        step("sensitivity", "drape " + drape.scene.name,
             {drape.scene_file().string(), "--fabric", drape.scene.fabric_file.string(),
              "--reference", (drape.folder / "sheet.ply").string(), "--grid", std::to_string(grid),
              "--segments", std::to_string(chosen), "--only-first-order", "--out", folder.string(),
              "--threads", "1", "--json"},
             folder / "sensitivity.json"));
    group.steps.back().drape = drape.scene.name;
  }
  return group;
}

Step compare_step(const Bench& bench, const fs::path& report, const std::set<fs::path>& failed) {
  std::vector<std::string> arguments;
  const auto add = [&](const fs::path& sheet) {
    const bool there = failed.count(run_record_path(sheet)) == 0;
    if (there) arguments.push_back(sheet.string());
    return there;
  };
  for (const Drape& drape : bench.drapes) {
    if (!add(drape.folder / "sheet.ply")) continue;
    bool simulated = false;
    for (const int grid : bench.rig.grids)
      for (const int segments : bench.rig.segments)
        simulated = add(simulation_folder(drape, grid, segments) / "sheet.ply") || simulated;
    if (const auto sheet = refined_sheet(bench, drape, failed))
      arguments.push_back(sheet->string());
    for (const fs::path& sheet : branch_sheets(bench, drape, failed))
      arguments.push_back(sheet.string());
    for (const DrapeRepeat& repeat : drape.repeats) {
      const fs::path sheet = drape.folder_of(repeat) / "sheet.ply";
      if (!simulated || drape.is_own(repeat) || failed.count(run_record_path(sheet)) != 0) continue;
      arguments.emplace_back("--repeat");
      arguments.push_back(sheet.string());
    }
    const fs::path split = drape.folder / "sensitivity" / "sensitivity.json";
    // Named, so that a comparison from before it was made is not up to date.
    if (fs::is_regular_file(split)) {
      arguments.emplace_back("--sensitivity");
      arguments.push_back(split.string());
    }
  }
  for (const std::string& more :
       {std::string("--calibration"), bench.calibration().string(), std::string("--store"),
        bench.store.string(), std::string("--report"), report.string()}) {
    arguments.push_back(more);
  }
  const fs::path acceptance = bench.rig.file.parent_path() / "acceptance.json";
  if (fs::is_regular_file(acceptance)) {
    arguments.emplace_back("--acceptance");
    arguments.push_back(acceptance.string());
  }
  if (!bench.options.label.empty()) arguments.push_back("--label=" + bench.options.label);
  if (!bench.options.operator_name.empty())
    arguments.push_back("--operator=" + bench.options.operator_name);
  return step("compare", "all drapes", arguments, report);
}

std::vector<Drape> read_drapes(const Rig& rig, const fs::path& out) {
  std::vector<Drape> drapes;
  const std::vector<DrapeRepeat> repeats = repeats_of(rig.file);
  for (const fs::path& file : rig.scenes) {
    Scene scene = read_scene(file);
    const fs::path folder = out / scene.name;
    std::vector<DrapeRepeat> own;
    std::copy_if(repeats.begin(), repeats.end(), std::back_inserter(own),
                 [&](const DrapeRepeat& one) { return one.scene == scene.name; });
    drapes.push_back({std::move(scene), folder, object_tags_of(file), std::move(own)});
  }
  return drapes;
}

std::string quoted(const std::string& text) {
  return Json(text).dump();  // TOML's basic strings have JSON's escapes
}

/// What detect and calib read of the rig, in a file of its own in the output folder, so that other
/// grids, segments and scenes leave their results up to date. Written only when it changes.
fs::path write_reduced_rig(const Bench& bench) {
  const auto relative = [&](const fs::path& file) {
    return quoted(fs::proximate(file, bench.out).generic_string());
  };
  const Rig& rig = bench.rig;
  std::string text = fmt::format(
      "# Made by `drape run`: the part of {} that detect and calib read.\n"
      "schema = \"drapebench/rig/1\"\nname = {}\ntarget = {}\nprint = {}\nrecording = {}\n\n"
      "[calibration]\nestimate_scale_x = {}\n",
      rig.file.filename().string(), quoted(rig.name), relative(rig.target_file),
      relative(rig.print_file), relative(bench.recording), rig.estimate_scale_x);
  text += fmt::format("free_poses = {}\n", Json(rig.free_poses).dump());
  for (const TargetStage& stage : rig.stages)
    text += fmt::format("\n[[calibration.stage]]\nset = {}\nz_mm = {:.9f}\n", quoted(stage.set),
                        stage.z_m / units::mm);
  for (const RigCamera& camera : rig.cameras)
    text += fmt::format(
        "\n[[camera]]\nname = {}\nwidth_px = {}\nheight_px = {}\npixel_pitch_um = [{:.9f}, "
        "{:.9f}]\n",
        quoted(camera.name), camera.width_px, camera.height_px, camera.pixel_pitch_x_m / units::um,
        camera.pixel_pitch_y_m / units::um);
  fs::path file = bench.out / "rig.toml";
  if (!fs::is_regular_file(file) || read_text(file) != text) write_durable(file, text);
  return file;
}

/// The same file has one name, however it was spelled, so that its steps stay up to date.
fs::path one_name(const fs::path& path) {
  return fs::proximate(fs::absolute(path).lexically_normal());
}

}  // namespace

Plan make_plan(const RunOptions& options) {
  Bench bench;
  bench.options = options;
  bench.rig = read_rig(one_name(options.rig));
  bench.recording = one_name(options.recording.empty() ? bench.rig.recording : options.recording);
  bench.out = one_name(options.out.empty() ? fs::path("out") / bench.rig.name : options.out);
  bench.store = options.store.empty() ? bench.out / "results.sqlite" : one_name(options.store);
  bench.drapes = read_drapes(bench.rig, bench.out);
  bench.reduced_rig = bench.out / "rig.toml";
  const fs::path report = bench.out / "report.html";
  std::vector<Group> groups = {detect_group(bench), calib_group(bench)};
  if (Group objects = object_group(bench); !objects.steps.empty())
    groups.push_back(std::move(objects));
  groups.push_back(triangulate_group(bench));
  groups.push_back(simulate_group(bench));
  if (bench.refines()) groups.push_back(refine_group(bench));
  if (!options.single) groups.push_back(ensemble_group(bench));
  if (options.uncertainty) groups.push_back(sensitivity_group(bench));
  return {bench.out,
          bench.store,
          report,
          std::move(groups),
          [bench, report](const std::set<fs::path>& failed) {
            return compare_step(bench, report, failed);
          },
          [bench] { static_cast<void>(write_reduced_rig(bench)); }};
}

}  // namespace drape
