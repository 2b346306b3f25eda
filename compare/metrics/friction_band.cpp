// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/friction_band.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "compare/metrics/branches.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::compare {

using Eigen::Index;
using units::mm;

int FrictionBand::counted() const {
  return static_cast<int>(std::count_if(pushes.begin(), pushes.end(), [](const FrictionPush& push) {
    return push.moves_m.has_value();
  }));
}

std::vector<double> FrictionBand::reach_m() const {
  std::vector<double> reach(marks.size(), 0.0);
  for (const FrictionPush& push : pushes) {
    if (!push.moves_m) continue;
    for (std::size_t k = 0; k < reach.size(); ++k)
      reach[k] = std::max(reach[k], push.moves_m->row(static_cast<Index>(k)).norm());
  }
  return reach;
}

std::optional<FrictionBand> read_friction_band(const std::filesystem::path& list,
                                               const std::string& sha256) {
  const auto root = list_with("friction_band", list, sha256);
  if (!root) return std::nullopt;
  const JsonNode node = root->at("friction_band");
  FrictionBand band;
  band.friction = node.number("friction");
  const std::vector<JsonNode> marks = node.items("marks");
  band.low_in_world.resize(static_cast<Index>(marks.size()), 3);
  band.high_in_world = band.low_in_world;
  for (const JsonNode& one : marks) {
    const auto row = static_cast<Index>(band.marks.size());
    band.low_in_world.row(row) = one.vector3("low_mm") * mm;
    band.high_in_world.row(row) = one.vector3("high_mm") * mm;
    band.marks.push_back({one.integer("row"), one.integer("col")});
  }
  for (const JsonNode& one : node.items("pushes"))
    band.pushes.push_back(
        {one.vector3("push_per_weight"), one.text("ending"), moves_m_of(one, marks.size())});
  return band;
}

std::string friction_sentence(const FrictionBand& band) {
  if (band.pushes.empty()) return "without friction the drape of the scene's start has one place";
  std::string text = fmt::format(
      "friction {:g} holds the drape of the scene's start anywhere in an interval: pushed by "
      "{:.2f} "
      "of its weight from {} sides and let go",
      band.friction, band.pushes.front().push_per_weight.norm(), band.pushes.size());
  std::vector<double> reach = band.reach_m();
  std::sort(reach.begin(), reach.end());
  if (band.counted() > 0 && !reach.empty())
    text += fmt::format(
        ", it rests up to {:.3f} mm away (median over the marks; {:.3f} mm at the loosest mark)",
        reach[reach.size() / 2] / mm, reach.back() / mm);
  const auto lost = band.pushes.size() - static_cast<std::size_t>(band.counted());
  if (lost > 0)
    text += fmt::format(
        "{} {} of these pushes end on another branch or nowhere, and count for "
        "nothing",
        band.counted() > 0 ? ";" : ",", lost);
  return text;
}

}  // namespace drape::compare
