// SPDX-License-Identifier: Apache-2.0
#include "compare/meshes/piece.hpp"

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

void read_record_of_piece(const fs::path& record, Simulation& simulation) {
  const JsonNode root = JsonNode::open(record, "run", 1);
  const auto file_of = [&](const JsonNode& item) {
    return (record.parent_path() / item.text("file")).lexically_normal();
  };
  for (const JsonNode& output : root.items("outputs")) {
    const fs::path file = file_of(output);
    if (fs::is_regular_file(file) && sha256_of_file(file) != output.text("sha256"))
      throw bad_input(
          "this file is not the one that its run wrote", {.file = file.string()},
          "run drape simulate piece again, or restore what " + record.string() + " lists");
  }
  std::vector<std::pair<fs::path, std::string>> inputs;
  for (const JsonNode& input : root.items("inputs"))
    inputs.emplace_back(file_of(input), input.text("sha256"));
  if (inputs.empty()) return;
  const auto& [scene, sha256] = inputs.front();  // the first file that the program reads
  std::get<SimulatedSource>(simulation.sheet.sheet.source).scene_sha256 = sha256;
  if (fs::is_regular_file(scene) && sha256_of_file(scene) == sha256)
    simulation.scene = read_simulated_scene(scene, inputs);
}

}  // namespace

bool is_piece(const fs::path& json) {
  return fs::is_regular_file(json) &&
         read_text(json).find("\"drapebench/piece/") != std::string::npos;
}

std::string status_of_piece(const JsonNode& piece) {
  if (piece.boolean("at_rest")) return "at rest";
  if (!piece.has("refusals") || piece.texts("refusals").empty()) return "not at rest";
  return "refused by the checker: " + piece.texts("refusals").front();
}

void read_piece_beside(const fs::path& description, Simulation& simulation) {
  fs::path file = description;
  file.replace_extension(".json");
  if (!is_piece(file)) return;
  const JsonNode piece = JsonNode::open(file, "piece", 1);
  simulation.piece = true;
  simulation.sheet.sheet.no_go = piece.optional_text("no_go");
  std::get<SimulatedSource>(simulation.sheet.sheet.source).status = status_of_piece(piece);
  if (const fs::path record = run_record_path(description); fs::is_regular_file(record))
    read_record_of_piece(record, simulation);
}

}  // namespace drape::compare
