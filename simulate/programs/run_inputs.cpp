// SPDX-License-Identifier: Apache-2.0
#include "simulate/programs/run_inputs.hpp"

#include <fmt/format.h>

#include <regex>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/rules.hpp"
#include "core/units.hpp"
#include "simulate/objects/scene_files.hpp"
#include "simulate/start/start_check.hpp"
#include "simulate/start/start_file.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;
using units::mm;

namespace {

/// Folders `branch-NN` named in the branches.json of an earlier run in `out`. The list is written
/// before the sheets, so it also names what an interrupted run left.
std::vector<fs::path> earlier_branches(const fs::path& out) {
  static const std::regex of_a_branch("branch-[0-9]+/sheet\\.ply");
  std::vector<fs::path> folders;
  if (!fs::exists(out / "branches.json")) return folders;
  for (const ListedBranch& branch : read_record<BranchList>(out / "branches.json").branches)
    if (std::regex_match(branch.sheet, of_a_branch))
      folders.push_back((out / branch.sheet).parent_path());
  return folders;
}

std::vector<fs::path> start_inputs(const RunArguments& args) {
  return args.start ? start_files(*args.start) : std::vector<fs::path>{};
}

}  // namespace

void fields(Fields& f, RunArguments& args) {
  f(Field{"scene", "scene.toml: objects, table, pins, start"}.called("SCENE"), args.scene);
  f({"fabric", "fabric.toml; default: the scene's"}, args.fabric);
  f.otherwise({"segments", "line segments per Kawabata curve", 1, 1, 20}, args.options.segments);
  f.otherwise({"fit",
               "drape: fit the curves up to the strains of a first run; whole: fit the measured "
               "range, as the paper"},
              args.fit);
  f({"start_from", "measured sheet.ply, or mesh.toml of another simulator, for start and pins"},
    args.start);
  f.otherwise({"internal_friction",
               "use both branches of the bending and shear loops, which depend on the loading "
               "history, including the scene's start.history"},
              args.options.internal_friction);
  f.otherwise({"out", "folder for the results"}, args.out);
}

void mesh_fields(Fields& f, DrapeOptions& options, bool finest) {
  if (finest)
    f.otherwise({"spacing_mm", "spacing of the finest mesh", mm, 0.5, 50}, options.spacing_m);
  f.otherwise({"coarsest_mm", "spacing of the mesh on which the cloth falls", mm, 0.5, 50},
              options.coarsest_m);
  f.otherwise({"seed", "seed of the meshes' jitter: each gives another mesh", 1, 0, 1000000},
              options.seed);
  f.otherwise({"thickness_mm", "distance below which layers press on each other; 0: they do not",
               mm, 0, 10},
              options.thickness_m);
}

std::vector<fs::path> RunInputs::files() const {
  return files_of(scene, fabric);
}

RunInputs read_checked(const fs::path& scene_file, const std::optional<fs::path>& fabric_file) {
  if (scene_file.empty()) throw usage_error("SCENE is missing", "give a scene.toml");
  const Scene scene = read_scene(scene_file);
  RunInputs inputs{scene, read_fabric(fabric_file.value_or(scene.fabric_file)), print_of(scene),
                   std::nullopt};
  check_pins(inputs.scene, inputs.print, inputs.fabric);
  return inputs;
}

Sheet read_start_of(const fs::path& file, const Scene& scene, const Print& print) {
  require_gravity_of_earth(scene);
  return read_start(file, print);
}

void require_same_drape(const Sheet& reference, const Scene& scene) {
  const auto* source = std::get_if<MeasuredSource>(&reference.source);
  if (source == nullptr || !source->asked_scene || source->asked_scene->name == scene.name) return;
  throw bad_input(fmt::format("the reference is a drape of scene `{}`, not of `{}`",
                              source->asked_scene->name, scene.name),
                  reference.document.where("source.asked_scene"),
                  "give the sheet that was measured of this scene");
}

RunInputs read_run_inputs(const RunArguments& args, const std::vector<fs::path>& outputs) {
  if (args.out.empty()) throw usage_error("--out is missing", "give a folder");
  RunInputs inputs = read_checked(args.scene, args.fabric);
  StepFiles files{outputs, inputs.files()};
  for (const fs::path& file : start_inputs(args)) files.inputs.push_back(file);
  const RunRecord kept_nowhere("drape-simulate", {}, {}, files);
  if (args.start) inputs.measured = read_start_of(*args.start, inputs.scene, inputs.print);
  return inputs;
}

RunRecord record_of(const RunArguments& args, const RunInputs& inputs,
                    std::vector<std::string> words, const fs::path& file) {
  RunRecord record("drape-simulate", std::move(words), file, {{}, start_inputs(args)});
  for (const fs::path& read : inputs.files()) record.input(read);
  return record;
}

void set_reach(RunArguments& args, const RunInputs& inputs) {
  // The paper's model always uses the paper's fit.
  if (args.fit == CurveFit::drape && args.options.model == ClothModel::triangles)
    args.options.reach = find_reach(inputs.scene, inputs.fabric, inputs.print, inputs.measured);
}

std::vector<fs::path> earlier_branch_files(const fs::path& out) {
  (void)earlier_branches(out);  // reports an unreadable list before hours of work
  std::vector<fs::path> files;
  std::error_code absent;
  for (const auto& entry : fs::directory_iterator(out, absent))
    if (entry.path().filename().string().starts_with("branch-"))
      for (const fs::path& file : output_files(entry.path())) files.push_back(file);
  return files;
}

void write_branch_list(const fs::path& out, const BranchList& list, RunRecord& record) {
  for (const fs::path& folder : earlier_branches(out)) {
    if (!fs::is_directory(fs::symlink_status(folder))) continue;
    for (const fs::path& file : output_files(folder))
      if (fs::is_regular_file(fs::symlink_status(file))) remove_durable(file);
    std::error_code not_empty;
    fs::remove(folder, not_empty);
  }
  write_record(out / "branches.json", list);
  record.output(out / "branches.json");
}

}  // namespace drape::simulate
