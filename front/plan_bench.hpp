// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "front/plan.hpp"

/// What the steps of a run are made of; for plan*.cpp alone.
namespace drape::plan {

struct Drape {
  Scene scene;
  std::filesystem::path folder;
  std::vector<ObjectTags> tags;
  std::vector<DrapeRepeat> repeats;  ///< its own laying among them only where the rig names it

  /// object.json of a plate of tags.
  [[nodiscard]] std::filesystem::path object_file(const ObjectTags& plate) const {
    return folder / fmt::format("object_{}.json", plate.object);
  }
  /// The scene with its objects where the first `plates` plates show them.
  [[nodiscard]] std::filesystem::path scene_file(std::size_t plates) const {
    return plates == 0 ? scene.file
                       : folder / fmt::format("scene_{}.toml", tags[plates - 1].object);
  }
  /// What is simulated.
  [[nodiscard]] std::filesystem::path scene_file() const { return scene_file(tags.size()); }

  [[nodiscard]] bool is_own(const DrapeRepeat& repeat) const { return repeat.set == scene.set; }
  [[nodiscard]] std::filesystem::path folder_of(const DrapeRepeat& repeat) const {
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
  std::filesystem::path recording;
  std::vector<Drape> drapes;
  std::filesystem::path out, store, reduced_rig;

  [[nodiscard]] bool refines() const {
    return options.refine && !options.single && !options.internal_friction;
  }
  [[nodiscard]] std::filesystem::path target_detections() const {
    return out / "target-detections.json";
  }
  [[nodiscard]] std::filesystem::path calibration() const { return out / "calibration.json"; }
};

/// One call of a stage's program; `output` is the first of what it writes.
[[nodiscard]] Step step(const std::string& stage, const std::string& what,
                        std::vector<std::string> arguments, const std::filesystem::path& output,
                        double weight = 1);
[[nodiscard]] std::string threads_text(const Bench& bench);

[[nodiscard]] Group detect_group(const Bench& bench);
/// Where the objects are, from their plates of tags. One after the other: each writes the scene
/// that the next one reads.
[[nodiscard]] Group object_group(const Bench& bench);
/// All cameras together where the rig has free poses of the target, else the paper's method.
[[nodiscard]] Group calib_group(const Bench& bench);
[[nodiscard]] Group triangulate_group(const Bench& bench);

[[nodiscard]] std::filesystem::path simulation_folder(const Drape& drape, int grid, int segments);
[[nodiscard]] Group simulate_group(const Bench& bench);
/// The drape that speaks for each scene on finer grids. A cloth with internal friction has a memory
/// that belongs to its grid.
[[nodiscard]] Group refine_group(const Bench& bench);
/// The sheet of the finest grid that came to rest, as far as the drape was refined.
[[nodiscard]] std::optional<std::filesystem::path> refined_sheet(
    const Bench& bench, const Drape& drape, const std::set<std::filesystem::path>& failed);
/// The equilibria that starts like the scene's come to, on at most 15 particles per side: beyond,
/// 32 drapes cost more than all other steps together.
[[nodiscard]] Group ensemble_group(const Bench& bench);
/// The sheets of its branches, as far as the ensemble was made and found any.
[[nodiscard]] std::vector<std::filesystem::path> branch_sheets(
    const Bench& bench, const Drape& drape, const std::set<std::filesystem::path>& failed);
/// What the total uncertainty needs: how each distance answers to fabric and scene values, on a
/// grid that is quick (21) with the headline's segments.
[[nodiscard]] Group sensitivity_group(const Bench& bench);

}  // namespace drape::plan
