// SPDX-License-Identifier: Apache-2.0
// Steps from pictures to measured sheets.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/program/run_record.hpp"
#include "front/plan_bench.hpp"

namespace drape::plan {

namespace fs = std::filesystem;

Step step(const std::string& stage, const std::string& what, std::vector<std::string> arguments,
          const fs::path& output, double weight) {
  std::vector<fs::path> outputs = {output};
  if (output.extension() == ".ply") outputs.push_back(fs::path(output).replace_extension(".json"));
  StageCall call = call_of(stage, std::move(arguments));
  return {
      stage,  what,   std::move(call.program), std::move(call.arguments), run_record_path(output),
      weight, outputs};
}

std::string threads_text(const Bench& bench) {
  return std::to_string(bench.options.threads);
}

namespace {

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

}  // namespace

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
      for (const auto& [option, value] : plate.lies()) {
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

Group calib_group(const Bench& bench) {
  const std::string method = bench.rig.free_poses.empty() ? "tsai" : "joint";
  return {"calib",
          {step("calib", fmt::format("{} cameras", bench.rig.cameras.size()),
                {bench.target_detections().string(), "--rig", bench.reduced_rig.string(),
                 "--method", method, "--out", bench.calibration().string(), "--json"},
                bench.calibration())},
          1};
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

}  // namespace drape::plan
