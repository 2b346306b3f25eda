// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/error_split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/files/lattice_size.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr int kSensitivityVersion = 1;
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

/// Nothing where the file has none: it was written before, or the cloth did not come to rest.
std::optional<MarkMoves> moves_of(const JsonNode& entry, const ErrorSplitFile& split) {
  if (!entry.has("step")) return std::nullopt;
  const auto rows = [&](const char* key) -> Eigen::MatrixX3d {
    const Eigen::MatrixXd found = entry.matrix(key);
    if (found.cols() != 3 || found.rows() != static_cast<Eigen::Index>(split.marks_at.size()))
      entry.reject(key, "must have x, y, z for each entry of marks_at");
    return found * mm;
  };
  const double step = entry.number("step");
  if (!(step > 0)) entry.reject("step", "must be above 0");
  return MarkMoves{step, entry.optional_number("half_width"), rows("down_mm"), rows("up_mm")};
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

ErrorSplitFile read_error_split(const std::filesystem::path& file) {
  const JsonNode root = JsonNode::open(file, "sensitivity", kSensitivityVersion);
  ErrorSplitFile split;
  split.file = file;
  split.sha256 = sha256_of_file(file);
  if (root.has("rows")) {
    split.rows = root.integer("rows");
    split.cols = root.integer("cols");
    split.segments = root.integer("segments");
    split.model = root.text("model");
  }
  split.distance_m = root.number("mean_distance_mm") * mm;
  split.marks = root.integer("marks");
  if (root.has("no_go")) split.no_go = root.text("no_go");
  if (root.has("marks_at")) {
    const Eigen::MatrixXd places = root.matrix("marks_at");
    if (places.cols() != 2) root.reject("marks_at", "must hold pairs of row and column");
    if ((places.array() < 0 || places.array() > kMostMarks ||
         places.array() != places.array().floor())
            .any())
      root.reject("marks_at", "has a row or column that no sheet has");
    for (Eigen::Index k = 0; k < places.rows(); ++k)
      split.marks_at.push_back({static_cast<int>(places(k, 0)), static_cast<int>(places(k, 1))});
  }
  if (!root.at("sensitivities").raw().is_null()) {
    for (const JsonNode& entry : root.items("sensitivities")) {
      split.values.push_back(
          {entry.text("value"), entry.number("mean_distance_mm_per_percent") * mm,
           entry.number("mean_way_of_marks_mm_per_percent") * mm, moves_of(entry, split)});
    }
  }
  if (root.has("scene_sensitivities")) {
    for (const JsonNode& entry : root.items("scene_sensitivities"))
      split.scene.push_back({entry.text("value"), entry.number("mean_distance_mm_per_unit") * mm,
                             moves_of(entry, split)});
  }
  if (!root.has("variants")) return split;
  for (const JsonNode& entry : root.items("variants")) {
    split.variants.push_back(
        {entry.text("what"), entry.text("from") == "base", entry.boolean("at_rest"),
         entry.number("mean_distance_mm") * mm, entry.number("change_mm") * mm,
         entry.number("mean_way_of_marks_mm") * mm, entry.integer("hem_folds")});
  }
  return split;
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
