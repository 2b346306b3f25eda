// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/branches.hpp"

#include <cmath>
#include <numbers>

#include "compare/metrics/drapemeter.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr int kTurns = 360;

/// Measured marks and their places on the virtual sheet, seen from the axis.
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

/// Smallest mean within one step around `middle`, where it has one minimum.
double refined(const Pairs& pairs, double middle, double step) {
  const double golden = (std::sqrt(5.0) - 1) / 2;
  double low = middle - step, high = middle + step;
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double at_left = pairs.mean_m(left), at_right = pairs.mean_m(right);
  while (high - low > 1e-13) {
    if (at_left < at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = pairs.mean_m(left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = pairs.mean_m(right);
    }
  }
  return (low + high) / 2;
}

Branch branch_from(const JsonNode& entry, const JsonNode& root,
                   const std::vector<JsonNode>& entries, const fs::path& list) {
  Branch branch;
  branch.set_sha256 = sha256_of_file(list);
  branch.number = entry.integer("branch");
  branch.of = static_cast<int>(entries.size());
  branch.energy_j = entry.number("energy_uJ") * 1e-6;
  branch.residual = entry.number("largest_residual_per_particle_weight");
  branch.stable = entry.boolean("stable");
  branch.starts = static_cast<int>(entry.at("starts").raw().size());
  branch.hem_nodes = entry.integer("hem_nodes");
  branch.round = root.boolean("scene_round_about_the_vertical");
  for (const JsonNode& one : entries)
    if (one.integer("branch") == 1) branch.least_j = one.number("energy_uJ") * 1e-6;
  return branch;
}

}  // namespace

std::optional<Branch> branch_in(const fs::path& list, int number) {
  const JsonNode root = JsonNode::open(list, "branches", kBranchesVersion);
  const std::vector<JsonNode> entries = root.items("branches");
  for (const JsonNode& entry : entries)
    if (entry.integer("branch") == number) return branch_from(entry, root, entries, list);
  return std::nullopt;
}

std::optional<ListedBranch> branch_of(const fs::path& sheet) {
  const fs::path folder = sheet.parent_path();
  const fs::path list = (folder.empty() ? fs::path(".") : folder) / ".." / "branches.json";
  if (!fs::is_regular_file(list)) return std::nullopt;
  const fs::path ply = fs::path(sheet).replace_extension(".ply");
  const JsonNode root = JsonNode::open(list, "branches", kBranchesVersion);
  const std::vector<JsonNode> entries = root.items("branches");
  for (const JsonNode& entry : entries) {
    std::error_code unreadable;
    const fs::path listed =
        name_inside(list.parent_path(), entry.text("sheet"), entry.where("sheet"));
    if (!fs::equivalent(listed, ply, unreadable)) continue;
    return ListedBranch{list.lexically_normal(), branch_from(entry, root, entries, list)};
  }
  return std::nullopt;
}

std::optional<JsonNode> list_with(const std::string& part, const fs::path& list,
                                  const std::string& sha256) {
  if (!fs::is_regular_file(list) || sha256_of_file(list) != sha256) return std::nullopt;
  const JsonNode root = JsonNode::open(list, "branches", kBranchesVersion);
  return root.has(part) ? std::optional(root) : std::nullopt;
}

std::optional<Eigen::MatrixX3d> moves_m_of(const JsonNode& end, std::size_t marks) {
  if (!end.has("moves_mm")) return std::nullopt;
  const Eigen::MatrixXd moves = end.matrix("moves_mm");
  if (moves.cols() != 3 || moves.rows() != static_cast<Eigen::Index>(marks))
    end.reject("moves_mm", "has not three numbers for each mark");
  return moves * units::mm;
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

}  // namespace drape::compare
