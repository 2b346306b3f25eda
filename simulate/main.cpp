// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "core/files.hpp"
#include "core/program.hpp"
#include "core/progress.hpp"
#include "core/run_record.hpp"
#include "simulate/ending.hpp"
#include "simulate/study.hpp"

namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path scene, out;
  std::optional<fs::path> fabric, start;
  int grid = 21;
  std::string mass = "area";
  bool validate = false;
  drape::SimulateOptions options;
};

int run(Arguments& args, std::vector<std::string> words, const drape::CommonOptions& common) {
  if (args.validate) return drape::run_checks(common);
  drape::require_scene_and_out(args.scene, args.out);
  drape::RunRecord record("drape-simulate", std::move(words));
  const drape::Scene scene = drape::read_scene(args.scene);
  const drape::Fabric fabric = drape::read_fabric(args.fabric.value_or(scene.fabric_file));
  const drape::Print print = drape::read_print(scene.print_file);
  std::optional<drape::Sheet> measured;
  if (args.start) measured = drape::read_sheet(*args.start);
  record.input(args.scene);
  for (const fs::path& file : fabric.files()) record.input(file);
  record.input(scene.print_file);
  args.options.rows = args.options.cols = args.grid;
  args.options.mass =
      args.mass == "paper" ? drape::sim::MassRule::paper : drape::sim::MassRule::area;
  drape::Progress progress("simulate", common.quiet);
  args.options.progress = [&](double fraction, double residual) {
    progress.update(fraction, fmt::format("residual {:.2g} of a particle's weight", residual));
  };
  drape::SimulateResult result = drape::simulate(scene, fabric, print, measured, args.options);
  if (args.start) {
    const fs::path json = fs::path(*args.start).replace_extension(".json");
    record.input(json);
    std::get<drape::SimulatedSource>(result.sheet.source).start_sha256 =
        drape::sha256_of_file(json);
  }
  drape::write_outputs(args.out, result, args.options, record);
  const drape::Ending ending = drape::ending_of(result, args.out);
  record.write(drape::run_record_path(args.out / "sheet.ply"), ending.go ? 0 : 1);
  return finish(ending, common);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Drapes a fabric over the objects of a scene until it rests.", "drape-simulate");
  drape::CommonOptions common;
  add_common_options(app, common);
  Arguments args;
  app.add_option("SCENE", args.scene, "scene.toml: objects, table, pins, start");
  app.add_option("--fabric", args.fabric, "fabric.toml; default: the scene's");
  app.add_option("--grid", args.grid, "particles per side")->capture_default_str();
  app.add_option("--segments", args.options.segments, "line segments per Kawabata curve")
      ->capture_default_str();
  app.add_option("--start-from", args.start, "measured sheet.ply that places start and pins");
  app.add_option("--out", args.out, "folder for sheet, history.csv, certificate.json");
  app.add_flag("--validate", args.validate, "compare the model with closed forms, print a table");
  app.add_option("--model", args.options.model, "consistent, paper")->capture_default_str();
  app.add_option("--solver", args.options.solver, "rk4: motion until rest; static: Newton's method")
      ->check(CLI::IsMember({"rk4", "static"}))
      ->capture_default_str();
  app.add_option("--mass", args.mass, "area: each particle's own cloth; paper: total / particles")
      ->check(CLI::IsMember({"area", "paper"}))
      ->capture_default_str();
  app.add_option("--tolerance", args.options.residual_tolerance,
                 "rest: largest residual force over a particle's weight")
      ->capture_default_str();
  app.add_option("--static-tolerance", args.options.static_tolerance,
                 "the same for --solver static")
      ->capture_default_str();
  app.add_option("--max-steps", args.options.max_steps, "step limit")->capture_default_str();
  app.add_option("--damping-per-s", args.options.damping_per_s, "beta/m")->capture_default_str();
  app.add_option("--natural-time-s", args.options.natural_time_s,
                 "motion before kinetic damping sets in")
      ->capture_default_str();
  app.add_flag("!--no-kinetic-damping", args.options.kinetic_damping, "damping forces only");
  app.add_flag("!--particles-only", args.options.contact_between_particles,
               "no contact between the particles");
  return drape::run_program(app, argc, argv, common,
                            [&] { return run(args, drape::arguments_of(argc, argv), common); });
}
