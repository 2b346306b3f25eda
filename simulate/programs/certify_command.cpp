// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/certify.hpp"

#include <fmt/format.h>

#include "core/fields/fields.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"
#include "simulate/start/start_file.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

struct CertifyArguments {
  fs::path folder, scene;
  std::optional<fs::path> fabric, start;
};

void fields(Fields& f, CertifyArguments& a) {
  f(drape::Field{"folder", "folder of a simulation: sheet.ply, cloth.ply, certificate.json"}.called(
        "FOLDER"),
    a.folder);
  f({"scene", "scene.toml that was simulated"}, a.scene);
  f({"fabric", "fabric.toml; default: the scene's"}, a.fabric);
  f({"start_from", "measured sheet.ply that gives the positions of pins that state none"}, a.start);
}

void require_same_files(CertifyReport& report, const Sheet& sheet, const Scene& scene,
                        const Fabric& fabric) {
  const auto* source = std::get_if<SimulatedSource>(&sheet.source);
  if (source == nullptr) return;
  if (source->scene_sha256 != scene.document.sha256())
    report.refusals.emplace_back("the sheet was simulated from another content of the scene file");
  if (source->fabric_sha256 != fabric_sha256(fabric))
    report.refusals.emplace_back("the sheet was simulated from another content of the fabric");
}

int run_certify(const CertifyArguments& arguments, std::vector<std::string> words,
                const CommonOptions& common) {
  RunRecord record("drape-simulate", std::move(words), arguments.folder / "certify.run.json");
  const RestFiles files = read_rest_files(arguments.folder);
  RunInputs inputs = read_checked(arguments.scene, arguments.fabric);
  if (arguments.start) {
    inputs.measured = read_start_of(*arguments.start, inputs.scene, inputs.print);
    for (const fs::path& file : start_files(*arguments.start)) record.input(file);
  }
  CertifyReport report = certify(files, inputs.scene, inputs.fabric, inputs.print, inputs.measured);
  require_same_files(report, files.sheet, inputs.scene, inputs.fabric);
  for (const fs::path& file : inputs.files()) record.input(file);
  for (const fs::path& file : files.files) record.input(file);
  Ending ending;
  ending.go = report.accepted();
  ending.verdict = !ending.go ? "the certificate is refused"
                   : files.certificate.at_rest
                       ? "the certificate holds: the cloth can rest as it is"
                       : "the numbers hold; no rest is claimed";
  for (const CertifyLine& line : report.lines) {
    const std::string text = line.is_limit
                                 ? fmt::format("{:.6g}, at most {:.6g}", line.found, line.allowed)
                                 : fmt::format("{:.9g}, claimed {:.9g}", line.found, line.claimed);
    ending.numbers.emplace_back(line.what, text);
    if (!line.passes()) ending.rejected.push_back(line.what + ": " + text);
  }
  ending.rejected.insert(ending.rejected.end(), report.refusals.begin(), report.refusals.end());
  ending.warnings = report.warnings;
  ending.next_command =
      fmt::format("more {}", shell_word((arguments.folder / "certificate.json").string()));
  return finish(resting_on(files.sheet.no_go, std::move(ending)), common, record);
}

}  // namespace

int certify_command(int argc, char** argv) {
  return run_command<CertifyArguments>(
      argc, argv, "drape-simulate certify",
      "Checks the stored cloth of a simulation with independent code.", run_certify);
}

}  // namespace drape::simulate
