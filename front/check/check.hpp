// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/program/program.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"

namespace drape {

/// Everything missing or wrong in the files of a bench, found in one reading before any work.
struct BenchCheck {
  std::vector<Error> problems;        ///< each with file, line or field, why and what to do
  std::vector<std::string> warnings;  ///< odd, but possible
  std::vector<std::string> advice;    ///< what makes the result worth more
  int files = 0;                      ///< that were read
  std::string purpose = "a run";      ///< what the files are to serve
};

/// Reads rig, target, prints, scenes, fabrics and the recording's list. `recording` may be empty:
/// the rig's. Of a folder with scenes and no rig.toml, a virtual bench, scenes, prints and fabrics
/// alone. Never throws for what a file holds.
[[nodiscard]] BenchCheck check_bench(const std::filesystem::path& rig,
                                     const std::filesystem::path& recording);

/// `drape check`: prints what check_bench() found; returns the exit code.
[[nodiscard]] int report_check(const BenchCheck& check, const std::string& program,
                               const CommonOptions& common);

/// The place of a key ("object.z_bottom_mm") in a TOML file: its line in the `nth` table of that
/// name (from 0), or that of the table where the key is not there.
[[nodiscard]] Where place_of(const std::filesystem::path& file, const std::string& field,
                             std::size_t nth = 0);

/// Whether a drape's folder would stand where `drape run` and the console write under names of
/// their own.
[[nodiscard]] bool is_name_of_a_run(const std::string& drape);

/// No cloth is photographed farther from the target than a room is long.
inline constexpr double kLargestBench_m = 10;

/// Adds a problem at that place.
void add(BenchCheck& check, const std::filesystem::path& file, const std::string& field,
         const std::string& what, const std::string& what_to_do, std::size_t nth = 0);

/// Numbers of a scene that no bench has, and objects that are not where a table can carry them.
/// `print` may lack.
void check_scene(const Scene& scene, const Rig& rig, const Print* print, BenchCheck& check);

/// What an uncertainty wider than the object's own half says: nobody knows where it is, and no
/// guard can contradict it. The same of how its plate of tags lies on it.
void check_uncertainty(const Scene& scene, std::size_t index, BenchCheck& check);

/// A clamp holds a line of the cloth along warp or weft, about as long as in space.
void check_clamps(const Scene& scene, const Print* print, BenchCheck& check);
/// A pin holds a mark or a point of the cloth, not one beside it, and two pins not more cloth than
/// there is between them.
void check_pins(const Scene& scene, const Print* print, BenchCheck& check);

/// Objects that are meshes, through `drape simulate`, the reader that the simulation uses.
void check_meshes(const Scene& scene, BenchCheck& check);

/// The tag families that detect knows, and how many tags each has.
[[nodiscard]] std::vector<std::pair<std::string, int>> known_tag_families();

/// Tags of a family that is not known, two of one id, and tags that would lie over a dot.
void check_target(const std::filesystem::path& file, const Target& target, BenchCheck& check);
void check_print(const Print& print, BenchCheck& check);

/// Names in `stand_ins` of a scene or fabric that no value of the file has. Throws Error for what
/// cannot be read.
void check_stand_ins(const std::filesystem::path& file, const std::string& schema,
                     BenchCheck& check);

/// Names and ends of a fabric's curves; its numbers and curves through `drape fabric`, the reader
/// that the simulation uses, with each of these numbers of segments.
void check_fabric(const std::filesystem::path& file, const std::vector<int>& segments,
                  BenchCheck& check);

/// Sets and cameras that the rig and its scenes need, image sizes, pictures that are not there or
/// stand there twice.
void check_recording(const Recording& recording, const Rig& rig, const std::vector<Scene>& scenes,
                     BenchCheck& check);

/// Repeats of scenes that are not there, and sets or names that stand there twice.
void check_repeats(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check);

}  // namespace drape
