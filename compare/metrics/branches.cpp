// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/branches.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compare/metrics/drapemeter.hpp"
#include "core/files/files.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

constexpr int kTurns = 360;

/// Measured marks and their positions on the virtual sheet, relative to the axis.
struct Pairs {
  std::vector<Eigen::Vector3d> real, simulated;

  Pairs(const Sheet& measured, const Surface& surface, const Eigen::Vector3d& axis,
        bool half_turn) {
    for (const SheetMark& mark : measured.marks) {
      const auto place =
          surface.at(half_turn ? measured.patch_m - mark.material_m : mark.material_m);
      if (!place) continue;
      real.emplace_back(mark.point_in_world - axis);
      simulated.emplace_back(place->point_in_world - axis);
    }
  }

  [[nodiscard]] double mean_m(double turn_rad) const {
    const double c = std::cos(turn_rad), s = std::sin(turn_rad);
    double sum = 0;
    for (std::size_t i = 0; i < real.size(); ++i) {
      const Eigen::Vector3d& p = simulated[i];
      const Eigen::Vector3d turned(c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z());
      sum += (turned - real[i]).norm();
    }
    return sum / static_cast<double>(real.size());
  }
};

/// Smallest mean within one step around `middle`, assuming a single minimum there.
double refined(const Pairs& pairs, double middle, double step) {
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double low = middle - step, high = middle + step;
  while (high - low > 1e-13) {
    const double left = high - golden * (high - low), right = low + golden * (high - low);
    if (pairs.mean_m(left) < pairs.mean_m(right))
      high = right;
    else
      low = left;
  }
  return (low + high) / 2;
}

/// Path of a list in the folder above the sheet's; nullopt if it does not exist.
std::optional<fs::path> file_above(const fs::path& sheet, const char* name) {
  const fs::path folder = sheet.parent_path();
  const fs::path file = (folder.empty() ? fs::path(".") : folder) / ".." / name;
  return fs::is_regular_file(file) ? std::optional(file) : std::nullopt;
}

/// True if the sheet named by a list is this one.
bool is_named(const fs::path& sheet, const std::string& name, const fs::path& list) {
  std::error_code unreadable;
  const fs::path named =
      name_inside(list.parent_path(), name, {.file = list.string(), .field = "sheet"});
  return fs::equivalent(named, fs::path(sheet).replace_extension(".ply"), unreadable);
}

Branch branch_from(const ListedBranch& one, const BranchList& list) {
  Branch branch{list.document.sha256(),
                one.number,
                static_cast<int>(list.branches.size()),
                one.energy_j,
                one.residual,
                one.stable,
                static_cast<int>(one.starts.size()),
                one.hem_nodes,
                list.round,
                one.fraction};
  for (const ListedBranch& other : list.branches)
    if (other.number == 1) branch.least_j = other.energy_j;
  return branch;
}

}  // namespace

std::optional<Branch> branch_in(const Document& document, int number) {
  const auto list = read_record<BranchList>(document);
  for (const ListedBranch& one : list.branches)
    if (one.number == number) return branch_from(one, list);
  return std::nullopt;
}

std::optional<std::pair<fs::path, Branch>> branch_of(const fs::path& sheet) {
  const auto file = file_above(sheet, "branches.json");
  if (!file) return std::nullopt;
  const auto list = read_record<BranchList>(*file);
  for (const ListedBranch& one : list.branches)
    if (is_named(sheet, one.sheet, *file))
      return std::pair(file->lexically_normal(), branch_from(one, list));
  return std::nullopt;
}

std::optional<BranchList> list_above(const fs::path& sheet, const std::string& sha256) {
  const auto file = file_above(sheet, "branches.json");
  if (!file) return std::nullopt;
  const Document document = Document::read(*file);
  if (document.sha256() != sha256) return std::nullopt;
  return read_record<BranchList>(document);
}

std::optional<Eigen::Vector2d> axis_of(const Scene& scene) {
  for (const Obstacle& obstacle : scene.obstacles)
    if (auto centre = centre_of(obstacle)) return centre;
  return std::nullopt;
}

