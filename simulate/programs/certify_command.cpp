// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/objects/scene_files.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

void check_same_files(CertifyReport& report, const Sheet& sheet, const Scene& scene,
                      const Fabric& fabric) {
  const auto* source = std::get_if<SimulatedSource>(&sheet.source);
  if (source == nullptr) return;
  if (source->scene_sha256 != scene.document.sha256())
    report.refusals.emplace_back("the sheet was simulated from another content of the scene file");
  if (source->fabric_sha256 != fabric_sha256(fabric))
    report.refusals.emplace_back("the sheet was simulated from another content of the fabric");
}

int run_certify(const fs::path& folder, const fs::path& scene_file,
                const std::optional<fs::path>& fabric_file, std::vector<std::string> words,
                const CommonOptions& common) {
  if (folder.empty() || scene_file.empty())
    throw usage_error("FOLDER or --scene is missing",
                      "give the folder of a simulation and its scene.toml");
  RunRecord record("drape-simulate", std::move(words), folder / "certify.run.json");
  const Sheet sheet = read_sheet(folder / "sheet.ply");
  const Scene scene = read_scene(scene_file);
  const Fabric fabric = read_fabric(fabric_file.value_or(scene.fabric_file));
  const CertificateClaim claim = read_claim(folder);
  CertifyReport report = certify(sheet, scene, fabric, read_print(scene.print_file), claim);
  check_same_files(report, sheet, scene, fabric);
  for (const fs::path& file : files_of(scene, fabric)) record.input(file);
  for (const char* name : {"sheet.ply", "sheet.json", "history.csv", "certificate.json"})
    record.input(folder / name);
  if (claim.memory) record.input(folder / "memory.csv");
  if (!claim.contact_forces.empty()) record.input(folder / "contact_forces.csv");
  Ending ending;
  ending.go = report.accepted();
  ending.verdict = ending.go ? (claim.at_rest ? "the certificate holds: the sheet can rest as it is"
                                              : "the numbers hold; no rest is claimed")
                             : "the certificate is refused";
  for (const CertifyLine& line : report.lines) {
    const std::string text = line.is_limit
                                 ? fmt::format("{:.6g}, at most {:.6g}", line.found, line.allowed)
                                 : fmt::format("{:.9g}, claimed {:.9g}", line.found, line.claimed);
    ending.numbers.emplace_back(line.what, text);
    if (!line.passes()) ending.rejected.push_back(line.what + ": " + text);
  }
  ending.rejected.insert(ending.rejected.end(), report.refusals.begin(), report.refusals.end());
  ending.warnings = report.warnings;
  ending.next_command = fmt::format("more {}", shell_word((folder / "certificate.json").string()));
  return finish(resting_on(sheet.no_go, std::move(ending)), common, record);
}

}  // namespace

int certify_command(int argc, char** argv) {
  Command app("Judges the certificate of a simulated sheet with code of its own.",
              "drape-simulate certify");
  CommonOptions common;
  add_common_options(app, common);
  fs::path folder, scene;
  std::optional<fs::path> fabric;
  app.add_option("FOLDER", folder, "with sheet.ply, history.csv and certificate.json");
  app.add_option("--scene", scene, "scene.toml that was simulated");
  app.add_option("--fabric", fabric, "fabric.toml; default: the scene's");
  return run_program(app, argc, argv, common, [&] {
    return run_certify(folder, scene, fabric, arguments_of(argc, argv), common);
  });
}

}  // namespace drape::simulate
