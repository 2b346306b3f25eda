// SPDX-License-Identifier: Apache-2.0
#include "core/refinement.hpp"

#include "core/units.hpp"

namespace drape {

using units::mm;

void fields(Fields& f, RefinedGrid& grid) {
  f({"rows", "particles along the warp", 1, 3}, grid.rows);
  f({"cols", "particles along the weft", 1, 3}, grid.cols);
  f({"sheet", "path from the folder of this file"}, grid.sheet);
  f({"sheet_sha256", "hash of its sheet.json"}, grid.sheet_sha256);
  f({"at_rest", "at rest and accepted by the checker"}, grid.at_rest);
  f({"status", "ending of the step"}, grid.status);
  f({"steps", "steps to rest", 1, 0}, grid.steps);
  f({"mean_distance_from_coarser_mm", "mean over the marks; null: the sheet is not whole", mm, 0},
    grid.from_coarser_m);
}

void fields(Fields& f, RefinedMark& one) {
  f({"row", "mark along the warp", 1, 0}, one.mark.row);
  f({"col", "mark along the weft", 1, 0}, one.mark.col);
  f({"place_mm", "place in the world, between the particles by cubics", mm}, one.place_in_world);
  f({"left_mm", "way to a grid without end; without an order at most so far", mm}, one.left_m);
}

void fields(Fields& f, RefinementFile& file) {
  f({"rest_sha256", "hash of sheet.json of the drape to begin with"}, file.rest_sha256);
  f({"finest_allowed", "particles along the longer side", 1, 5}, file.finest_allowed);
  f({"goal_mm", "no finer grid was tried where one leaves less", mm, above_zero}, file.goal_m);
  f({"grids", "grids from coarse to fine"}, file.grids);
  f({"used", "index of the finest grid at rest; null: none is", 1, 0}, file.used);
  f({"order", "order that three grids show; null: none of 1 to 3", 1, 1, 3}, file.order);
  f({"mean_left_mm", "mean over the marks of left_mm", mm, 0}, file.left_m);
  f({"sentence", "summary for people"}, file.sentence);
  f({"marks", "marks of the print on the grid used"}, file.marks);
  f.rule(!file.used || (file.left_m && static_cast<std::size_t>(*file.used) < file.grids.size()),
         "used", "is no grid of the list, or has no mean_left_mm", make_again);
}

}  // namespace drape