std::optional<TurnedDistance> best_turn(const Sheet& measured, const Surface& virtual_sheet,
                                        const Eigen::Vector2d& axis_in_world) {
  const Eigen::Vector3d axis(axis_in_world.x(), axis_in_world.y(), 0);
  const double step = 2 * std::numbers::pi / kTurns;
  std::optional<TurnedDistance> best;
  for (const bool half_turn : {false, true}) {
    const Pairs pairs(measured, virtual_sheet, axis, half_turn);
    if (pairs.real.empty()) continue;
    double turn = 0, least = pairs.mean_m(0);
    for (int k = 1; k < kTurns; ++k) {
      const double mean_m = pairs.mean_m(k * step);
      if (mean_m >= least) continue;
      turn = k * step;
      least = mean_m;
    }
    turn = std::remainder(refined(pairs, turn, step), 2 * std::numbers::pi);
    least = pairs.mean_m(turn);
    if (!best || least < best->mean_m) best = TurnedDistance{least, turn, half_turn, axis_in_world};
  }
  return best;
}

std::string ensemble_sentence(const BranchList& list) {
  std::string text = fmt::format("{} starts come to rest", list.members_at_rest.value_or(0));
  std::vector<double> radii;
  for (const BandMark& one : list.band) radii.push_back(one.radius95_m);
  if (!radii.empty())
    text += fmt::format(
        "; 95 % of them lie within {:.2f} mm of their mean (median over the marks; {:.2f} mm at "
        "the loosest mark)",
        median(radii) / mm, *std::max_element(radii.begin(), radii.end()) / mm);
  if (list.unseen)
    text += fmt::format(
        "; {:.0f} % of starts may end on branches that none showed, at most {:.0f} "
        "% (95 %)",
        100 * list.unseen->fraction, 100 * list.unseen->upper95);
  if (!list.measured) return text;
  const PlacedDrape& real = *list.measured;
  if (real.nearest && real.distance_m) {
    const bool known = real.reach_m.has_value();  // otherwise being on a branch means nothing
    text += known && real.branch
                ? fmt::format("; the real drape is on branch {}", *real.branch)
                : fmt::format("; {}branch {} is the nearest",
                              known ? "the real drape is on no branch, " : "", *real.nearest);
    text += fmt::format(" ({:.2f} mm from its nearest member", *real.distance_m / mm);
    if (real.apart_m)
      text += fmt::format(", the next branch {:.2f} mm from it", *real.apart_m / mm);
    if (known) text += fmt::format(", branches reach {:.2f} mm", *real.reach_m / mm);
    text += ")";
  }
  if (!radii.empty() && real.inside_fraction)
    text += fmt::format("; {:.0f} % of its marks are in their bands", 1e2 * *real.inside_fraction);
  if (real.started_there_m)
    text += fmt::format(
        "; started from the real shape, the simulation rests {:.2f} mm away: the error of model "
        "and fabric without the luck of folds",
        *real.started_there_m / mm);
  else if (!real.started_there.empty())
    text += "; started from the real shape, it ends " + real.started_there;
  return text;
}

std::string friction_sentence(const FrictionBand& band) {
  if (band.pushes.empty()) return "without friction the drape of the scene's start has one place";
  std::string text = fmt::format(
      "friction {:g} holds the drape of the scene's start anywhere in an interval: pushed by "
      "{:.2f} "
      "of its weight from {} sides and let go",
      band.friction, band.pushes.front().push_per_weight->norm(), band.pushes.size());
  const std::vector<double> reach = band.reach_m();
  if (band.counted() > 0 && !reach.empty())
    text += fmt::format(
        ", it rests up to {:.3f} mm away (median over the marks; {:.3f} mm at the loosest mark)",
        median(reach) / mm, *std::max_element(reach.begin(), reach.end()) / mm);
  const auto lost = band.pushes.size() - static_cast<std::size_t>(band.counted());
  if (lost > 0)
    text += fmt::format(
        "{} {} of these pushes end on another branch or nowhere, and count for "
        "nothing",
        band.counted() > 0 ? ";" : ",", lost);
  return text;
}

std::string memory_sentence(const MemoryBand& band) {
  std::string text =
      "internal friction holds the drape of the scene's start in an interval, as other pasts show";
  int lost = 0;
  for (const OtherRest& end : band.ends) {
    if (!end.moves_m) {
      ++lost;
      continue;
    }
    const Eigen::VectorXd far = end.moves().rowwise().norm();
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
