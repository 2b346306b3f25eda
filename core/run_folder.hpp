// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"

namespace drape {

/// One laying of a drape's cloth.
struct Laying {
  std::string drape, set, repeat, face;
  bool is_own = true;  ///< the scene's own laying
  bool named = false;  ///< named in rig.toml or by the operator

  /// Name in messages: "A", or "A, repeat 2".
  [[nodiscard]] std::string name() const { return is_own ? drape : drape + ", repeat " + repeat; }
};

/// Layings of a scene, its own first.
[[nodiscard]] std::vector<Laying> layings_of(const Scene& scene, const Rig& rig);

/// Files that `drape run` writes to its output folder.
struct RunFolder {
  std::filesystem::path out;

  [[nodiscard]] std::filesystem::path target_detections() const {
    return out / "target-detections.json";
  }
  [[nodiscard]] std::filesystem::path calibration() const { return out / "calibration.json"; }
  [[nodiscard]] std::filesystem::path report() const { return out / "report.html"; }
  [[nodiscard]] std::filesystem::path store() const { return out / "results.sqlite"; }
  /// The part of the rig that detect and calib read.
  [[nodiscard]] std::filesystem::path rig() const { return out / "rig.toml"; }
  [[nodiscard]] std::filesystem::path folder(const Laying& laying) const {
    return laying.is_own ? out / laying.drape : out / laying.drape / "repeats" / laying.repeat;
  }
  [[nodiscard]] std::filesystem::path detections(const Laying& laying) const {
    return folder(laying) / "detections.json";
  }
  /// An object as located by its plate of tags; `what` is "-detections" for the tags.
  [[nodiscard]] std::filesystem::path object(const Scene& scene, int object,
                                             const std::string& what = {}) const {
    return out / scene.name / ("object_" + std::to_string(object) + what + ".json");
  }
  /// The scene with objects located by the first `plates` of its plates.
  [[nodiscard]] std::filesystem::path scene(const Scene& scene, std::size_t plates) const {
    return plates == 0 ? scene.file
                       : out / scene.name /
                             ("scene_" + std::to_string(scene.tags[plates - 1].object) + ".toml");
  }
};

/// Arguments of `drape object` for a plate of a scene of which `located` plates were located
/// before; the result goes to `files`.
[[nodiscard]] std::vector<std::string> object_arguments(const RunFolder& files, const Scene& scene,
                                                        const ObjectTags& plate,
                                                        std::size_t located,
                                                        const std::filesystem::path& detections,
                                                        const std::filesystem::path& calibration);

/// Text of a rig for a file in this folder: its paths are relative to the folder.
[[nodiscard]] std::string text_in(const std::filesystem::path& folder, Rig rig);

/// Writes a file unless it has this text already.
void write_where_new(const std::filesystem::path& file, const std::string& text);

}  // namespace drape
