// SPDX-License-Identifier: Apache-2.0
#include "core/sensitivity.hpp"

#include <algorithm>
#include <array>

#include "core/files/lattice_size.hpp"
#include "core/units.hpp"

namespace drape {

using units::mm;

/// Describes the moves, which are absent if the cloth did not come to rest.
static void fields(Fields& f, std::optional<MarkMoves>& moves) {
  std::optional<double> step = moves ? std::optional(moves->step) : std::nullopt;
  f.if_any(
      {"step", "change of the value: per cent for a fabric value, else in its unit", 1, above_zero},
      step);
  if (!step) return moves.reset();
  if (!moves) moves.emplace();
  moves->step = *step;
  f.if_any({"half_width", "half width of a stand-in's interval, in the unit of step"},
           moves->half_width);
  Eigen::MatrixXd down_m = moves->down_m, up_m = moves->up_m;
  f({"down_mm", "displacement of each mark if the value is lowered by the step", mm}, down_m);
  f({"up_mm", "displacement of each mark if the value is raised by the step", mm}, up_m);
  const char* each = "must have x, y, z for each entry of marks_at";
  f.limit(down_m.cols() == 3, "down_mm", each, make_again);
  f.limit(up_m.cols() == 3 && up_m.rows() == down_m.rows(), "up_mm", each, make_again);
  if (down_m.cols() != 3 || up_m.cols() != 3) return;
  moves->down_m = down_m;
  moves->up_m = up_m;
}

void fields(Fields& f, ValueEffect& effect) {
  f({"value", "name of the fabric value"}, effect.value);
  f({"mean_distance_mm_per_percent", "change of the mean distance", mm}, effect.change_m);
  f({"mean_way_of_marks_mm_per_percent", "mean displacement of the marks", mm}, effect.moved_m);
  fields(f, effect.moves);
}

void fields(Fields& f, SceneEffect& effect) {
  f({"value", "name of the scene's value"}, effect.value);
  f.if_any({"mean_distance_mm_per_unit", "change of the mean distance", mm},
           effect.change_m_per_unit);
  fields(f, effect.moves);
  f.if_any({"absent", "reason why there are no displacements"}, effect.absent);
}

void fields(Fields& f, VariantEffect& effect) {
  std::string from = effect.continued ? "base" : "start";
  f({"what", "changed part of the model"}, effect.what);
  f({"from", "base: started from the base's rest; start: from the scene's start"}, from);
  effect.continued = from == "base";
  f({"at_rest", "true if it came to rest"}, effect.at_rest);
  f({"mean_distance_mm", "mean distance of the marks", mm}, effect.distance_m);
  f({"change_mm", "change of the mean distance relative to the base", mm}, effect.change_m);
  f({"mean_way_of_marks_mm", "mean displacement of the marks", mm}, effect.moved_m);
}

void marks_at(Fields& f, std::vector<MarkId>& marks) {
  std::vector<std::array<int, 2>> places;
  for (const MarkId& mark : marks) places.push_back({mark.row, mark.col});
  f.if_any({"marks_at", "row and column of each mark", 1, 0, kMostMarks}, places);
  marks.clear();
  for (const auto& [row, col] : places) marks.push_back({row, col});
}

void fields(Fields& f, SensitivityFile& file) {
  f.if_any({"spacing_mm", "spacing of the base's finest mesh", mm, above_zero}, file.spacing_m);
  f.if_any({"rows", "particles along the warp, if the base is a grid"}, file.rows);
  f.if_any({"cols", "particles along the weft, if the base is a grid"}, file.cols);
  f.otherwise({"segments", "segments of each curve"}, file.segments);
  f.otherwise({"model", "cloth model"}, file.model);
  f.otherwise({"status", "status of the base: \"at rest\", or the reason why not"}, file.status);
  f({"marks", "number of marks of the mean", 1, 0}, file.marks);
  marks_at(f, file.marks_at);
  f.if_any({"no_go", "cause of the NO-GO of the reference or the start"}, file.no_go);
  f({"mean_distance_mm", "mean distance of the base", mm}, file.distance_m);
  std::optional<std::vector<ValueEffect>> values;
  if (!file.values.empty()) values = file.values;
  f({"sensitivities", "effects of fabric values; null if the base has no first-order response"},
    values);
  file.values = values.value_or(std::vector<ValueEffect>());
  f.if_any({"scene_sensitivities", "effects of the scene's values"}, file.scene);
  f.if_any({"variants", "the same drape with one part of the model changed"}, file.variants);
  const auto one_row_each = [&](const auto& effects) {
    return std::all_of(effects.begin(), effects.end(), [&](const auto& effect) {
      return !effect.moves ||
             effect.moves->down_m.rows() == static_cast<Eigen::Index>(file.marks_at.size());
    });
  };
  f.rule(one_row_each(file.values) && one_row_each(file.scene), "marks_at",
         "does not have one entry for each row of down_mm and up_mm", make_again);
}

}  // namespace drape
