// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/sheet_file.hpp"

#include "compare/records/provenance.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

std::string SheetFile::scene() const {
  if (const auto* simulated = std::get_if<SimulatedSource>(&sheet.source)) return simulated->scene;
  return repeat ? repeat->scene : asked ? asked->name : std::string();
}

const MeasuredSource& SheetFile::measured() const {
  return std::get<MeasuredSource>(sheet.source);
}

bool SheetFile::has_content(const std::string& hash) const {
  return hash == sha256 || hash == ply_sha256;
}

SheetFile read_sheet_file(const fs::path& file) {
  require_as_recorded(file);
  const fs::path json = fs::path(file).replace_extension(".json");
  SheetFile read{file, {}, {}, read_sheet(file)};
  read.sha256 = sha256_of_file(json);
  read.ply_sha256 = sha256_of_file(fs::path(file).replace_extension(".ply"));
  if (!read.sheet.is_measured()) return read;
  const JsonNode source = JsonNode::open(json, "sheet", 1).at("source");
  if (source.has("repeat")) {
    const JsonNode id = source.at("repeat");
    read.repeat = RepeatId{id.name("scene"), id.name("repeat"), id.text("face")};
  }
  if (source.has("asked_scene")) {
    const JsonNode asked = source.at("asked_scene");
    read.asked = AskedScene{asked.name("name"), asked.text("sha256"), {}};
    const JsonNode values = asked.at("surroundings");
    for (const auto& [key, value] : values.members())
      read.asked->surroundings[key] = values.text(key);
  }
  return read;
}

}  // namespace drape::compare
