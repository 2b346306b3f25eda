// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/objects/scene_files.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr double kMostCases = 1e6;  ///< largest number of cases, since all are held in memory

/// SHA-256 of files, each read only once.
class Hashes {
 public:
  const std::string& of(const fs::path& file) {
    std::string& hash = known_[file.string()];
    if (hash.empty()) hash = sha256_of_file(file);
    return hash;
  }

 private:
  std::map<std::string, std::string> known_;
};

std::string key_of(const StudyCase& one, const std::vector<fs::path>& files,
                   const fs::path& program, Hashes& hashes) {
  const SimulateOptions& how = one.options;
  std::string text = fmt::format(
      "drapebench/study-key/2\nprogram {}\nmodel {}\ncloth {}\nsegments {}\nseed {}\n",
      hashes.of(program), drape::name_of(how.model), one.discretisation(), how.segments, one.seed);
  text += how.model == ClothModel::paper
              ? fmt::format("steps {}\n", how.paper.max_steps)
              : fmt::format("thickness_mm {}\n", how.drape.thickness_m / mm);
  for (const fs::path& file : files) text += "file " + hashes.of(file) + "\n";
  return sha256_of(std::string_view(text));
}

/// Removes repeated values from a list.
template <class List>
void require_each_once(Fields& f, const char* name, List sorted) {
  std::sort(sorted.begin(), sorted.end());
  f.limit(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(), name,
          "a value is listed twice", "list it once");
}

/// Default plan of a rig without plan.toml.
PlanFile plan_of_scenes(const fs::path& rig) {
  PlanFile plan;
  if (!fs::is_directory(rig / "scenes"))
    throw bad_input("the rig has no plan.toml and no folder `scenes`", {.file = rig.string()},
                    "give a plan.toml or a rig folder, e.g. rigs/paper");
  for (const auto& entry : fs::directory_iterator(rig / "scenes"))
    if (entry.path().extension() == ".toml") plan.scenes.push_back(entry.path());
  std::sort(plan.scenes.begin(), plan.scenes.end());
  return plan;
}

PlanFile read_plan_file(const fs::path& file) {
  const Document document = Document::read(file);
  for (const auto& [gone, remedy] :
       {std::pair("models", "write model = \"paper\" for the paper's grids, nothing for the cloth"),
        std::pair("solvers", "leave it out: there is one way to rest")})
    if (document.root().find(gone) != nullptr)
      throw bad_input(fmt::format("a plan has no `{}` any more", gone), document.where(gone),
                      remedy);
  return read_record<PlanFile>(document);
}

/// Applies the lists given on the command line.
void choose(const PlanChoice& choice, const fs::path& rig, PlanFile& plan) {
  for (const std::string& name : choice.scenes)
    if (std::none_of(plan.scenes.begin(), plan.scenes.end(),
                     [&](const fs::path& file) { return file.stem() == name; }))
      throw usage_error(fmt::format("the rig has no scene `{}`", name),
                        fmt::format("see {}", (rig / "scenes").string()));
  if (!choice.scenes.empty())
    std::erase_if(plan.scenes, [&](const fs::path& file) {
      return std::find(choice.scenes.begin(), choice.scenes.end(), file.stem()) ==
             choice.scenes.end();
    });
  if (!choice.grids.empty() && plan.model != ClothModel::paper)
    throw usage_error("--grids belongs to the paper's model, which this rig's plan does not name",
                      "give --spacings-mm");
  if (!choice.grids.empty()) plan.grids = choice.grids;
  if (!choice.segments.empty()) plan.segments = choice.segments;
  if (!choice.spacings_m.empty()) plan.spacings_m = choice.spacings_m;
}

/// Options for each combination of model, grid or spacing, and number of segments.
std::vector<SimulateOptions> options_of(const PlanFile& plan) {
  std::vector<SimulateOptions> all;
  SimulateOptions how = plan.simulate;
  const auto add = [&] {
    for (const int segments : plan.segments) {
      how.segments = segments;
      all.push_back(how);
    }
  };
  how.model = ClothModel::paper;
  if (plan.model == ClothModel::paper)
    for (const int grid : plan.grids) {
      how.paper.rows = how.paper.cols = grid;
      add();
    }
  how.model = ClothModel::triangles;
  for (const double spacing_m : plan.spacings_m) {
    how.drape.spacing_m = spacing_m;
    add();
  }
  return all;
}

}  // namespace

