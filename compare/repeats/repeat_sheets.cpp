// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/repeat_sheets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "compare/records/provenance.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

const SimulatedSource* simulated(const RepeatSheet& sheet) {
  return std::get_if<SimulatedSource>(&sheet.named.sheet.source);
}

bool placed_by(const RepeatSheet& simulation, const RepeatSheet& laying) {
  const SimulatedSource* source = simulated(simulation);
  return source != nullptr && source->start_sha256 &&
         (*source->start_sha256 == laying.sha256 || *source->start_sha256 == laying.ply_sha256);
}

[[noreturn]] void refuse(const RepeatSheet& sheet, const std::string& what,
                         const std::string& field) {
  throw bad_input(what, {.file = sheet.named.name, .field = field},
                  "give layings and simulations of one drape");
}

/// A simulation among the layings would narrow or widen what real ones allow.
void require_kinds(const std::vector<RepeatSheet>& repeats,
                   const std::vector<RepeatSheet>& virtual_sheets) {
  for (const RepeatSheet& sheet : repeats)
    if (!sheet.named.sheet.is_measured())
      throw bad_input("a simulation is no laying of the real cloth",
                      {.file = sheet.named.name, .field = "source"},
                      "give measured sheets, and each simulation after a --compare of its own");
  for (const RepeatSheet& sheet : virtual_sheets)
    if (sheet.named.sheet.is_measured())
      throw bad_input("a measured sheet is no simulation to be judged",
                      {.file = sheet.named.name, .field = "source"},
                      "give it among the layings, without --compare");
}

void require_same_bench(const RepeatSheet& sheet, const RepeatSheet& first) {
  const Sheet &one = sheet.named.sheet, &other = first.named.sheet;
  if ((one.patch_m - other.patch_m).norm() > 0.01 * mm)
    refuse(sheet, "it is another patch than " + first.named.name, "patch_mm");
  if (!one.is_measured() || !other.is_measured()) return;
  if (std::get<MeasuredSource>(one.source).calibration_sha256 !=
      std::get<MeasuredSource>(other.source).calibration_sha256)
    refuse(sheet, "it was measured with another calibration than " + first.named.name,
           "source.calibration_sha256");
  if (sheet.face != first.face)
    refuse(sheet, "another face of the cloth lies up than in " + first.named.name,
           "source.repeat.face");
}

}  // namespace

RepeatSheet read_repeat_sheet(const std::filesystem::path& file) {
  std::filesystem::path json = file, ply = file;
  json.replace_extension(".json");
  ply.replace_extension(".ply");
  require_as_recorded(json);
  RepeatSheet sheet{
      {file.string(), read_sheet(file)}, {}, {}, sha256_of_file(json), sha256_of_file(ply)};
  if (!sheet.named.sheet.is_measured()) {
    sheet.scene = simulated(sheet)->scene;
    return sheet;
  }
  const JsonNode source = JsonNode::open(json, "sheet", 1).at("source");
  if (source.has("repeat")) {
    sheet.scene = source.at("repeat").name("scene");
    sheet.face = source.at("repeat").text("face");
  } else if (source.has("asked_scene")) {
    sheet.scene = source.at("asked_scene").text("name");
  }
  return sheet;
}

void require_one_drape(const std::vector<RepeatSheet>& repeats,
                       const std::vector<RepeatSheet>& virtual_sheets) {
  require_kinds(repeats, virtual_sheets);
  std::map<std::string, std::string> seen;
  for (const RepeatSheet& sheet : repeats)
    if (const auto [other, is_new] = seen.emplace(sheet.ply_sha256, sheet.named.name); !is_new)
      refuse(sheet, "it is a copy of " + other->second + ", which is no repeat", "marks");
  const RepeatSheet* first = nullptr;
  const auto require_scene = [&](const RepeatSheet& sheet, const std::string& scene) {
    if (first == nullptr) first = &sheet;
    if (scene != first->scene)
      refuse(sheet,
             fmt::format("it is of scene `{}`, {} is of scene `{}`", scene, first->named.name,
                         *first->scene),
             "source");
  };
  for (const auto* sheets : {&repeats, &virtual_sheets}) {
    for (const RepeatSheet& sheet : *sheets) {
      if (sheet.scene) require_scene(sheet, *sheet.scene);
      require_same_bench(sheet, repeats.front());
    }
  }
  for (const auto* sheets : {&repeats, &virtual_sheets}) {
    for (const RepeatSheet& sheet : *sheets) {
      const bool placed = std::any_of(virtual_sheets.begin(), virtual_sheets.end(),
                                      [&](const auto& one) { return placed_by(one, sheet); });
      if (!sheet.scene && !placed)
        throw bad_input("the sheet does not say which drape it is a laying of",
                        {.file = sheet.named.name, .field = "source.repeat"},
                        "name it by a [[repeat]] of the rig, or measure it with drape triangulate "
                        "--repeat NAME --scene FILE");
    }
  }
}

std::vector<std::string> no_go_of(const std::vector<RepeatSheet>& sheets) {
  std::vector<std::string> reasons;
  for (const RepeatSheet& sheet : sheets) {
    const SimulatedSource* source = simulated(sheet);
    if (sheet.named.sheet.no_go)
      reasons.push_back(fmt::format("{}: {}", sheet.named.name, *sheet.named.sheet.no_go));
    else if (source != nullptr && source->status != "at rest")
      reasons.push_back(
          fmt::format("{}: the simulation is not at rest: {}", sheet.named.name, source->status));
  }
  return reasons;
}

}  // namespace drape::compare
