// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/error_split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/files/files.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr std::size_t kFabricFiles = 7;  // the fabric file, and two curves of each of three kinds

/// Index of the largest change among the variants at rest.
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

/// True if the inputs contain the fabric: sheets hash its files jointly, records singly.
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

std::optional<std::string> other_base(const SensitivityFile& split, const DrapeInput& drape) {
  if (!split.spacing_m && !split.rows) return "does not say of which mesh it is";
  const Simulation& speaker = *drape.speaker();
  const SimulatedSource& source = speaker.source();
  const Sheet& sheet = speaker.sheet.sheet;
  const bool same_cloth =
      split.spacing_m && source.spacing_m
          ? std::abs(*split.spacing_m - *source.spacing_m) < 1e-6 * mm
          : !source.spacing_m && sheet.rows == split.rows && sheet.cols == split.cols;
  if (same_cloth && source.segments == split.segments && source.model == split.model)
    return std::nullopt;
  const std::string cloth = split.spacing_m
                                ? fmt::format("{:g} mm", *split.spacing_m / mm)
                                : fmt::format("{}x{}", *split.rows, split.cols.value_or(0));
  return fmt::format("is of {}, {} segment{} ({}), not of {}", cloth, split.segments,
                     split.segments == 1 ? "" : "s", split.model, speaker.label());
}

Table value_effect_table(const SensitivityFile& split) {
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

Table variant_effect_table(const SensitivityFile& split) {
  Table table;
  table.title = "One part of the model changed";
  table.names = {"variant", "from", "mean_dist_mm", "change_mm", "marks_move_mm", "at_rest"};
  table.headings = {"changed",     "draped again from", "mean dist (mm)",
                    "change (mm)", "marks move (mm)",   "at rest"};
  table.numeric = {false, false, true, true, true, false};
  for (const VariantEffect& one : split.variants) {
    table.add({one.what, from_text(one), fmt::format("{:.3f}", one.distance_m / mm),
               fmt::format("{:+.3f}", one.change_m / mm), fmt::format("{:.3f}", one.moved_m / mm),
               one.at_rest ? "yes" : "no"});
  }
  table.marked_row = greatest(split.variants);
  return table;
}

std::string error_split_sentence(const SensitivityFile& split) {
  const auto best = greatest(split.variants);
  if (!best) return {};
  const VariantEffect& one = split.variants[*best];
  return fmt::format(
      "of the changes, {} (draped again from {}) moves the mean distance most, by "
      "{:+.3f} mm from {:.3f} mm",
      one.what, from_text(one), one.change_m / mm, split.distance_m / mm);
}

}  // namespace drape::compare
