// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/error_split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "core/files/files.hpp"
#include "core/files/lattice_size.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr std::size_t kFabricFiles = 7;  // the fabric's own, two curves each of three kinds

/// Place of the greatest change among the variants at rest.
std::optional<std::size_t> greatest(const std::vector<VariantEffect>& variants) {
  std::optional<std::size_t> best;
  for (std::size_t k = 0; k < variants.size(); ++k) {
    if (!variants[k].at_rest) continue;
    if (!best || std::abs(variants[k].change_m) > std::abs(variants[*best].change_m)) best = k;
  }
  return best;
}

std::string from_text(const VariantEffect& variant) {
  return variant.continued ? "the drape" : "the start";
}

bool holds(const HashedFiles& inputs, const std::string& sha256) {
  return std::any_of(inputs.begin(), inputs.end(),
                     [&](const auto& input) { return input.second == sha256; });
}

/// A sheet states the hash of its fabric's files together, which a record lists side by side.
bool hold_fabric(const HashedFiles& inputs, const std::string& sha256) {
  for (std::size_t first = 0; first < inputs.size(); ++first) {
    std::string all;
    for (std::size_t i = first; i < std::min(inputs.size(), first + kFabricFiles); ++i) {
      all += inputs[i].second + "\n";
      if (sha256_of(std::string_view(all)) == sha256) return true;
    }
  }
  return false;
}

}  // namespace

std::optional<std::string> other_origin(const HashedFiles& inputs, const DrapeInput& drape) {
  if (!holds(inputs, drape.measured.sha256)) return "was not made from the sheet as it is now";
  const Simulation* first = drape.speaker();
  if (first == nullptr || first->other_simulator) return std::nullopt;
  const SimulatedSource& source = first->source();
  for (const auto& [is_it, what] : {std::pair(holds(inputs, source.scene_sha256), "scene"),
                                    std::pair(hold_fabric(inputs, source.fabric_sha256), "fabric")})
    if (!is_it)
      return fmt::format("was not made from the {} that was simulated ({})", what, first->label());
  return std::nullopt;
}

std::optional<std::string> other_base(const ErrorSplitFile& split, const DrapeInput& drape) {
  if (split.rows == 0) return "does not say of which grid it is";
  for (const Simulation& simulation : drape.simulations) {
    if (simulation.other_simulator || simulation.branch) continue;
    const Sheet& sheet = simulation.sheet.sheet;
    if (sheet.rows == split.rows && sheet.cols == split.cols &&
        simulation.source().segments == split.segments && simulation.source().model == split.model)
      return std::nullopt;
  }
  return fmt::format("is of {}x{}, {} segment{} ({}), which is not compared", split.rows,
                     split.cols, split.segments, split.segments == 1 ? "" : "s", split.model);
}

/// Absent where the cloth did not come to rest.
static void fields(Fields& f, std::optional<MarkMoves>& moves) {
  std::optional<double> step = moves ? std::optional(moves->step) : std::nullopt;
  f.if_any({"step", "per cent of a fabric value, else in the value's unit", 1, above_zero}, step);
  if (!step) return moves.reset();
  if (!moves) moves.emplace();
  moves->step = *step;
  f.if_any({"half_width", "bound of a stand-in's error, as step"}, moves->half_width);
  Eigen::MatrixXd down_m = moves->down_m, up_m = moves->up_m;
  f({"down_mm", "displacement of each mark for a value lower by the step", mm}, down_m);
  f({"up_mm", "displacement of each mark for a value higher by the step", mm}, up_m);
  const char* each = "must have x, y, z for each entry of marks_at";
  f.limit(down_m.cols() == 3, "down_mm", each, make_again);
  f.limit(up_m.cols() == 3 && up_m.rows() == down_m.rows(), "up_mm", each, make_again);
  if (down_m.cols() != 3 || up_m.cols() != 3) return;
  moves->down_m = down_m;
  moves->up_m = up_m;
}

static void fields(Fields& f, ValueEffect& effect) {
  f({"value", "name of the fabric value"}, effect.value);
  f({"mean_distance_mm_per_percent", "change of the mean distance", mm}, effect.change_m);
  f({"mean_way_of_marks_mm_per_percent", "mean displacement of the marks", mm}, effect.moved_m);
  fields(f, effect.moves);
}

static void fields(Fields& f, SceneEffect& effect) {
  f({"value", "name of the scene's value"}, effect.value);
  f({"mean_distance_mm_per_unit", "change of the mean distance", mm}, effect.change_m_per_unit);
  fields(f, effect.moves);
}

