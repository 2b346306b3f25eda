// SPDX-License-Identifier: Apache-2.0
#include "front/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"
#include "front/plan_bench.hpp"
#include "front/toml_quoted.hpp"

namespace drape {

using namespace plan;

namespace {

namespace fs = std::filesystem;

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
  for (const fs::path& file : rig.scenes) {
    Scene scene = read_scene(file);
    const fs::path folder = out / scene.name;
    std::vector<DrapeRepeat> own;
    std::copy_if(rig.repeats.begin(), rig.repeats.end(), std::back_inserter(own),
                 [&](const DrapeRepeat& one) { return one.scene == scene.name; });
    std::vector<ObjectTags> tags = scene.tags;
    drapes.push_back({std::move(scene), folder, std::move(tags), std::move(own)});
  }
  return drapes;
}

constexpr const char* kMadeByRun = "# Made by `drape run`";

/// A rig.toml in the output folder that no run made is somebody's own.
void refuse_to_replace(const fs::path& reduced_rig) {
  if (!fs::exists(reduced_rig) || read_text(reduced_rig).starts_with(kMadeByRun)) return;
  throw bad_input("the output folder holds a rig.toml that no run made",
                  {.file = reduced_rig.string()}, "give another folder with --out");
}

/// What detect and calib read of the rig, in a file of its own in the output folder, so that other
/// grids, segments and scenes leave their results up to date. Written only when it changes.
fs::path write_reduced_rig(const Bench& bench) {
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
  if (options.finest && !bench.refines())
    throw usage_error("--finest is given, but nothing is refined",
                      "leave out --single, --no-refine and --internal-friction, or --finest");
  if (options.uncertainty && options.internal_friction)
    throw usage_error("--uncertainty speaks of a cloth without internal friction",
                      "leave out one of both");
  bench.rig = read_rig(one_name(options.rig));
  bench.recording = one_name(options.recording.empty() ? bench.rig.recording : options.recording);
  bench.out = one_name(options.out.empty() ? fs::path("out") / bench.rig.name : options.out);
  bench.store = options.store.empty() ? bench.out / "results.sqlite" : one_name(options.store);
  bench.drapes = read_drapes(bench.rig, bench.out);
  bench.reduced_rig = bench.out / "rig.toml";
  refuse_to_replace(bench.reduced_rig);
  const fs::path report = bench.out / "report.html";
  std::vector<Group> groups = {detect_group(bench), calib_group(bench)};
  if (Group objects = object_group(bench); !objects.steps.empty())
    groups.push_back(std::move(objects));
  groups.push_back(triangulate_group(bench));
  groups.push_back(simulate_group(bench));
  if (bench.refines()) groups.push_back(refine_group(bench));
  if (!options.single) groups.push_back(ensemble_group(bench));
  if ((options.uncertainty || !options.single) && !options.internal_friction)
    groups.push_back(sensitivity_group(bench));
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
