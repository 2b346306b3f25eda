// SPDX-License-Identifier: Apache-2.0
// Content of a set of the session: the target, an object's plate of tags, one laying of a cloth.
#include <fmt/format.h>

#include <algorithm>

#include "console/bench.hpp"
#include "core/error.hpp"

namespace drape::console {
namespace {

constexpr std::size_t kMostLayings = 100;

}  // namespace

/// Reads layings of rig.toml ([[repeat]]) and of the scenes (tags_set).
void Bench::read_layings() {
  for (const Drape& one : drapes_) {
    layings_.push_back({one.scene.name, one.scene.set, one.scene.set, {}});
    for (const ObjectTags& tags : one.scene.tags) as_read(tags.target);
  }
  for (const DrapeRepeat& repeat : rig_.repeats) {
    Laying found{repeat.scene, repeat.set, repeat.repeat, repeat.face, true};
    const auto own = std::find_if(layings_.begin(), layings_.end(),
                                  [&](const Laying& one) { return one.set == found.set; });
    own == layings_.end() ? layings_.push_back(std::move(found)) : void(*own = std::move(found));
  }
}

std::vector<Bench::Laying> Bench::layings(const std::string& drape) const {
  const std::lock_guard lock(mutex_);
  std::vector<Laying> some = layings_;
  if (!drape.empty()) std::erase_if(some, [&](const Laying& one) { return one.drape != drape; });
  return some;
}

std::string Bench::drape_of(const std::string& set) const {
  for (const Laying& one : layings())
    if (one.set == set) return one.drape;
  for (const Drape& one : drapes_)
    for (const ObjectTags& plate : one.scene.tags)
      if (plate.set == set) return one.scene.name;
  return {};
}

const ObjectTags* Bench::plate_of(const std::string& set) const {
  for (const Drape& one : drapes_)
    for (const ObjectTags& plate : one.scene.tags)
      if (plate.set == set) return &plate;
  return nullptr;
}

/// In the order in which a bench takes them: the objects' places first.
std::vector<std::string> Bench::sets_of(const Drape& drape) const {
  std::vector<std::string> sets;
  for (const ObjectTags& plate : drape.scene.tags) sets.push_back(plate.set);
  for (const Laying& one : layings(drape.scene.name)) sets.push_back(one.set);
  return sets;
}

bool Bench::is_target_set(const std::string& set) const {
  const std::vector<std::string> sets = target_sets();
  return std::find(sets.begin(), sets.end(), set) != sets.end();
}

std::vector<std::string> Bench::target_sets() const {
  std::vector<std::string> sets;
  for (const TargetStage& stage : rig_.stages) sets.push_back(stage.set);
  sets.insert(sets.end(), rig_.free_poses.begin(), rig_.free_poses.end());
  return sets;
}

bool Bench::is_taken(const std::string& set) const {
  const std::lock_guard lock(mutex_);
  const auto found = taken_.find(set);
  return found != taken_.end() && found->second;
}

bool Bench::is_left_out(const std::string& set) const {
  const std::lock_guard lock(mutex_);
  const auto found = taken_.find(set);
  return found != taken_.end() && !found->second;
}

std::vector<std::string> Bench::taken_target_sets() const {
  std::vector<std::string> sets = target_sets();
  std::erase_if(sets, [&](const std::string& set) { return !is_taken(set); });
  return sets;
}

/// Sets that a retake replaced: capture keeps them as <set>.take1, .take2, ...
std::vector<std::string> Bench::earlier_takes(const std::string& set) const {
  std::vector<std::string> sets;
  const auto all = recording();  // holds what is looked through
  for (const FrameSet& one : all->sets)
    if (one.name.starts_with(set + ".take")) sets.push_back(one.name);
  return sets;
}

const Bench::Drape& Bench::drape(const std::string& name) const {
  const auto found = std::find_if(drapes_.begin(), drapes_.end(),
                                  [&](const Drape& one) { return one.scene.name == name; });
  if (found == drapes_.end())
    throw bad_input("the rig has no such drape", {.field = name}, "reload the page");
  return *found;
}

void Bench::require_set(const std::string& set) const {
  if (drape_of(set).empty() && !is_target_set(set))
    throw bad_input("the rig has no such set", {.field = set}, "reload the page");
}

void Bench::lay(const std::string& name) {
  const Drape& one = drape(name);
  if (options_.replay)
    throw bad_input("a recording holds no further laying", {.field = name},
                    "name a set of it as [[repeat]] in rig.toml");
  const std::vector<Laying> known = layings(name);
  if (!is_taken(one.scene.set))
    throw bad_input("the first laying was not taken", {.set = one.scene.set}, "take it first");
  if (known.size() >= kMostLayings) throw bad_input("these are enough layings", {}, "run them");
  Laying next{name, {}, {}, known.back().face, true};
  for (std::size_t k = known.size() + 1; next.set.empty(); ++k) {
    const std::string set = fmt::format("{}_{}", one.scene.set, k);
    if (!drape_of(set).empty() || is_target_set(set)) continue;
    next.set = set;
    next.repeat = std::to_string(k);
  }
  log_.add(operator_name(), fmt::format("lays {} once more", name),
           {{"laying", next.set}, {"drape", name}, {"repeat", next.repeat}, {"face", next.face}});
  const std::lock_guard lock(mutex_);
  layings_.push_back(std::move(next));
}

/// Which side of the cloth lies up.
void Bench::name_face(const std::string& set, const std::string& face) {
  for (const Laying& one : layings())
    if (one.set == set && one.face == face) return;
  require_short_text(face);
  log_.add(operator_name(), fmt::format("{}: `{}` lies up", set, face),
           {{"face_of", set}, {"face", face}});
  const std::lock_guard lock(mutex_);
  for (Laying& one : layings_)
    if (one.set == set) {
      one.face = face;
      one.named = true;
    }
}

}  // namespace drape::console
