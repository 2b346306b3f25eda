// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <map>
#include <set>
#include <system_error>

#include "core/files/picture_head.hpp"
#include "core/program/similar.hpp"
#include "front/check/check.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

/// Key of a file that refers to a set.
struct Need {
  std::string set;
  Where where;
};

std::vector<Need> needs_of(const Rig& rig, const std::vector<Scene>& scenes) {
  std::vector<Need> needs;
  const auto add = [&](const std::string& set, const Document& file, const std::string& path) {
    needs.push_back({set, file.where(path)});
  };
  for (std::size_t i = 0; i < rig.stages.size(); ++i)
    add(rig.stages[i].set, rig.document, fmt::format("calibration.stage.{}.set", i));
  for (const std::string& pose : rig.free_poses) add(pose, rig.document, "calibration.free_poses");
  for (const Scene& scene : scenes) {
    if (!scene.set.empty()) add(scene.set, scene.document, "set");
    for (const ObjectTags& plate : scene.tags)
      add(plate.set, scene.document, fmt::format("object.{}.tags_set", plate.object - 1));
  }
  // The scene's own laying is required by the scene.
  const auto is_own = [&](const DrapeRepeat& repeat) {
    return std::any_of(scenes.begin(), scenes.end(), [&](const Scene& scene) {
      return scene.name == repeat.scene && scene.set == repeat.set;
    });
  };
  for (std::size_t i = 0; i < rig.repeats.size(); ++i)
    if (!is_own(rig.repeats[i]))
      add(rig.repeats[i].set, rig.document, fmt::format("repeat.{}.set", i));
  return needs;
}

void check_frame(const RecordedFrame& frame, const RigCamera& camera, const Rig& rig,
                 std::map<std::string, bool>& named, BenchCheck& check) {
  if (camera.width_px < 2 || camera.height_px < 2) return;  // reported when it was read
  if (frame.width_px == camera.width_px && frame.height_px == camera.height_px) return;
  if (std::exchange(named[camera.name], true)) return;
  check.problems.push_back(bad_input(
      fmt::format("the rig says {} x {} px, the pictures are {} x {} px", camera.width_px,
                  camera.height_px, frame.width_px, frame.height_px),
      [&] {
        Where where =
            rig.document.where(fmt::format("camera.{}.width_px", &camera - rig.cameras.data()));
        where.camera = camera.name;
        return where;
      }(),
      fmt::format("width_px = {}, height_px = {}", frame.width_px, frame.height_px)));
}

/// Finds a listed picture that is missing, or whose first bytes show that it is not a picture. Its
/// hash is only checked when it is read.
void check_file(const fs::path& folder, const FrameSet& set, const RecordedFrame& frame,
                BenchCheck& check) {
  const fs::path file = folder / frame.file;
  const Where where{.file = file.string(), .camera = frame.camera, .set = set.name};
  std::error_code failed;
  if (!fs::is_regular_file(file, failed)) {
    std::string others;
    if (fs::is_directory(file.parent_path(), failed))
      for (const auto& entry : fs::directory_iterator(file.parent_path(), failed))
        if (entry.is_regular_file(failed) && entry.path().extension() == file.extension())
          others += (others.empty() ? "" : ", ") + entry.path().filename().string();
    check.problems.push_back(bad_input(
        "a picture of the recording is missing", where,
        others.empty()
            ? std::string("bring it back, or record the set again")
            : fmt::format("bring it back, or give it its name again; there are {}", others)));
    return;
  }
  std::array<char, 132> begin{};
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    check.problems.push_back(
        bad_input("the picture cannot be read: " + std::generic_category().message(errno), where,
                  "make it readable for this user"));
    return;
  }
  stream.read(begin.data(), begin.size());
  const auto count = static_cast<std::size_t>(stream.gcount());
  if (!begins_as_picture({reinterpret_cast<const unsigned char*>(begin.data()), count}))
    check.problems.push_back(
        bad_input(count == 0 ? "the picture is empty" : "this is no picture file", where,
                  "bring the recorded picture back, or record the set again"));
}

