// SPDX-License-Identifier: Apache-2.0
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/refine_run.hpp"

namespace drape::simulate {

int refine_command(int argc, char** argv) {
  Command app(
      "Carries a drape that rests over to finer grids and states what the grid leaves.\n\n"
      "  drape simulate refine out/C/simulations/31-5 --scene rigs/bench1/scenes/C.toml --out "
      "out/C/refined",
      "drape-simulate refine");
  CommonOptions common;
  add_common_options(app, common);
  RefineArguments args;
  app.add_option("FOLDER", args.folder, "of a simulation, with sheet.ply and certificate.json");
  app.add_option("--scene", args.scene, "scene.toml that was simulated");
  app.add_option("--fabric", args.fabric, "fabric.toml; default: the scene's");
  app.add_option("--start-from", args.start,
                 "measured sheet.ply or mesh.toml that placed the start and pins");
  app.add_option("--finest", args.how.finest, "particles along the longer side, at most")
      ->capture_default_str();
  app.add_option("--goal-mm", args.goal_mm,
                 "no finer grid is tried where this one leaves less, mean over the marks")
      ->capture_default_str();
  app.add_option("--out", args.out, "folder for refinement.json and NxN/sheet.ply");
  return run_program(app, argc, argv, common,
                     [&] { return run_refine(args, arguments_of(argc, argv), common); });
}

}  // namespace drape::simulate
