// SPDX-License-Identifier: Apache-2.0
#include "core/levels.hpp"

#include <fmt/format.h>

#include "core/units.hpp"

namespace drape {

using units::mm;

void fields(Fields& f, DrapeLevelRecord& level) {
  f({"spacing_mm", "spacing of the mesh", mm, above_zero}, level.spacing_m);
  f({"points", "points of the mesh", 1, 3}, level.points);
  f({"at_rest", "true if at rest"}, level.at_rest);
  f({"status", "\"at rest\", or the reason why not"}, level.status);
  f({"steps", "number of steps to rest", 1, 0}, level.steps);
  f({"mean_distance_from_coarser_mm",
     "mean displacement of the marks from the coarser mesh; null for the coarsest", mm, 0},
    level.from_coarser_m);
}

void fields(Fields& f, LevelMark& one) {
  f({"row", "mark along the warp", 1, 0}, one.mark.row);
  f({"col", "mark along the weft", 1, 0}, one.mark.col);
  f({"place_mm", "position in the world on the finest mesh", mm}, one.place_in_world);
  f({"mesh_error_mm", "largest distance from the limit of infinite refinement", mm, 0}, one.left_m);
  f.if_any({"from_coarser_mm", "displacement from the next coarser mesh", mm}, one.from_coarser_m);
}

void fields(Fields& f, LevelsFile& file) {
  f({"sheet_sha256", "SHA-256 of the sheet.json beside it"}, file.sheet_sha256);
  f({"levels", "meshes from coarse to fine"}, file.levels);
  f({"mean_mesh_error_mm", "mean over the marks; null if not at rest or with a single level", mm,
     0},
    file.left_m);
  f({"marks", "marks of the print on the finest mesh"}, file.marks);
  f.rule(!file.levels.empty(), "levels", "names no mesh", make_again);
  f.rule(!file.left_m || !file.marks.empty(), "marks", "names no mark", make_again);
}

std::string mesh_error_sentence(const LevelsFile& file) {
  const DrapeLevelRecord& finest = file.levels.back();
  if (!finest.at_rest)
    return fmt::format("mesh error not known: the mesh of {:g} mm is not at rest ({})",
                       finest.spacing_m / mm, finest.status);
  if (!file.left_m)
    return fmt::format("mesh error not known: one mesh alone; `--spacing-mm {:g}` adds a finer one",
                       finest.spacing_m / mm / 2);
  return fmt::format(
      "mesh error up to {:.3f} mm in the mean of the marks; `--spacing-mm {:g}` lowers it",
      *file.left_m / mm, finest.spacing_m / mm / 2);
}

}  // namespace drape
