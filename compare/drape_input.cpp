// SPDX-License-Identifier: Apache-2.0
#include "compare/drape_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <tuple>
#include <variant>

#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

bool touches_a_mark(const std::string& key) {
  return !key.ends_with("_uncertainty_mm") && !key.ends_with(".on_stand") &&
         key.find(".tags_") == std::string::npos;
}

/// Value of a key; absent ones, such as a yaw or an edge radius, are 0.
std::string value_of(const Surroundings& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() || found->second.empty() ? "0" : found->second;
}

/// True if it is an input by path or content: a record may name a copy; files may change.
bool is_among(const fs::path& file, const std::vector<std::pair<fs::path, std::string>>& inputs) {
  const std::string sha256 = fs::is_regular_file(file) ? sha256_of_file(file) : std::string();
  return std::any_of(inputs.begin(), inputs.end(), [&](const auto& input) {
    return input.second == sha256 ||
           fs::weakly_canonical(input.first) == fs::weakly_canonical(file);
  });
}

constexpr std::size_t kShortHash = 8;  ///< characters that suffice for people to distinguish files

/// Options of a certificate that affect where a cloth rests; the others affect only the way to it.
constexpr std::array<const char*, 2> kRestOptions{"internal_friction", "cloth_thickness_mm"};
constexpr const char* kFit = "curves_fitted";

std::string hash_text(const std::string& sha256) {
  return sha256.empty() ? "none" : sha256.substr(0, kShortHash);
}

/// Formats the value of a setup for people.
std::string shown(const Simulation& simulation, const std::string& key, const std::string& value,
                  const std::vector<Simulation>& group) {
  if (key == "start") return hash_text(value);
  if (key == "scene")
    return simulation.scene
               ? fmt::format("{}_friction_{:g}", hash_text(value), simulation.scene->friction)
               : hash_text(value);
  if (key != "fabric") return value;
  const SimulatedSource& own = simulation.source();
  const bool ambiguous = std::any_of(group.begin(), group.end(), [&](const Simulation& other) {
    return other.source().fabric == own.fabric && other.source().fabric_sha256 != value;
  });
  return ambiguous ? own.fabric + " " + hash_text(value) : own.fabric;
}

/// False for branches, which have neither a certificate nor the start of the runs.
bool is_compared(const Simulation& simulation, const std::string& key) {
  if (simulation.other_simulator) return false;
  return !simulation.branch || key == "model" || key == "fabric" || key == "scene";
}

std::string stated_value(const Setup& setup, const std::string& key) {
  const auto found = setup.find(key);
  return found == setup.end() ? "not stated" : found->second;
}

}  // namespace

std::optional<SimulatedScene> read_simulated_scene(
    const fs::path& file, const std::vector<std::pair<fs::path, std::string>>& inputs) {
  // Read as it was used; today's rules apply where a scene is measured or simulated.
  const auto scene = read_record<Scene>(file);
  SimulatedScene simulated{scene.set, {}, scene.friction, is_among(scene.fabric_file, inputs)};
  bool are_meshes_known = true;
  simulated.surroundings = surroundings_of(scene, [&](const fs::path& mesh) {
    for (const auto& [input, sha256] : inputs)
      if (fs::weakly_canonical(input) == fs::weakly_canonical(mesh)) return sha256;
    are_meshes_known = false;
    return std::string();
  });
  return are_meshes_known ? std::optional(simulated) : std::nullopt;
}

std::optional<std::string> difference_of(const Surroundings& asked, const Surroundings& other,
                                         const std::string& in_other) {
  Surroundings all = asked;
  all.insert(other.begin(), other.end());
  for (const auto& [key, any] : all) {
    const std::string one = value_of(asked, key), its = value_of(other, key);
    if (!touches_a_mark(key) || one == its) continue;
    return fmt::format("{} is {} {}, {} for the marks", key, its, in_other, one);
  }
  return std::nullopt;
}

std::pair<bool, double> Simulation::fineness() const {
  return is_grid() ? std::pair(false, static_cast<double>(sheet.sheet.rows))
                   : std::pair(true, -*source().spacing_m);
}

std::string Simulation::run_label() const {
  if (other_simulator) return fmt::format("{}, {}", *other_simulator, discretisation());
  const int count = source().segments;
  return fmt::format("{}, {} segment{}{}", discretisation(), count, count == 1 ? "" : "s",
                     apart_text());
}

