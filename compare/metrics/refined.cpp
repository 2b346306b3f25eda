// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/refined.hpp"

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using Eigen::Index;
using units::mm;

void read_left(const JsonNode& root, Refined& refined) {
  refined.left_m = root.number("mean_left_mm") * mm;
  refined.order = root.optional_number("order");
  refined.goal_m = root.number("goal_mm") * mm;
  refined.sentence = root.text("sentence");
  const std::vector<JsonNode> marks = root.items("marks");
  refined.places_m.resize(static_cast<Index>(marks.size()), 3);
  refined.moves_m = refined.places_m;
  for (const JsonNode& one : marks) {
    const auto row = static_cast<Index>(refined.marks.size());
    refined.places_m.row(row) = one.vector3("place_mm") * mm;
    refined.moves_m.row(row) = one.vector3("left_mm") * mm;
    refined.marks.push_back({one.integer("row"), one.integer("col")});
  }
}

}  // namespace

std::optional<ListedRefined> refined_of(const fs::path& sheet) {
  const fs::path folder = sheet.parent_path();
  const fs::path list = (folder.empty() ? fs::path(".") : folder) / ".." / "refinement.json";
  if (!fs::is_regular_file(list)) return std::nullopt;
  const fs::path ply = fs::path(sheet).replace_extension(".ply");
  const JsonNode root = JsonNode::open(list, "refinement", kRefinementVersion);
  const std::optional<double> used = root.optional_number("used");
  const std::vector<JsonNode> grids = root.items("grids");
  for (std::size_t k = 0; k < grids.size(); ++k) {
    std::error_code unreadable;
    const fs::path listed =
        name_inside(list.parent_path(), grids[k].text("sheet"), grids[k].where("sheet"));
    if (!fs::equivalent(listed, ply, unreadable)) continue;
    Refined refined;
    refined.list_sha256 = sha256_of_file(list);
    refined.rest_sha256 = root.text("rest_sha256");
    if (used && *used == static_cast<double>(k)) read_left(root, refined);
    // Another sheet by now: what the list says is not about it.
    if (sha256_of_file(fs::path(sheet).replace_extension(".json")) != grids[k].text("sheet_sha256"))
      return std::nullopt;
    return ListedRefined{list.lexically_normal(), std::move(refined)};
  }
  return std::nullopt;
}

}  // namespace drape::compare
