// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/ensemble.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "compare/metrics/branches.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

std::optional<double> length_of(const JsonNode& node, const std::string& key) {
  const auto value = node.optional_number(key);
  return value ? std::optional(*value * mm) : std::nullopt;
}

std::vector<double> radii_of(const Ensemble& ensemble) {
  std::vector<double> radii;
  for (const BandMark& one : ensemble.band) radii.push_back(one.radius95_m);
  std::sort(radii.begin(), radii.end());
  return radii;
}

}  // namespace

double Ensemble::median_radius95_m() const {
  const std::vector<double> radii = radii_of(*this);
  return radii.empty() ? 0 : radii[radii.size() / 2];
}

double Ensemble::largest_radius95_m() const {
  const std::vector<double> radii = radii_of(*this);
  return radii.empty() ? 0 : radii.back();
}

std::optional<Ensemble> read_ensemble(const std::filesystem::path& list,
                                      const std::string& sha256) {
  const auto found = list_with("members_at_rest", list, sha256);
  if (!found) return std::nullopt;
  const JsonNode& root = *found;
  Ensemble ensemble;
  ensemble.members = root.integer("members_at_rest");
  for (const JsonNode& one : root.items("band")) {
    ensemble.band.push_back({{one.integer("row"), one.integer("col")},
                             one.vector3("mean_mm") * mm,
                             one.number("radius95_mm") * mm});
  }
  if (!root.has("measured")) return ensemble;
  const JsonNode measured = root.at("measured");
  ensemble.nearest = measured.optional_integer("nearest_branch");
  ensemble.on = measured.optional_integer("branch");
  ensemble.distance_m = length_of(measured, "distance_mm");
  ensemble.reach_m = length_of(measured, "reach_mm");
  if (!ensemble.band.empty())
    ensemble.inside_fraction = measured.optional_number("fraction_of_marks_in_band");
  ensemble.started_there = measured.text("started_there");
  ensemble.started_there_m = length_of(measured, "started_there_distance_mm");
  return ensemble;
}

std::string ensemble_sentence(const Ensemble& ensemble) {
  std::string text = fmt::format("{} starts come to rest", ensemble.members);
  if (!ensemble.band.empty())
    text += fmt::format(
        "; 95 % of them lie within {:.2f} mm of their mean (median over the marks; {:.2f} mm at "
        "the loosest mark)",
        ensemble.median_radius95_m() / mm, ensemble.largest_radius95_m() / mm);
  if (ensemble.nearest && ensemble.distance_m && ensemble.reach_m) {
    text += ensemble.on ? fmt::format("; the real drape is on branch {}", *ensemble.on)
                        : fmt::format("; the real drape is on no branch, branch {} is the nearest",
                                      *ensemble.nearest);
    text += fmt::format(" ({:.2f} mm from its nearest member, branches reach {:.2f} mm)",
                        *ensemble.distance_m / mm, *ensemble.reach_m / mm);
  }
  if (ensemble.inside_fraction)
    text +=
        fmt::format("; {:.0f} % of its marks are in their bands", 1e2 * *ensemble.inside_fraction);
  if (ensemble.started_there_m) {
    text += fmt::format(
        "; started from the real shape, the simulation rests {:.2f} mm away: the error of model "
        "and fabric without the luck of folds",
        *ensemble.started_there_m / mm);
  } else if (!ensemble.started_there.empty()) {
    text += "; started from the real shape, it ends " + ensemble.started_there;
  }
  return text;
}

}  // namespace drape::compare