std::string Simulation::label() const {
  return branch ? fmt::format("{}, branch {}", run_label(), branch->number) : run_label();
}

std::string Simulation::apart_text() const {
  std::string text;
  for (const auto& [key, value] : apart) text += fmt::format(", {} {}", key, value);
  return text;
}

Setup Simulation::setup() const {
  const SimulatedSource& own = source();
  Setup setup{{"model", own.model},
              {"solver", own.solver},
              {"fabric", own.fabric_sha256},
              {"scene", own.scene_sha256},
              {"start", own.start_sha256.value_or(std::string())},
              {"from", own.from_measured ? "measured shape" : "scene"}};
  if (!certificate) return setup;
  // Certificates omit options that were not used.
  setup[kRestOptions.front()] = "no";
  setup[kFit] = "whole";
  for (const auto& [name, value] : certificate->entries) {
    for (const char* option : kRestOptions)
      if (name == std::string("options.") + option) setup[option] = value;
    if (name.starts_with("options.curves_fitted_up_to.")) setup[kFit] = "to_a_range";
  }
  return setup;
}

bool Simulation::is_of_cloth_of(const Simulation& other) const {
  const SimulatedSource &own = source(), &its = other.source();
  return own.model == its.model && own.fabric_sha256 == its.fabric_sha256 &&
         own.scene_sha256 == its.scene_sha256;
}

void tell_apart(std::vector<Simulation>& simulations) {
  // An option that a model lacks does not distinguish its simulations.
  std::map<std::string, std::set<std::string>> models, values;
  for (const Simulation& one : simulations)
    for (const auto& [key, value] : one.setup()) models[key].insert(one.source().model);
  const auto is_told = [&](const Simulation& one, const std::string& key) {
    return is_compared(one, key) && models[key].contains(one.source().model);
  };
  for (const auto& [key, known] : models)
    for (const Simulation& one : simulations)
      if (is_told(one, key)) values[key].insert(stated_value(one.setup(), key));
  for (Simulation& one : simulations) {
    const Setup setup = one.setup();
    for (const auto& [key, seen] : values)
      if (seen.size() > 1 && is_told(one, key))
        one.apart.emplace_back(key, shown(one, key, stated_value(setup, key), simulations));
  }
}

std::string DrapeInput::name() const {
  if (!simulations.empty()) return simulations.front().source().scene;
  if (!surfaces.empty()) return surfaces.front().scene;
  if (scene) return scene->name;
  return measured.asked ? measured.asked->name : measured.measured().set;
}

bool DrapeInput::speaks_before(const Simulation& one, const Simulation& other) const {
  constexpr int kSegments = 5;  // largest number in the paper
  const auto is_of_own_fabric = [&](const Simulation& simulation) {
    return std::any_of(simulations.begin(), simulations.end(), [&](const Simulation& known) {
      return known.scene && known.scene->own_fabric &&
             known.source().fabric_sha256 == simulation.source().fabric_sha256;
    });
  };
  const auto rank = [&](const Simulation& s) {
    const int count = s.segments().value_or(0);
    return std::tuple(!s.other_simulator, !s.branch,
                      measured.asked && measured.asked->sha256 == s.source().scene_sha256,
                      is_of_own_fabric(s), !s.source().from_measured, s.fineness(),
                      count == kSegments, count);
  };
  const auto names = [](const Simulation& s) {
    return std::tuple(s.source().model, s.source().fabric, s.setup(),
                      s.branch ? s.branch->set_sha256 : std::string(), s.sheet.sha256);
  };
  const auto first = rank(one), second = rank(other);
  return first != second ? first > second : names(one) < names(other);
}

const Simulation* DrapeInput::speaker() const {
  const auto first = std::min_element(
      simulations.begin(), simulations.end(),
      [this](const Simulation& a, const Simulation& b) { return speaks_before(a, b); });
  return first == simulations.end() ? nullptr : &*first;
}

const Simulation* DrapeInput::speaking_branch() const {
  const Simulation* chosen = nullptr;
  for (const Simulation& one : simulations)
    if (one.branch && one.is_of_cloth_of(*speaker()) &&
        (chosen == nullptr || speaks_before(one, *chosen)))
      chosen = &one;
  return chosen;
}

}  // namespace drape::compare