/// Finds recorded cameras that the rig does not list, whose pictures are unused.
void advise_on_cameras(const Recording& recording, const Rig& rig, BenchCheck& check) {
  std::set<std::string> others;
  for (const FrameSet& set : recording.sets)
    for (const RecordedFrame& frame : set.frames) others.insert(frame.camera);
  for (const RigCamera& camera : rig.cameras) others.erase(camera.name);
  if (others.empty()) return;
  check.advice.push_back(
      fmt::format("{}: no [[camera]] is called {}; the recording's pictures of it are not used",
                  rig.file.string(), fmt::join(others, ", ")));
}

/// Finds the same picture under two names: a copied camera or set.
void check_twice(const Recording& recording, const std::vector<Need>& needs, BenchCheck& check) {
  std::map<std::string, std::pair<std::string, std::string>> seen;
  for (const FrameSet& set : recording.sets) {
    const bool needed = std::any_of(needs.begin(), needs.end(),
                                    [&](const Need& need) { return need.set == set.name; });
    if (!needed) continue;
    for (const RecordedFrame& frame : set.frames) {
      const auto [other, fresh] = seen.emplace(frame.sha256, std::pair{set.name, frame.camera});
      if (fresh) continue;
      check.problems.push_back(bad_input(
          fmt::format("this picture is also the one of camera `{}` in set `{}`, byte for byte",
                      other->second.second, other->second.first),
          {.file = (recording.folder / frame.file).string(),
           .camera = frame.camera,
           .set = set.name},
          "no two pictures of cameras are equal: one of the two was copied; record or import it "
          "again"));
    }
  }
}

}  // namespace

void check_recording(const Recording& recording, const Rig& rig, const std::vector<Scene>& scenes,
                     BenchCheck& check) {
  std::vector<std::string> names;
  for (const FrameSet& set : recording.sets) names.push_back(set.name);
  const std::string list = (recording.folder / "recording.json").string();
  const std::vector<Need> needs = needs_of(rig, scenes);
  std::map<std::string, bool> sizes_named, cameras_named;
  for (const Need& need : needs) {
    const auto set = std::find_if(recording.sets.begin(), recording.sets.end(),
                                  [&](const FrameSet& one) { return one.name == need.set; });
    if (set == recording.sets.end()) {
      check.problems.push_back(bad_input(
          fmt::format("the recording has no set `{}`{}", need.set, did_you_mean(need.set, names)),
          need.where, fmt::format("{} has {}", list, fmt::join(names, ", "))));
      continue;
    }
    if (set->no_go)
      check.problems.push_back(bad_input(fmt::format("the set is NO-GO: {}", *set->no_go),
                                         {.file = list, .set = need.set},
                                         "record the set again, and name the new one"));
    for (const RigCamera& camera : rig.cameras) {
      const auto frame =
          std::find_if(set->frames.begin(), set->frames.end(),
                       [&](const RecordedFrame& one) { return one.camera == camera.name; });
      if (frame != set->frames.end()) {
        check_frame(*frame, camera, rig, sizes_named, check);
        check_file(recording.folder, *set, *frame, check);
      } else if (!std::exchange(cameras_named[camera.name], true)) {
        std::vector<std::string> cameras;
        for (const RecordedFrame& one : set->frames) cameras.push_back(one.camera);
        check.problems.push_back(bad_input(
            fmt::format("a camera of the rig is missing in the recording{}",
                        did_you_mean(camera.name, cameras)),
            {.file = list, .camera = camera.name, .set = need.set},
            "record the set with all cameras, or correct or remove the camera in rig.toml"));
      }
    }
  }
  advise_on_cameras(recording, rig, check);
  check_twice(recording, needs, check);
}

}  // namespace drape
