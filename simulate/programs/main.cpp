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
#include "simulate/checker/certify.hpp"
#include "simulate/earlier_sheets.hpp"
#include "simulate/ensemble/checked.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/run_inputs.hpp"
#include "simulate/simulate.hpp"
#include "simulate/start/start_file.hpp"
#include "simulate/study/study.hpp"

namespace drape::simulate {

using units::mm;

namespace {

/// The last lines of drape-simulate: NO-GO when the cloth did not come to rest.
Ending ending_of(const SimulateResult& result, const std::filesystem::path& out) {
  const SimulateReport& report = result.report;
  Ending ending;
  ending.go = report.status == RestStatus::at_rest;
  ending.verdict =
      fmt::format("{}x{} particles {} after {:.2f} s of motion ({} steps)", result.sheet.rows,
                  result.sheet.cols, report.sentence, report.time_s, report.steps);
  ending = resting_on(result.sheet.no_go, std::move(ending));
  ending.numbers = {
      {"largest residual force", fmt::format("{:.2g} of a particle's weight", report.residual)},
      {"strain warp, weft",
       fmt::format("{:.2f} to {:.2f} %, {:.2f} to {:.2f} %", 1e2 * report.strains.warp_least,
                   1e2 * report.strains.warp_most, 1e2 * report.strains.weft_least,
                   1e2 * report.strains.weft_most)},
      {"deepest between particles", fmt::format("{:.3f} mm", report.deepest_between_m / mm)},
      {"particles touching", fmt::format("{}", report.contacts)}};
  if (report.check) {
    ending.numbers.emplace_back(
        "independent check",
        report.check->accepted
            ? fmt::format("accepted, {:.2g} of a particle's weight left", report.check->residual)
            : "refused");
  }
  if (report.drape_coefficient) {
    ending.numbers.emplace_back("drape coefficient",
                                fmt::format("{:.1f} %", 1e2 * *report.drape_coefficient));
  }
  ending.warnings = report.warnings;
  if (report.check) ending.rejected = report.check->refused;
  ending.next_command = fmt::format(
      "drape-compare MEASURED.ply {} --calibration FILE --store results.sqlite --report "
      "report.html",
      shell_word((out / "sheet.ply").string()));
  return ending;
}

/// Reads a scene's objects; what can be none, such as a mesh in another unit, is an Error.
Ending objects_read(const std::filesystem::path& scene) {
  if (scene.empty()) throw usage_error("SCENE is missing", "give a scene.toml");
  const Surroundings around(read_scene(scene));
  Ending ending;
  ending.verdict = fmt::format("table and objects are read, {} together", around.count());
  return ending;
}

/// Throws Error(usage) when one of the two is missing.
void require_scene_and_out(const std::filesystem::path& scene, const std::filesystem::path& out) {
  if (scene.empty() || out.empty()) throw usage_error("SCENE or --out is missing", "give both");
}

struct SimulateArguments : RunArguments {
  double thickness_mm = 0.5;
  bool check_objects = false;
};

int run_simulate(SimulateArguments& args, std::vector<std::string> words,
                 const CommonOptions& common) {
  if (args.check_objects) return finish(objects_read(args.scene), common);
  require_scene_and_out(args.scene, args.out);
  refuse_to_replace(args.scene, args.fabric, {sheet_files(args.out), start_inputs(args)});
  RunRecord record("drape-simulate", std::move(words), run_record_path(args.out / "sheet.ply"),
                   {{}, start_inputs(args)});
  const RunInputs inputs = read_run_inputs(args, record);
  args.options.cloth_thickness_m = args.thickness_mm * 1e-3;
  args.options.threads = thread_count(common);
  Progress progress("simulate", common.quiet);
  args.options.progress = [&](double fraction, double residual) {
    progress.update(fraction, fmt::format("residual {:.2g} of a particle's weight", residual));
  };
  SimulateResult result =
      simulate_checked(inputs.scene, inputs.fabric, inputs.print, inputs.measured, args.options);
  if (args.start) {
    std::get<SimulatedSource>(result.sheet.source).start_sha256 = start_sha256(*args.start);
    result.sheet.no_go = inputs.measured->no_go;
  }
  write_outputs(args.out, result, args.options, record);
  return finish(ending_of(result, args.out), common, record);
}

}  // namespace

int simulate_command(int argc, char** argv) {
  Command app("Drapes a fabric over the objects of a scene until it rests.", "drape-simulate");
  CommonOptions common;
  add_common_options(app, common);
  SimulateArguments args;
  args.options.solver = Solver::fall;
  add_run_options(app, args, "folder for sheet, history.csv, certificate.json");
  app.add_flag("--check-objects", args.check_objects, "read the scene's objects, and stop");
  add_names(app, "--model", args.options.model, "springs of the cloth");
  add_names(app, "--solver", args.options.solver,
            "fall: motion, then Newton's method; static: Newton only; rk4: motion only, taken by "
            "itself with --model paper, --round and --no-kinetic-damping");
  app.add_choice<MassRule>("--mass", args.options.mass,
                           {{"area", MassRule::area}, {"paper", MassRule::paper}},
                           "area: each particle's own cloth; paper: total / particles");
  app.add_option("--tolerance", args.options.residual_tolerance,
                 "rest by rk4: largest residual force over a particle's weight; at most 0.001")
      ->capture_default_str();
  app.add_option("--static-tolerance", args.options.static_tolerance,
                 "the same for --solver fall and static")
      ->capture_default_str();
  app.add_option("--max-steps", args.options.max_steps, "step limit")->capture_default_str();
  app.add_option("--damping-per-s", args.options.damping_per_s, "beta/m")->capture_default_str();
  app.add_option("--natural-time-s", args.options.natural_time_s,
                 "motion before kinetic damping sets in")
      ->capture_default_str();
  app.add_flag("!--no-kinetic-damping", args.options.kinetic_damping, "damping forces only");
  app.add_option("--thickness-mm", args.thickness_mm,
                 "layers of cloth keep this apart; 0: the sheet passes through itself")
      ->capture_default_str();
  app.add_flag("--round", args.options.round,
               "cut the specimen to the disc in the patch (Cusick's drapemeter)");
  app.add_flag(
      "--internal-friction", args.options.internal_friction,
      "use both branches of the bending and shear loops: the cloth remembers, also the scene's "
      "start.history");
  app.add_flag("!--particles-only", args.options.contact_between_particles,
               "no contact between the particles");
  return run_program(app, argc, argv, common, [&] {
    if (app.count("--solver") == 0 && args.options.only_moves()) args.options.solver = Solver::rk4;
    return run_simulate(args, arguments_of(argc, argv), common);
  });
}

}  // namespace drape::simulate

int main(int argc, char** argv) {
  using namespace drape::simulate;
  return drape::run_stage(
      argc, argv, simulate_command,
      {{"study", study_command,
        "drapes every scene of a rig with several grids, segments and models"},
       {"branches", branches_command, "the equilibria that starts like the scene's come to"},
       {"sensitivity", sensitivity_command, "what each fabric value and part of the model moves"},
       {"refine", refine_command, "carries a rest to finer grids and states what the grid leaves"},
       {"certify", certify_command, "judges a simulation with code of its own"},
       {"fabric", fabric_command, "checks, shows, lists and imports fabrics"},
       {"cusick", cusick_command, "drapes a round specimen between two discs"},
       {"piece", piece_command, "drapes a piece of any outline"}});
}