static void fields(Fields& f, VariantEffect& effect) {
  std::string from = effect.continued ? "base" : "start";
  f({"what", "changed part of the model"}, effect.what);
  f({"from", "base: the base's equilibrium; start: the scene's start"}, from);
  effect.continued = from == "base";
  f({"at_rest", "whether it came to rest"}, effect.at_rest);
  f({"mean_distance_mm", "mean distance of the marks", mm}, effect.distance_m);
  f({"change_mm", "change of it against the base", mm}, effect.change_m);
  f({"mean_way_of_marks_mm", "mean displacement of the marks", mm}, effect.moved_m);
  f({"hem_folds", "folds of the hem"}, effect.folds);
}

void fields(Fields& f, ErrorSplitFile& split) {
  f.otherwise({"rows", "particles of the base along the warp"}, split.rows);
  f.otherwise({"cols", "particles of the base along the weft"}, split.cols);
  f.otherwise({"segments", "segments of each curve"}, split.segments);
  f.otherwise({"model", "cloth model"}, split.model);
  f({"marks", "marks of the mean", 1, 0}, split.marks);
  std::vector<std::array<int, 2>> places;
  for (const MarkId& mark : split.marks_at) places.push_back({mark.row, mark.col});
  f.if_any({"marks_at", "row and column of each mark", 1, 0, kMostMarks}, places);
  split.marks_at.clear();
  for (const auto& [row, col] : places) split.marks_at.push_back({row, col});
  f.if_any({"no_go", "cause of the NO-GO of the reference or the start"}, split.no_go);
  f({"mean_distance_mm", "mean distance of the base", mm}, split.distance_m);
  std::optional<std::vector<ValueEffect>> values;
  if (!split.values.empty()) values = split.values;
  f({"sensitivities", "effects of fabric values; null: none to first order"}, values);
  split.values = values.value_or(std::vector<ValueEffect>());
  f.if_any({"scene_sensitivities", "effects of the scene's values"}, split.scene);
  f.if_any({"variants", "the same drape with one part of the model changed"}, split.variants);
  const auto one_row_each = [&](const auto& effects) {
    return std::all_of(effects.begin(), effects.end(), [&](const auto& effect) {
      return !effect.moves ||
             effect.moves->down_m.rows() == static_cast<Eigen::Index>(places.size());
    });
  };
  f.rule(one_row_each(split.values) && one_row_each(split.scene), "marks_at",
         "does not have one entry for each row of down_mm and up_mm", make_again);
}

Table value_effect_table(const ErrorSplitFile& split) {
  Table table;
  table.title = "One per cent more of a fabric value, to first order";
  table.names = {"value", "change_mm_per_percent", "marks_move_mm_per_percent"};
  table.headings = {"fabric value", "mean dist changes (mm per %)", "marks move (mm per %)"};
  table.numeric = {false, true, true};
  std::vector<ValueEffect> values = split.values;
  std::stable_sort(values.begin(), values.end(), [](const ValueEffect& a, const ValueEffect& b) {
    return std::abs(a.change_m) > std::abs(b.change_m);
  });
  for (const ValueEffect& one : values) {
    std::string name = one.value;
    std::replace(name.begin(), name.end(), '_', ' ');
    table.add(
        {name, fmt::format("{:+.4f}", one.change_m / mm), fmt::format("{:.4f}", one.moved_m / mm)});
  }
  return table;
}

Table variant_effect_table(const ErrorSplitFile& split) {
  Table table;
  table.title = "One part of the model changed";
  table.names = {"variant",       "from",      "mean_dist_mm", "change_mm",
                 "marks_move_mm", "hem_folds", "at_rest"};
  table.headings = {"changed",         "draped again from", "mean dist (mm)", "change (mm)",
                    "marks move (mm)", "folds of the hem",  "at rest"};
  table.numeric = {false, false, true, true, true, true, false};
  for (const VariantEffect& one : split.variants) {
    table.add({one.what, from_text(one), fmt::format("{:.3f}", one.distance_m / mm),
               fmt::format("{:+.3f}", one.change_m / mm), fmt::format("{:.3f}", one.moved_m / mm),
               std::to_string(one.folds), one.at_rest ? "yes" : "no"});
  }
  table.marked_row = greatest(split.variants);
  return table;
}

std::string error_split_sentence(const ErrorSplitFile& split) {
  const auto best = greatest(split.variants);
  if (!best) return {};
  const VariantEffect& one = split.variants[*best];
  return fmt::format(
      "of the changes, {} (draped again from {}) moves the mean distance most, by "
      "{:+.3f} mm from {:.3f} mm",
      one.what, from_text(one), one.change_m / mm, split.distance_m / mm);
}

}  // namespace drape::compare
