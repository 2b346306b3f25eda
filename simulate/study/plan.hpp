// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// A study's plan (plan.toml), whose lists are combined to cases. The paper's model runs on every
/// grid, together with the cloth on the meshes; otherwise the cloth runs on the meshes only.
struct PlanFile {
  std::vector<std::filesystem::path> scenes, fabrics;  ///< empty `fabrics`: each scene's own
  ClothModel model = ClothModel::triangles;
  std::vector<int> grids = {11, 21, 31};
  std::vector<double> spacings_m = {DrapeOptions{}.spacing_m};
  std::vector<int> segments = {1, 5};
  std::vector<int> seeds = {0};
  SimulateOptions simulate;  ///< everything else
  Document document = {};
};

/// Lists given on the command line of a rig's study, which replace those of the plan unless empty.
struct PlanChoice {
  std::vector<std::string> scenes;  ///< stems of the scene files
  std::vector<int> grids, segments;
  std::vector<double> spacings_m;
};
void fields(Fields& f, PlanChoice& choice);

/// One drape of a study.
struct StudyCase {
  std::filesystem::path scene_file, fabric_file;
  std::string scene;  ///< stem of the scene file
  SimulateOptions options;
  int seed = 0;  ///< seed of the start, see seeded(); 0 for the scene's own
  /// SHA-256 of everything that the drape depends on: bytes of files, options, program.
  std::string key;
  std::filesystem::path folder;

  /// Discretisation: "21x21" or "2.5 mm".
  [[nodiscard]] std::string discretisation() const;
  /// Name of the case, e.g. "A: paper, 21x21, 5 segments"; with fabric and seed if they vary.
  [[nodiscard]] std::string name() const;
};

/// The cases of a plan in order: by scene, fabric, model, grid or spacing, segments, seed.
struct StudyPlan {
  std::vector<StudyCase> cases;
  std::filesystem::path folder;  ///< folder of the plan or rig
  bool by_name = false;          ///< folders are named by scene and options, one drape each: tables
};

/// Reads a plan, or for a folder its plan.toml or, without one, every scene in its scenes/. Cases
/// of a folder are in <out>/<scene>/<model>/<grid or spacing>-<segments>; those of a plan, or with
/// several fabrics or seeds, in <out>/<2 digits>/<key>, so that parts, repeated runs and other
/// plans in one folder reuse results. `program` is the executable. Throws Error for unreadable
/// files, keys of older plans (with their replacement), and more than 10^6 cases.
[[nodiscard]] StudyPlan read_plan(const std::filesystem::path& rig_or_plan,
                                  const PlanChoice& choice, const std::filesystem::path& out,
                                  const std::filesystem::path& program);

}  // namespace drape::simulate

template <>
inline constexpr drape::Format drape::format_of<drape::simulate::PlanFile>{
    "plan", Syntax::toml, 1, "plan.toml: cases of a study"};

namespace drape::simulate {
void fields(Fields& f, PlanFile& plan);
}  // namespace drape::simulate
