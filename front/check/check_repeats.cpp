// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/program/similar.hpp"
#include "front/check/check.hpp"

namespace drape {
namespace {

/// Who uses which set: stages, free poses, scenes.
std::map<std::string, std::string> users_of(const Rig& rig, const std::vector<Scene>& scenes) {
  std::map<std::string, std::string> users;
  for (const TargetStage& stage : rig.stages) users[stage.set] = "a target stage";
  for (const std::string& pose : rig.free_poses) users[pose] = "a free pose";
  for (const Scene& scene : scenes) users[scene.set] = "scene " + scene.name;
  return users;
}

}  // namespace

void check_repeats(const Rig& rig, const std::vector<Scene>& scenes, BenchCheck& check) {
  std::size_t nth = 0;
  const auto refuse = [&](const std::string& field, const std::string& what,
                          const std::string& what_to_do) {
    add(check, rig.file, field, what, what_to_do, nth);
  };
  std::map<std::string, std::string> users = users_of(rig, scenes);
  std::map<std::pair<std::string, std::string>, std::string> names;
  std::vector<std::string> known;
  for (const Scene& scene : scenes) known.push_back(scene.name);
  const std::vector<DrapeRepeat>& repeats = rig.repeats;
  for (; nth < repeats.size(); ++nth) {
    const DrapeRepeat& one = repeats[nth];
    const std::string own = "scene " + one.scene;
    if (std::find(known.begin(), known.end(), one.scene) == known.end()) {
      refuse("repeat.scene",
             fmt::format("set `{}` repeats scene `{}`, which the rig does not name{}", one.set,
                         one.scene, did_you_mean(one.scene, known)),
             "give the `name` of one of its scenes");
      continue;
    }
    const auto [user, fresh] = users.emplace(one.set, "a repeat of " + own);
    if (!fresh && user->second != own)
      refuse("repeat.set", fmt::format("set `{}` is also the one of {}", one.set, user->second),
             "each laying of a cloth has a set of its own");
    if (!fresh) user->second = "a repeat of " + own;  // its own laying is named once
    const auto [other, first] = names.emplace(std::pair{one.scene, one.repeat}, one.set);
    if (!first)
      refuse("repeat.repeat",
             fmt::format("sets `{}` and `{}` are both repeat `{}` of scene {}", other->second,
                         one.set, one.repeat, one.scene),
             "give each laying its own name");
  }
}

}  // namespace drape
