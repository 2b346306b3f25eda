// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// A study's plan (plan.toml): each list multiplies the cases. Of the paper's model every grid, and
/// beside it the cloth on the meshes; of the cloth the meshes alone.
struct PlanFile {
  std::vector<std::filesystem::path> scenes, fabrics;  ///< fabrics empty: each scene's own
  ClothModel model = ClothModel::triangles;
  std::vector<int> grids = {11, 21, 31};
  std::vector<double> spacings_m = {DrapeOptions{}.spacing_m};
  std::vector<int> segments = {1, 5};
  std::vector<int> seeds = {0};
  SimulateOptions simulate;  ///< everything else
  Document document = {};
};

/// Lists of a plan that the command line of a rig's study replaces; empty: the plan's.
struct PlanChoice {
  std::vector<std::string> scenes;  ///< stems of the scenes' files
  std::vector<int> grids, segments;
  std::vector<double> spacings_m;
};
void fields(Fields& f, PlanChoice& choice);

/// One drape of a study.
struct StudyCase {
  std::filesystem::path scene_file, fabric_file;
  std::string scene;  ///< stem of the file
  SimulateOptions options;
  int seed = 0;  ///< seed of the start, see seeded(); 0: the scene's own
  /// SHA-256 of everything that the drape depends on: files' bytes, options, program.
  std::string key;
  std::filesystem::path folder;

  /// "21x21" or "2.5 mm".
  [[nodiscard]] std::string discretisation() const;
  /// "A: paper, 21x21, 5 segments", with fabric and seed where a plan has several.
  [[nodiscard]] std::string name() const;
};

/// The cases of a plan in their order: scene, fabric, model, grid or spacing, segments, seed.
struct StudyPlan {
  std::vector<StudyCase> cases;
  std::filesystem::path folder;  ///< folder of the plan or rig
  bool by_name = false;          ///< folders are named by scene and options, one drape each: tables
};

/// Reads a plan, or of a folder its plan.toml or, without one, every scene in its scenes/. Cases of
/// a folder lie in <out>/<scene>/<model>/<grid or spacing>-<segments>; of a plan, or where fabrics
/// or seeds are several, in <out>/<2 digits>/<key>, so that parts, repeated runs and other plans on
/// one folder find what was computed before. `program`: the file that runs. Throws Error for what
/// cannot be read, for keys of older plans, with what replaces them, and for more than 10^6 cases.
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
