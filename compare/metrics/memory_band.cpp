// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/memory_band.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "compare/metrics/branches.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::compare {

using Eigen::Index;
using Eigen::MatrixX3d;
using units::mm;

MatrixX3d MemoryBand::extreme_m(double sign) const {
  MatrixX3d best = MatrixX3d::Zero(static_cast<Index>(marks.size()), 3);
  for (const MemoryEnd& end : ends)
    if (end.moves_m && sign * end.moves_m->col(2).mean() > sign * best.col(2).mean())
      best = *end.moves_m;
  return best;
}

std::optional<MemoryBand> read_memory_band(const std::filesystem::path& list,
                                           const std::string& sha256) {
  const auto root = list_with("internal_friction_band", list, sha256);
  if (!root) return std::nullopt;
  const JsonNode node = root->at("internal_friction_band");
  MemoryBand band;
  for (const JsonNode& one : node.items("marks"))
    band.marks.push_back({one.integer("row"), one.integer("col")});
  if (band.marks.empty()) node.reject("marks", "names no mark");
  for (const JsonNode& one : node.items("ends"))
    band.ends.push_back({one.text("what"), one.text("ending"), moves_m_of(one, band.marks.size())});
  if (node.has("place_of_rest")) band.place_of_rest = node.number("place_of_rest");
  return band;
}

std::string memory_sentence(const MemoryBand& band) {
  std::string text =
      "internal friction holds the drape of the scene's start in an interval, as other pasts show";
  int lost = 0;
  for (const MemoryEnd& end : band.ends) {
    if (!end.moves_m) {
      ++lost;
      continue;
    }
    const Eigen::VectorXd far = end.moves_m->rowwise().norm();
    text += fmt::format("; {}: {:.3f} mm away on average, {:.3f} mm at the loosest mark", end.what,
                        far.mean() / mm, far.maxCoeff() / mm);
  }
  if (band.place_of_rest)
    text += fmt::format("; from its lowest to its highest end the drape lies at {:.0f} %",
                        100 * *band.place_of_rest);
  if (lost > 0)
    text += fmt::format(
        "; {} of {} ends lie on another branch or nowhere, and count for "
        "nothing",
        lost, band.ends.size());
  return text;
}

}  // namespace drape::compare
