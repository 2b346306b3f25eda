// SPDX-License-Identifier: Apache-2.0
#include "simulate/programs/run_inputs.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/files/json_file.hpp"
#include "simulate/earlier_sheets.hpp"
#include "simulate/objects/scene_files.hpp"
#include "simulate/start/start_check.hpp"
#include "simulate/start/start_file.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

void add_fit_option(Command& app, CurveFit& fit) {
  add_names(app, "--fit", fit,
            "drape: the curves up to where a first run strains the cloth; whole: all that was "
            "measured, as the paper");
}

void add_run_options(Command& app, RunArguments& args, const std::string& out_holds) {
  app.add_option("SCENE", args.scene, "scene.toml: objects, table, pins, start");
  app.add_option("--fabric", args.fabric, "fabric.toml; default: the scene's");
  app.add_option("--grid", args.grid, "particles per side")->capture_default_str();
  app.add_option("--segments", args.options.segments, "line segments per Kawabata curve")
      ->capture_default_str();
  add_fit_option(app, args.fit);
  app.add_option("--start-from", args.start,
                 "measured sheet.ply, or mesh.toml of another simulator, for start and pins");
  app.add_option("--out", args.out, out_holds);
}

std::vector<fs::path> start_inputs(const RunArguments& args) {
  return args.start ? start_files(*args.start) : std::vector<fs::path>{};
}

StepFiles refuse_to_replace(const fs::path& scene_file, const std::optional<fs::path>& fabric_file,
                            StepFiles files) {
  const Scene scene = read_scene(scene_file);
  for (const fs::path& file : files_of(scene, read_fabric(fabric_file.value_or(scene.fabric_file))))
    files.inputs.push_back(file);
  const RunRecord kept_nowhere("drape-simulate", {}, {}, files);
  return files;
}

StepFiles start_beside_branches(const RunArguments& args) {
  (void)earlier_branches(args.out);  // a list that cannot be read is named before hours of work
  StepFiles replaced{{}, start_inputs(args)};
  std::error_code absent;
  for (const auto& entry : fs::directory_iterator(args.out, absent))
    if (entry.path().filename().string().starts_with("branch-"))
      for (const fs::path& file : sheet_files(entry.path())) replaced.outputs.push_back(file);
  refuse_to_replace(args.scene, args.fabric, replaced);
  return {{}, replaced.inputs};
}

void write_branch_list(const fs::path& out, const Json& json, RunRecord& record) {
  remove_sheets(earlier_branches(out));
  write_json(out / "branches.json", json);
  record.output(out / "branches.json");
}

RunInputs read_checked(const fs::path& scene_file, const std::optional<fs::path>& fabric_file) {
  const Scene scene = read_scene(scene_file);
  RunInputs inputs{scene, read_fabric(fabric_file.value_or(scene.fabric_file)),
                   read_print(scene.print_file), std::nullopt};
  check_pins(inputs.scene, inputs.print, inputs.fabric);
  return inputs;
}

void require_same_drape(const fs::path& reference, const Scene& scene) {
  const fs::path file = fs::path(reference).replace_extension(".json");
  const JsonNode source = JsonNode::open(file, "sheet", 1).at("source");
  if (!source.has("asked_scene")) return;
  const std::string asked = source.at("asked_scene").text("name");
  if (asked != scene.name)
    throw bad_input(
        fmt::format("the reference is a drape of scene `{}`, not of `{}`", asked, scene.name),
        {.file = file.string(), .field = "source.asked_scene"},
        "give the sheet that was measured of this scene");
}

Sheet read_start_of(const fs::path& file, const Scene& scene, const Print& print) {
  require_gravity_of_earth(scene);
  return read_start(file, print);
}

RunInputs read_run_inputs(RunArguments& args, RunRecord& record) {
  RunInputs inputs = read_checked(args.scene, args.fabric);
  if (args.start) inputs.measured = read_start_of(*args.start, inputs.scene, inputs.print);
  for (const fs::path& file : files_of(inputs.scene, inputs.fabric)) record.input(file);
  args.options.rows = args.options.cols = args.grid;
  // The model of the paper and round specimens keep the paper's fit.
  if (args.fit == CurveFit::drape && args.options.model == ClothModel::consistent &&
      !args.options.round)
    args.options.reach = find_reach(inputs.scene, inputs.fabric, inputs.print, inputs.measured);
  return inputs;
}

}  // namespace drape::simulate
