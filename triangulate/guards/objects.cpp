// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/body.hpp"
#include "core/units.hpp"
#include "triangulate/guards/guards.hpp"
#include "triangulate/guards/mesh_gaps.hpp"
#include "triangulate/guards/object_fit.hpp"
#include "triangulate/guards/suggest.hpp"
#include "triangulate/guards/taut.hpp"

namespace drape::triangulate {
namespace {

using units::mm;

std::string text_of(const Against& found) {
  std::string text;
  if (found.inside > 0)
    text = fmt::format("{} mark{} inside it, ({}, {}) by {:.2f} mm", found.inside,
                       found.inside == 1 ? " lies" : "s lie", found.deepest->mark.row,
                       found.deepest->mark.col, found.depth_m / mm);
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  if (found.shortest != nullptr) {
    const auto& [from, to, cloth_m, sd_m] = *found.shortest;
    add(
        fmt::format("the cloth between ({}, {}) and ({}, {}), {:.1f} mm, is {:.2f} mm too short to "
                    "pass outside it",
                    from->mark.row, from->mark.col, to->mark.row, to->mark.col, cloth_m / mm,
                    found.shortfall_m / mm));
  }
  return text;
}

std::string suggestion_text(const SeenCloth& seen, const Scene& scene, std::size_t object) {
  const ObjectSuggestion found = suggested_object(seen, scene, object);
  return found.one ? "the marks speak for " + found.one->text : found.why_not;
}

}  // namespace

std::vector<std::string> contradictions_of_objects(const SeenCloth& seen, const Scene& scene) {
  std::vector<std::string> found;
  const std::string file = scene.file.string();
  const Sheet& sheet = seen.sheet;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const Obstacle& object = scene.obstacles[i];
    const ObjectUncertainty stated = scene.uncertainty_of(i);
    if (const auto* mesh = std::get_if<MeshObject>(&object)) {
      const std::string why = contradiction_of_mesh(sheet, seen.mesh_gaps_m.at(i), *mesh, stated);
      if (!why.empty()) found.push_back(fmt::format("{}, object {}: {}", file, i + 1, why));
      continue;
    }
    if (!is_contradicted(seen, object, stated)) continue;
    found.push_back(fmt::format(
        "{}, object {}: {}; no object within its uncertainties (place {:.2f} mm, size {:.2f} mm, "
        "chi square below {:.1f}, its top lower by at most {:.2f} mm) would do; {}",
        file, i + 1, text_of(against(seen, object)), stated.place_m() / mm, stated.size_m() / mm,
        chi2_limit(object), most_lowered_m(object, stated) / mm, suggestion_text(seen, scene, i)));
  }
  if (const auto above = untouched(seen, scene)) {
    found.push_back(fmt::format(
        "{}, object {}: no mark touches it, the nearest lies {:.2f} mm above, and cloth that "
        "rests on it at most {:.2f} mm; {}",
        file, above->object + 1, above->nearest_m / mm, above->allowed_m / mm,
        suggestion_text(seen, scene, above->object)));
  }
  if (const SheetMark* lowest = below_table(sheet, scene, scene.table_z_m))
    found.push_back(fmt::format(
        "{}: table_z_mm = {:g}, but mark ({}, {}) lies {:.2f} mm below it; the table is at {:.1f} "
        "or lower",
        file, scene.table_z_m / mm, lowest->mark.row, lowest->mark.col,
        (scene.table_z_m - lowest->point_in_world.z()) / mm, lowest->point_in_world.z() / mm));
  return found;
}

std::vector<std::string> contradictions_of_support(const SeenCloth& seen, const Scene& scene) {
  const auto block = floating(seen, scene);
  if (!block) return {};
  Scene other = scene;
  other.table_z_m = std::round(block->z_m / (0.1 * mm)) * 0.1 * mm;
  const bool is_table =
      below_table(seen.sheet, scene, other.table_z_m) == nullptr && !floating(seen, other);
  const auto [row, col] = block->first;
  return {fmt::format(
      "{}, {}: the marks ({}, {}) to ({}, {}) lie level to {:.2f} mm at z = {:.1f} mm, as cloth "
      "does on a support alone, and table and objects as stated lie {:.1f} mm too low for that; {}",
      scene.file.string(),
      is_table ? fmt::format("table_z_mm = {:g}", scene.table_z_m / mm) : "object", row, col,
      row + 2, col + 2, block->range_m / mm, block->z_m / mm, block->spare_m / mm,
      is_table ? fmt::format("the marks speak for table_z_mm = {:.1f}", other.table_z_m / mm)
               : "measure the heights again, or add the object that is missing")};
}

}  // namespace drape::triangulate
