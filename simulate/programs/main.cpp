// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/drape/outline.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"
#include "simulate/simulate.hpp"
#include "simulate/study/sensitivity.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;

namespace {

struct SimulateArguments : RunArguments {
  bool paper = false, check_objects = false, sensitivity = false;
  std::optional<int> grid;
  std::optional<fs::path> outline;
};

void fields(Fields& f, SimulateArguments& args) {
  fields(f, static_cast<RunArguments&>(args));
  mesh_fields(f, args.options.drape, true);
  f.otherwise({"from_measured", "start from the measured shape instead of the scene's start"},
              args.options.from_measured);
  f({"outline",
     "outline of the cloth: SVG (x along the weft, y along the warp, size in mm) or CSV "
     "(ring,warp_mm,weft_mm) in the frame of the print's patch; default: the whole patch"},
    args.outline);
  f.otherwise({"paper", "use the particle grid of the paper instead of the mesh"}, args.paper);
  f({"grid", "particles per side, with --paper (default: 21)", 1, 3, 401}, args.grid);
  fields(f, args.options.paper);
  f.otherwise({"sensitivity",
               "also write sensitivity.json: first-order displacement of each mark of --start-from "
               "with each value of fabric and scene at this rest"},
              args.sensitivity);
  f.otherwise({"check_objects", "only read and check the scene's objects"}, args.check_objects);
  f.rule(args.paper || !args.grid, "grid", "--grid belongs to --paper",
         "--spacing-mm says the finest mesh of the cloth");
  f.rule(!args.paper || (!args.outline && !args.options.from_measured), "paper",
         "--paper drapes the whole patch from the scene's start",
         "leave out --outline and --from-measured");
  f.rule(!args.sensitivity || (args.start && !args.paper && !args.options.internal_friction),
         "sensitivity", "--sensitivity measures a cloth without memory from a measured sheet",
         "give --start-from SHEET, and neither --paper nor --internal-friction");
  args.options.model = args.paper ? ClothModel::paper : ClothModel::triangles;
  if (args.grid) args.options.paper.rows = args.options.paper.cols = *args.grid;
}

std::vector<std::pair<std::string, std::string>> numbers_of(const Certificate& certificate) {
  std::vector<std::pair<std::string, std::string>> numbers;
  if (certificate.residual)
    numbers.emplace_back("largest residual force",
                         fmt::format("{:.2g} of a point's weight", *certificate.residual));
  if (const auto& strains = certificate.strains)
    numbers.emplace_back(
        "strain warp, weft",
        fmt::format("{:.2f} to {:.2f} %, {:.2f} to {:.2f} %", 1e2 * strains->warp.x(),
                    1e2 * strains->warp.y(), 1e2 * strains->weft.x(), 1e2 * strains->weft.y()));
  if (const auto& distances = certificate.distances)
    numbers.emplace_back("deepest in an object",
                         fmt::format("{:.3f} mm", distances->deepest_m / units::mm));
  if (const auto& check = certificate.check)
    numbers.emplace_back(
        "independent check",
        check->accepted ? fmt::format("accepted, {:.2g} of a point's weight left", check->residual)
                        : "refused");
  return numbers;
}

/// Ending of drape-simulate: NO-GO if the cloth did not come to rest.
Ending ending_of(const SimulateResult& result, const fs::path& out) {
  const Certificate& certificate = result.certificate;
  Ending ending;
  ending.go = certificate.at_rest;
  ending.verdict = certificate.status;
  ending = resting_on(result.sheet.no_go, std::move(ending));
  ending.numbers = numbers_of(certificate);
  if (result.levels) ending.numbers.emplace_back("mesh", mesh_error_sentence(*result.levels));
  ending.warnings = certificate.warnings;
  if (certificate.check) ending.rejected = certificate.check->refused;
  ending.next_command = fmt::format(
      "drape compare MEASURED.ply {} --calibration FILE --store results.sqlite --report "
      "report.html",
      shell_word((out / "sheet.ply").string()));
  return ending;
}

/// Reads a scene's objects; throws Error for an impossible one, such as a mesh in another unit.
Ending objects_read(const fs::path& scene) {
  if (scene.empty()) throw usage_error("SCENE is missing", "give a scene.toml");
  const Surroundings around(read_scene(scene));
  Ending ending;
  ending.verdict = fmt::format("table and objects are read, {} together", around.count());
  return ending;
}

int run_simulate(SimulateArguments args, std::vector<std::string> words,
                 const CommonOptions& common) {
  if (args.check_objects) return finish(objects_read(args.scene), common);
  RunInputs inputs = read_run_inputs(args, output_files(args.out));
  RunRecord record =
      record_of(args, inputs, std::move(words), run_record_path(args.out / "sheet.ply"));
  if (args.outline) {
    record.input(*args.outline);
    args.options.outline = read_outline(*args.outline, args.options.drape.spacing_m);
  }
  set_reach(args, inputs);
  Progress progress("simulate", common.quiet);
  args.options.progress = [&](double fraction) { progress.update(fraction, ""); };
  SimulateResult result =
      simulate(inputs.scene, inputs.fabric, inputs.print, inputs.measured, args.options);
  result.sheet.no_go = no_go_of(inputs.measured);
  write_outputs(args.out, result, record);
  if (args.sensitivity) {
    const fs::path written = args.out / kSensitivityName;
    write_record(written,
                 sensitivities_of(result, inputs.fabric, *inputs.measured, {args.options}));
    record.output(written);
  }
  return finish(ending_of(result, args.out), common, record);
}

}  // namespace

int simulate_command(int argc, char** argv) {
  return run_command<SimulateArguments>(
      argc, argv, "drape-simulate", "Drapes a fabric over the objects of a scene until it rests.",
      run_simulate,
      {{"--model", "--paper drapes the particle grid of the paper"},
       {"--solver", "there is one way to rest"},
       {"--round", "--outline cuts the cloth; drape simulate cusick is the drapemeter"}});
}

}  // namespace drape::simulate

int main(int argc, char** argv) {
  using namespace drape::simulate;
  return drape::run_stage(
      argc, argv, simulate_command,
      {{"study", study_command, "drapes every scene of a rig on several meshes or grids"},
       {"branches", branches_command, "finds the equilibria of a drape from many starts"},
       {"sensitivity", sensitivity_command,
        "computes the effects of fabric and scene values on a drape"},
       {"certify", certify_command, "checks a simulation with independent code"},
       {"fabric", fabric_command, "checks, shows, lists and imports fabrics"},
       {"cusick", cusick_command, "drapes a round specimen between two discs"}});
}
