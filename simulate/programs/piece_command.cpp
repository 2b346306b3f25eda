// SPDX-License-Identifier: Apache-2.0
#include "core/fields/fields.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"
#include "simulate/objects/scene_files.hpp"
#include "simulate/drape/outline.hpp"
#include "simulate/programs/commands.hpp"
#include "simulate/programs/piece_files.hpp"
#include "simulate/programs/run_inputs.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

namespace fs = std::filesystem;
using units::mm;

namespace {

struct PieceArguments : PieceOptions {
  fs::path scene, out;
  std::optional<fs::path> outline, fabric, start;
  int segments = SimulateOptions{}.segments;
  bool internal_friction = false;
};

void fields(Fields& f, PieceArguments& a) {
  f(drape::Field{"scene", "scene.toml: objects, table, pins, start"}.called("SCENE"), a.scene);
  f({"out", "folder for piece.ply, piece.toml, piece.json"}, a.out);
  f({"outline",
     "SVG (x along the weft, y along the warp, size in mm) or CSV (ring,warp_mm,weft_mm) in the "
     "frame of the print's patch; default: all of it"},
    a.outline);
  f({"fabric", "fabric.toml; default: the scene's"}, a.fabric);
  f({"start_from", "measured sheet.ply that places start and pins"}, a.start);
  f.otherwise({"spacing_mm", "of the mesh", mm, above_zero}, a.spacing_m);
  f.otherwise({"segments", "line segments per Kawabata curve"}, a.segments);
  f.otherwise({"seed", "of the mesh's jitter: another one for another start", 1, 0, 1000000},
              a.seed);
  f.otherwise({"internal_friction", "use both branches of the loops"}, a.internal_friction);
  f.otherwise({"step_ms", "of the fall: at each, friction settles", 1e-3, 0.1, 20},
              a.motion.step_s);
  f.otherwise({"thickness_mm", "distance of layers that else cross; 0: none", mm, 0, 10},
              a.cloth_thickness_m);
  f.otherwise({"max_steps", "of the descents after it", 1, 1}, a.descent.most_steps);
}

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
  ClothOutline outline = outline_of(print);
  if (arguments.outline) outline = read_outline(*arguments.outline, arguments.spacing_m);
  SimulateReport fits;
  const auto reach = find_reach(scene, fabric, print, measured);
  ClothLaws laws = make_laws(fabric, arguments.segments, fits, reach);
  if (arguments.internal_friction)
    add_internal_friction(fabric, arguments.segments, laws, fits, reach);
  const PieceDrape piece = drape_piece(scene, print, measured, laws, std::move(outline), arguments);
  std::optional<MeshJudgement> judgement;
  if (piece.report.at_rest) judgement = judge_piece(piece, scene, laws, arguments.descent.residual);
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
  app.add_record(a);
  return run_program(app, argc, argv, common,
                     [&] { return run_piece(a, arguments_of(argc, argv), common); });
}

}  // namespace drape::simulate
