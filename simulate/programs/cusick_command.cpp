// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "core/parallel.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/cusick_files.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

namespace {

int run_cusick(const CusickArguments& arguments, std::vector<std::string> words,
               const CommonOptions& common) {
  check(arguments);
  const auto list = arguments.out / "cusick.json";
  RunRecord record("drape-simulate", std::move(words), run_record_path(list));
  const Fabric fabric = read_fabric(arguments.fabric);
  for (const auto& file : fabric.files()) record.input(file);
  SimulateReport report;
  ClothLaws laws = make_laws(fabric, 5, report);
  if (arguments.internal_friction) add_internal_friction(fabric, 5, laws, report);
  std::vector<JudgedDrape> drapes(static_cast<std::size_t>(arguments.starts));
  parallel_for(drapes.size(), thread_count(common), [&](std::size_t i) {
    drapes[i] = judged_drape(laws, options_of(arguments, static_cast<unsigned>(i + 1)));
  });
  Ending ending = write_cusick(arguments, fabric.name, drapes, record);
  ending.warnings.insert(ending.warnings.begin(), report.warnings.begin(), report.warnings.end());
  return finish(ending, common, record);
}

}  // namespace

int cusick_command(int argc, char** argv) {
  Command app("Drapes a round specimen of a fabric, held between two discs, from many starts.",
              "drape-simulate cusick");
  CommonOptions common;
  CusickArguments a;
  add_common_options(app, common);
  app.add_option("FABRIC", a.fabric, "fabric.toml")->required();
  app.add_option("--out", a.out, "folder for start-NN.ply and cusick.json")->required();
  app.add_option("--starts", a.starts, "random starts")->range(1, 99)->capture_default_str();
  app.add_option("--disc-mm", a.disc_mm, "diameter")->positive()->capture_default_str();
  app.add_option("--specimen-mm", a.specimen_mm, "diameter")->positive()->capture_default_str();
  app.add_option("--spacing-mm", a.spacing_mm, "of the mesh; a third of it at the discs' rim")
      ->positive()
      ->capture_default_str();
  app.add_option("--warp-deg", a.warp_deg, "the mesh turned against the warp")
      ->capture_default_str();
  app.add_option("--lowering-steps", a.lowering_steps,
                 "of the table on which the specimen lies at first; 1: let go at once; without "
                 "--internal-friction")
      ->range(1, 1000)
      ->capture_default_str();
  app.add_option("--lowering-s", a.lowering_s,
                 "in which the table goes down, the cloth in motion; 0: let go at once; with "
                 "--internal-friction")
      ->range(0, 10)
      ->capture_default_str();
  app.add_option("--step-ms", a.step_ms, "of that motion: at each, internal friction settles")
      ->range(0.1, 20)
      ->capture_default_str();
  app.add_option(
         "--laid-coarser", a.laid_coarser,
         "spacing of the mesh on which it is laid, in spacings; 1: the mesh itself, as where the "
         "ring would have less than six")
      ->positive()
      ->capture_default_str();
  app.add_flag("--internal-friction", a.internal_friction,
               "use both branches of the bending and shear loops");
  app.add_option("--shakes", a.shakes, "times that gravity goes up and down before the last rest")
      ->range(0, 20)
      ->capture_default_str();
  app.add_option("--shake-percent", a.shake_percent, "of gravity")
      ->range(0, 100)
      ->capture_default_str();
  app.add_option("--max-steps", a.most_steps, "of descent, at each load")
      ->positive()
      ->capture_default_str();
  return run_program(app, argc, argv, common,
                     [&] { return run_cusick(a, arguments_of(argc, argv), common); });
}

}  // namespace drape::simulate
