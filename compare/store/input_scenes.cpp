// SPDX-License-Identifier: Apache-2.0
#include "compare/store/inputs.hpp"

#include <fmt/format.h>

#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

bool is_unchanged(const fs::path& file, const std::string& sha256) {
  return fs::is_regular_file(file) && sha256_of_file(file) == sha256;
}

void take_scene(DrapeFiles& drape, const fs::path& file, const std::string& sha256,
                Session& session) {
  drape.input.scene = read_scene(file);
  session.read.emplace_back(file, sha256);
}

/// The scene file named by the run record, when it is still what the simulation read.
std::optional<fs::path> scene_file_of(const std::string& scene_sha256,
                                      const std::optional<MadeBy>& made_by) {
  if (!made_by) return std::nullopt;
  for (const auto& [file, sha256] : made_by->inputs)
    if (sha256 == scene_sha256 && is_unchanged(file, sha256)) return file;
  return std::nullopt;
}

/// Of a drape without simulations: the scene that its marks were held against, while it is as it
/// was.
void find_scene_of_marks(DrapeFiles& drape, Session& session) {
  if (!drape.measured_by) return;
  for (const auto& [file, sha256] : drape.measured_by->inputs)
    if (file.extension() == ".toml" && is_unchanged(file, sha256))
      return take_scene(drape, file, sha256, session);
}

}  // namespace

void find_scenes(DrapeFiles& drape, Session& session) {
  std::vector<Simulation>& simulations = drape.input.simulations;
  if (simulations.empty()) return find_scene_of_marks(drape, session);
  std::map<std::string, fs::path> files;  // by SHA-256
  for (std::size_t i = 0; i < simulations.size(); ++i) {
    const auto& made_by = drape.simulated_by[i];
    const auto file = scene_file_of(simulations[i].source().scene_sha256, made_by);
    if (!file) {
      if (made_by)
        session.warnings.push_back(
            fmt::format("the scene of the {}x{} simulation with {} segments is not as that read "
                        "it, so that the values of its scene and fabric are not stored",
                        simulations[i].sheet.sheet.rows, simulations[i].sheet.sheet.cols,
                        simulations[i].source().segments));
      continue;
    }
    simulations[i].scene = read_simulated_scene(*file, made_by->inputs);
    files.emplace(simulations[i].source().scene_sha256, *file);
  }
  const std::string& sha256 = drape.input.speaker()->source().scene_sha256;
  if (const auto own = files.find(sha256); own != files.end())
    take_scene(drape, own->second, sha256, session);
}

std::vector<std::string> moved_objects(const std::vector<fs::path>& layings,
                                       const std::vector<fs::path>& simulations) {
  std::optional<AskedScene> first;
  std::vector<std::string> reasons;
  const auto add = [&](const fs::path& sheet, const std::string& why) {
    reasons.push_back(fmt::format("{}: its object is not where that of {} was: {}", sheet.string(),
                                  layings.front().string(), why));
  };
  for (const fs::path& sheet : layings) {
    auto asked = read_asked_scene(fs::path(sheet).replace_extension(".json"));
    if (!asked) continue;
    if (!first) {
      first = std::move(asked);
    } else if (const auto why =
                   difference_of(first->surroundings, asked->surroundings, "in its scene")) {
      add(sheet, *why);
    }
  }
  if (!first) return reasons;
  for (const fs::path& sheet : simulations) {
    const Sheet read = read_sheet(sheet);
    const auto* source = std::get_if<SimulatedSource>(&read.source);
    if (source == nullptr || source->scene_sha256 == first->sha256) continue;
    const auto made_by = read_made_by(sheet);
    const auto file = scene_file_of(source->scene_sha256, made_by);
    const auto scene = file ? read_simulated_scene(*file, made_by->inputs) : std::nullopt;
    const auto why = scene ? difference_of(first->surroundings, scene->surroundings)
                           : std::optional<std::string>("its scene file is not there as simulated");
    if (why) add(sheet, *why);
  }
  return reasons;
}

void find_ensemble(DrapeFiles& drape) {
  const Simulation* one = drape.input.speaking_branch();
  if (one == nullptr) return;
  const fs::path list = one->sheet.file.parent_path() / ".." / "branches.json";
  const SheetFile& measured = drape.input.measured;
  const auto is_measured = [&](const std::string& sha256) {
    return sha256 == measured.sha256 || sha256 == measured.ply_sha256;
  };
  const auto& start = one->source().start_sha256;
  bool placed = start && is_measured(*start);
  if (const auto made_by = read_made_by(list))
    for (const auto& [file, sha256] : made_by->inputs) placed = placed || is_measured(sha256);
  if (placed) drape.input.ensemble = read_ensemble(list, one->branch->set_sha256);
}

}  // namespace drape::compare