void fields(Fields& f, PlanFile& plan) {
  f({"scenes", "scene files"}, plan.scenes);
  f.if_any({"fabrics", "fabric files; absent for the scene's own"}, plan.fabrics);
  f.otherwise({"model", "triangles: the cloth; paper: the paper's grid in addition to the cloth"},
              plan.model);
  const bool paper = plan.model == ClothModel::paper;
  if (f.reads() && plan.document.root().find("grids") != nullptr)
    f.limit(paper, "grids", "belongs to model = \"paper\"",
            "write spacings_mm, the finest meshes of the cloth");
  f.otherwise({"grids", "particles per side, of the paper's model", 1, 3, 401}, plan.grids);
  f.otherwise({"spacings_mm", "spacings of the finest meshes", mm, 0.5, 50}, plan.spacings_m);
  f.otherwise({"segments", "line segments per Kawabata curve", 1, 1, 20}, plan.segments);
  f.otherwise({"seeds", "starts: 0 is the scene's, others are random", 1, 0}, plan.seeds);
  f.otherwise({"max_steps", "largest number of steps of the paper's model", 1, 1},
              plan.simulate.paper.max_steps);
  f.otherwise({"thickness_mm", "distance below which layers press on each other; 0: they do not",
               mm, 0, 10},
              plan.simulate.drape.thickness_m);
  const bool has_fabrics = f.reads() && plan.document.root().find("fabrics") != nullptr;
  for (const auto& [name, empty] :
       {std::pair("scenes", plan.scenes.empty()),
        std::pair("fabrics", has_fabrics && plan.fabrics.empty()),
        std::pair("grids", plan.grids.empty()), std::pair("spacings_mm", plan.spacings_m.empty()),
        std::pair("segments", plan.segments.empty()), std::pair("seeds", plan.seeds.empty())})
    f.limit(!empty, name, "the list is empty", "write one value or more");
  require_each_once(f, "grids", plan.grids);
  require_each_once(f, "spacings_mm", plan.spacings_m);
  require_each_once(f, "segments", plan.segments);
  require_each_once(f, "seeds", plan.seeds);
}

void fields(Fields& f, PlanChoice& choice) {
  f.otherwise(Field{"scenes", "scenes of a rig, comma-separated names; default: all"}.plain_name(),
              choice.scenes);
  f.otherwise({"grids", "particles per side of the paper's model", 1, 3, 401}, choice.grids);
  f.otherwise({"spacings_mm", "spacings of the finest meshes", mm, 0.5, 50}, choice.spacings_m);
  f.otherwise({"segments", "line segments per Kawabata curve", 1, 1, 20}, choice.segments);
  require_each_once(f, "grids", choice.grids);
  require_each_once(f, "spacings_mm", choice.spacings_m);
  require_each_once(f, "segments", choice.segments);
}

std::string StudyCase::discretisation() const {
  return options.model == ClothModel::paper
             ? fmt::format("{}x{}", options.paper.rows, options.paper.cols)
             : fmt::format("{:g} mm", options.drape.spacing_m / mm);
}

std::string StudyCase::name() const {
  return fmt::format("{} {}: {}, {}, {} segment{}{}", scene, fabric_file.stem().string(),
                     drape::name_of(options.model), discretisation(), options.segments,
                     options.segments == 1 ? "" : "s",
                     seed == 0 ? "" : fmt::format(", seed {}", seed));
}

StudyPlan read_plan(const fs::path& rig_or_plan, const PlanChoice& choice, const fs::path& out,
                    const fs::path& program) {
  const bool is_rig = fs::is_directory(rig_or_plan);
  const fs::path file = is_rig ? rig_or_plan / "plan.toml" : rig_or_plan;
  PlanFile plan = is_rig && !fs::exists(file) ? plan_of_scenes(rig_or_plan) : read_plan_file(file);
  choose(choice, rig_or_plan, plan);
  const bool by_name = is_rig && plan.fabrics.empty() && plan.seeds == std::vector<int>{0};
  if (plan.fabrics.empty()) plan.fabrics.emplace_back();  // the scene's own fabric
  const std::vector<SimulateOptions> options = options_of(plan);
  const double count = static_cast<double>(plan.scenes.size() * plan.fabrics.size()) *
                       static_cast<double>(plan.seeds.size() * options.size());
  const auto refuse = [&](const char* key, const std::string& what, const std::string& remedy) {
    throw bad_input(what, {.file = file.string(), .field = key}, remedy);
  };
  if (count > kMostCases)
    refuse("scenes", fmt::format("the plan has {:g} cases", count),
           fmt::format("make plans of at most {:g}", kMostCases));
  StudyPlan study{{}, is_rig ? rig_or_plan : rig_or_plan.parent_path(), by_name};
  Hashes hashes;
  std::map<std::string, std::size_t> scene_of_key;
  for (std::size_t k = 0; k < plan.scenes.size(); ++k) {
    const fs::path& scene_file = plan.scenes[k];
    const Scene scene = read_scene(scene_file);
    for (const fs::path& fabric : plan.fabrics) {
      const fs::path fabric_file = fabric.empty() ? scene.fabric_file : fabric;
      const std::vector<fs::path> files = files_of(scene, read_fabric(fabric_file));
      for (const SimulateOptions& how : options) {
        for (const int seed : plan.seeds) {
          StudyCase one{scene_file, fabric_file, scene_file.stem().string(), how, seed, {}, {}};
          if (seed != 0) one.options.paper.imperfection_m = variation_of(seed).noise_m;
          one.key = key_of(one, files, program, hashes);
          // also catches identical files with different names
          if (const auto [first, is_new] = scene_of_key.emplace(one.key, k); !is_new)
            refuse(first->second == k ? "fabrics" : "scenes",
                   fmt::format("scene {} with fabric {} is listed twice", scene_file.string(),
                               fabric_file.string()),
                   "list each scene and fabric once");
          std::string words = fmt::format("{}-{}", one.discretisation(), how.segments);
          std::erase(words, ' ');
          one.folder = by_name ? out / one.scene / drape::name_of(how.model) / words
                               : out / one.key.substr(0, 2) / one.key;
          study.cases.push_back(std::move(one));
        }
      }
    }
  }
  return study;
}

}  // namespace drape::simulate
