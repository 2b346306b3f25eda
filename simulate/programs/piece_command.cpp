// SPDX-License-Identifier: Apache-2.0
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"
#include "simulate/objects/scene_files.hpp"
#include "simulate/piece/outline.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/foundation.hpp"
#include "simulate/programs/piece_files.hpp"
#include "simulate/programs/run_inputs.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;
using units::mm;

namespace {

struct PieceArguments {
  fs::path scene, out;
  std::optional<fs::path> outline, fabric, start;
  double spacing_mm = PieceOptions{}.spacing_m / mm;
  double step_ms = PieceOptions{}.motion.step_s * 1e3;
  int segments = SimulateOptions{}.segments, most_steps = DescentOptions{}.most_steps;
  int seed = static_cast<int>(PieceOptions{}.seed);
  double thickness_mm = PieceOptions{}.cloth_thickness_m / mm;
  bool internal_friction = false;
};

int run_piece(const PieceArguments& arguments, std::vector<std::string> words,
              const CommonOptions& common) {
  StepFiles files{
      {arguments.out / "piece.ply", arguments.out / "piece.toml", arguments.out / "piece.json"},
      {}};
  if (arguments.start)
    files.inputs.push_back(fs::path(*arguments.start).replace_extension(".json"));
  if (arguments.outline) files.inputs.push_back(*arguments.outline);
  refuse_to_replace(arguments.scene, arguments.fabric, files);
  RunRecord record("drape-simulate", std::move(words), run_record_path(arguments.out / "piece.ply"),
                   {{}, files.inputs});
  auto [scene, fabric, print, measured] = read_checked(arguments.scene, arguments.fabric);
  for (const fs::path& file : files_of(scene, fabric)) record.input(file);
  if (arguments.start) measured = read_start_of(*arguments.start, scene, print);
  PieceOptions options;
  options.spacing_m = arguments.spacing_mm * mm;
  options.seed = static_cast<unsigned>(arguments.seed);
  options.motion.step_s = arguments.step_ms * 1e-3;
  options.descent.most_steps = arguments.most_steps;
  options.cloth_thickness_m = arguments.thickness_mm * mm;
  ClothOutline outline = outline_of(print);
  if (arguments.outline) outline = read_outline(*arguments.outline, options.spacing_m);
  SimulateReport fits;
  const auto reach = find_reach(scene, fabric, print, measured);
  ClothLaws laws = make_laws(fabric, arguments.segments, fits, reach);
  if (arguments.internal_friction)
    add_internal_friction(fabric, arguments.segments, laws, fits, reach);
  const PieceDrape piece = drape_piece(scene, print, measured, laws, std::move(outline), options);
  std::optional<MeshJudgement> judgement;
  if (piece.report.at_rest) judgement = judge_piece(piece, scene, laws, options.descent.residual);
  Ending ending =
      write_piece(arguments.out, {scene.name, fabric.name, print.patch_m, no_go_of(measured)},
                  piece, judgement, record);
  ending.warnings.insert(ending.warnings.begin(), fits.warnings.begin(), fits.warnings.end());
  return finish(ending, common, record);
}

}  // namespace

int piece_command(int argc, char** argv) {
  Command app("Drapes a piece of cloth of any outline over the objects of a scene.",
              "drape-simulate piece");
  CommonOptions common;
  PieceArguments a;
  add_common_options(app, common);
  app.add_option("SCENE", a.scene, "scene.toml: objects, table, pins, start")->required();
  app.add_option("--out", a.out, "folder for piece.ply, piece.toml, piece.json")->required();
  app.add_option("--outline", a.outline,
                 "SVG (x along the weft, y along the warp, size in mm) or CSV "
                 "(ring,warp_mm,weft_mm) in the frame of the print's patch; default: all of it");
  app.add_option("--fabric", a.fabric, "fabric.toml; default: the scene's");
  app.add_option("--start-from", a.start, "measured sheet.ply that places start and pins");
  app.add_option("--spacing-mm", a.spacing_mm, "of the mesh")->positive()->capture_default_str();
  app.add_option("--segments", a.segments, "line segments per Kawabata curve")
      ->capture_default_str();
  app.add_option("--seed", a.seed, "of the mesh's jitter: another one for another start")
      ->range(0, 1000000)
      ->capture_default_str();
  app.add_flag("--internal-friction", a.internal_friction, "use both branches of the loops");
  app.add_option("--step-ms", a.step_ms, "of the fall: at each, friction settles")
      ->range(0.1, 20)
      ->capture_default_str();
  app.add_option("--thickness-mm", a.thickness_mm, "distance of layers that else cross; 0: none")
      ->range(0, 10)
      ->capture_default_str();
  app.add_option("--max-steps", a.most_steps, "of the descents after it")
      ->positive()
      ->capture_default_str();
  return run_program(app, argc, argv, common,
                     [&] { return run_piece(a, arguments_of(argc, argv), common); });
}

}  // namespace drape::simulate
