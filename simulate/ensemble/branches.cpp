// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/branches.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/parallel.hpp"
#include "core/statistics/random.hpp"
#include "core/units.hpp"
#include "simulate/ensemble/linkage.hpp"
#include "simulate/ensemble/valleys.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kSameAxis = 1e-6;    // m
constexpr double kSameEnergy = 1e-9;  // relative to the energy
constexpr double kPlace = 2e-3;       // m; by which a hand lays a sheet beside its place

Vector3d middle_of(const Field& x) {
  const int n = static_cast<int>(x.size() / 3);
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < n; ++i) sum += at(x, i);
  return sum / n;
}

std::optional<Vector2d> axis_of(const Obstacle& obstacle) {
  if (const auto* sphere = std::get_if<Sphere>(&obstacle)) {
    return sphere->centre_in_world.head<2>();
  }
  if (const auto* body = std::get_if<Cylinder>(&obstacle)) {
    const Vector3d axis = body->world_from_cylinder.rotation.col(2);
    if (axis.head<2>().norm() < kSameAxis) return body->world_from_cylinder.translation_m.head<2>();
  }
  return std::nullopt;
}

/// After the turn about the vertical and the horizontal shift that fit best.
double distance_after_turn(const Field& a, const Field& b, bool reversed) {
  const int n = static_cast<int>(a.size() / 3);
  const Vector3d ma = middle_of(a);
  const Vector3d mb = middle_of(b);
  double dot = 0;
  double cross = 0;
  for (int i = 0; i < n; ++i) {
    const Vector3d p = at(a, i) - ma;
    const Vector3d q = at(b, reversed ? n - 1 - i : i) - mb;
    dot += q.x() * p.x() + q.y() * p.y();
    cross += q.x() * p.y() - q.y() * p.x();
  }
  const Eigen::Rotation2Dd turn(std::atan2(cross, dot));
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const Vector3d q = at(b, reversed ? n - 1 - i : i) - mb;
    const Vector2d flat = turn * q.head<2>() + ma.head<2>();
    sum += (at(a, i) - Vector3d(flat.x(), flat.y(), q.z() + mb.z())).norm();
  }
  return sum / n;
}

}  // namespace

StartVariation variation_of(int index, bool friction_known) {
  StartVariation v;
  if (index == 0) return v;
  const auto pick = [&](int what, double low, double high) {
    return low +
           (high - low) * SplitMix64(0, static_cast<std::uint64_t>(index) * 16 + what).uniform();
  };
  v.noise_m = std::pow(10.0, pick(0, -6, -3.5));
  v.tilt_rad = pick(1, 0, 0.08);
  v.tilt_axis_rad = pick(2, 0, 2 * std::numbers::pi);
  v.yaw_rad = pick(3, -0.03, 0.03);
  v.lift_m = pick(4, 0, 0.01);
  v.folds = 2 + static_cast<int>(pick(5, 0, 6.999));
  v.fold_m = pick(6, 0, 6e-3);
  v.fold_phase_rad = pick(7, 0, 2 * std::numbers::pi);
  v.place_m = {pick(8, -kPlace, kPlace), pick(9, -kPlace, kPlace)};
  v.friction_factor = friction_known ? pick(10, 0.9, 1.1) : std::exp2(pick(10, -1, 1));
  v.damping_per_s = std::exp2(pick(11, 0, 4));
  return v;
}

void apply(const StartVariation& v, const GridSpec& grid, Field& position) {
  const Vector3d middle = middle_of(position);
  const Vector3d axis(std::cos(v.tilt_axis_rad), std::sin(v.tilt_axis_rad), 0);
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(v.tilt_rad, axis) * Eigen::AngleAxisd(v.yaw_rad, Vector3d::UnitZ()))
          .toRotationMatrix();
  const double reach = 0.5 * grid.patch_m.norm();
  const std::size_t n = grid.count();
  double lowest = 0;
  std::vector<Vector3d> moved(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d flat = at(position, static_cast<int>(i)) - middle;
    const double out = flat.head<2>().norm() / reach;
    const double angle = std::atan2(flat.y(), flat.x());
    const double noise = v.noise_m * (2 * SplitMix64(0, 7919 * (i + 1)).uniform() - 1);
    const double wave = v.fold_m * out * out * std::cos(v.folds * angle - v.fold_phase_rad);
    moved[i] = turn * (flat + Vector3d(0, 0, noise + wave));
    lowest = std::min(lowest, moved[i].z());
  }
  for (std::size_t i = 0; i < n; ++i) {
    moved[i] += middle + Vector3d(v.place_m.x(), v.place_m.y(), v.lift_m - lowest);
    for (std::size_t a = 0; a < 3; ++a) position[a * n + i] = moved[i][static_cast<int>(a)];
  }
}

bool is_round(const Scene& scene) {
  if (!scene.pins.empty() || !scene.clamps.empty()) return false;
  std::optional<Vector2d> common;
  for (const Obstacle& obstacle : scene.obstacles) {
    const std::optional<Vector2d> axis = axis_of(obstacle);
    if (!axis || (common && (*axis - *common).norm() > kSameAxis)) return false;
    common = axis;
  }
  return common.has_value() && scene.gravity_m_per_s2.head<2>().isZero(0);
}

double mean_distance_m(const Field& a, const Field& b, bool round) {
  if (!round) return mean_distance_m(a, b);
  return std::min(distance_after_turn(a, b, false), distance_after_turn(a, b, true));
}

namespace {

/// Groups rests, which are ordered by energy, into branches named by their lowest.
void group(std::vector<Branch> rests, double least_m, Branches& branches) {
  const auto apart_m = [&](int a, int b) {
    return mean_distance_m(rests[a].position, rests[b].position, branches.round);
  };
  const Linkage linkage = link(static_cast<int>(rests.size()), apart_m, least_m);
  branches.linked_m = linkage.limit;
  std::vector<double> spread_m(rests.size(), 0.0);
  std::vector<int> first(rests.size(), -1);  // first rest of each group
  for (std::size_t k = 0; k < rests.size(); ++k) {
    int& lowest = first[linkage.group[k]];
    if (lowest < 0) {
      lowest = static_cast<int>(k);
      continue;
    }
    spread_m[lowest] = std::max(spread_m[lowest], apart_m(lowest, static_cast<int>(k)));
    rests[lowest].starts.push_back(rests[k].starts.front());
    rests[lowest].others.push_back(std::move(rests[k]));
  }
  for (const int lowest : first) {
    if (lowest < 0) continue;
    rests[lowest].spread_m = spread_m[lowest];
    std::sort(rests[lowest].starts.begin(), rests[lowest].starts.end());
    branches.found.push_back(std::move(rests[lowest]));
  }
}

Branch branch_of(StaticDrape drape, const GridSpec& grid, int start, double friction) {
  Branch branch;
  branch.energy_j = drape.report.history.back().sum_j();
  branch.hem = label_hem(grid, drape.position);
  branch.position = std::move(drape.position);
  branch.memory = std::move(drape.memory);
  branch.report = std::move(drape.report);
  branch.own_start = start;
  if (start >= 0) branch.starts = {start};
  branch.friction = friction;
  return branch;
}

bool is_lower(const Branch& a, const Branch& b) {
  return a.energy_j < b.energy_j;
}

/// Adds a rest that was sought: to the branch that it would be linked with, else as one of its own.
void add_sought(Branch sought, Branches& branches) {
  const auto is_near = [&](const Branch& member) {
    return mean_distance_m(sought.position, member.position, branches.round) <= branches.linked_m;
  };
  for (Branch& branch : branches.found) {
    const bool linked =
        is_near(branch) || std::any_of(branch.others.begin(), branch.others.end(), is_near);
    if (!linked) continue;
    if (sought.energy_j > branch.energy_j - kSameEnergy * std::abs(branch.energy_j)) return;
    sought.starts = branch.starts;
    sought.spread_m = branch.spread_m;
    sought.others = std::move(branch.others);
    branch.others.clear();
    sought.others.insert(sought.others.begin(), std::move(branch));
    branch = std::move(sought);
    return;
  }
  branches.found.push_back(std::move(sought));
}

/// Mirror images weigh the same but for rounding, and rounding is not to choose: the one that is
/// reported comes first, with the same energy.
void put_mirror_images_in_order(const MirrorPlane& plane, const GridSpec& grid,
                                std::vector<Branch>& found) {
  for (std::size_t k = 0; k + 1 < found.size(); ++k) {
    const double same_j = kSameEnergy * std::abs(found[k].energy_j);
    if (found[k + 1].energy_j - found[k].energy_j > same_j) continue;
    found[k + 1].energy_j = found[k].energy_j;
    if (!plane.is_reported(grid, found[k].position) &&
        plane.is_reported(grid, found[k + 1].position))
      std::swap(found[k], found[k + 1]);
  }
}

/// A sheet that hangs free is sought lower, also where some starts ended on the sheet itself.
void seek_lower(const StaticCase& the_case, const GridSpec& grid, const StaticOptions& options,
                int kicks, Branches& branches) {
  std::vector<const Field*> rests;
  for (const Branch& branch : branches.found) {
    if (branch.report.touching + branch.report.between > 0) return;
    rests.push_back(&branch.position);
    for (const Branch& other : branch.others) rests.push_back(&other.position);
  }
  ValleySearch how;
  how.kicks = kicks;
  const std::optional<MirrorPlane> plane = MirrorPlane::of(the_case);
  for (StaticDrape& drape : seek_valleys(the_case, grid, options, rests, how)) {
    if (plane && !plane->is_reported(grid, drape.position)) plane->mirror(drape.position);
    add_sought(branch_of(std::move(drape), grid, -1, options.friction), branches);
  }
  std::stable_sort(branches.found.begin(), branches.found.end(), is_lower);
  if (plane) put_mirror_images_in_order(*plane, grid, branches.found);
}

}  // namespace

Branches find_branches(const StaticCase& the_case, const ClothLaws& without, const GridSpec& grid,
                       const StaticOptions& options, const BranchOptions& how) {
  Branches branches;
  branches.round = is_round(the_case.scene);
  const bool friction_known = !names(the_case.scene.stand_ins, "friction");
  std::vector<StaticDrape> drapes(how.starts);
  std::vector<double> friction(how.starts);
  parallel_for(drapes.size(), options.threads, [&](std::size_t k) {
    const StartVariation variation = variation_of(static_cast<int>(k), friction_known);
    StaticOptions alone = options;
    alone.threads = 1;  // starts are drapes of their own, so the threads are theirs
    alone.friction *= variation.friction_factor;
    alone.damping_per_s = variation.damping_per_s.value_or(options.damping_per_s);
    friction[k] = alone.friction;
    const auto change = [&](const GridSpec& here, Field& position) {
      if (k > 0) apply(variation, here, position);
    };
    const auto push = [&](StaticSolver& solver, const StaticReport& found) {
      branches.friction_band.reset();
      if (found.touching + found.between > 0) branches.friction_band = push_at_rest(solver, alone);
      if (the_case.laws.friction)
        branches.memory_band = ends_of_memory(the_case, without, grid, solver, alone, found);
    };
    drapes[k] =
        drape_statically(the_case, grid, alone, change, k == 0 ? AfterRest(push) : AfterRest());
  });
  branches.members.resize(how.starts);
  std::vector<Branch> rests;
  for (std::size_t k = 0; k < drapes.size(); ++k) {
    StaticDrape& drape = drapes[k];
    const int start = static_cast<int>(k);
    if (drape.report.status != StaticStatus::at_rest || drape.report.history.empty()) {
      branches.not_at_rest.push_back(start);
      continue;
    }
    branches.members[k] = drape.position;
    rests.push_back(branch_of(std::move(drape), grid, start, friction[k]));
  }
  // By energy, so that each branch is named by its lowest.
  std::stable_sort(rests.begin(), rests.end(), is_lower);
  group(std::move(rests), how.same_m, branches);
  if (how.kicks > 0 && !the_case.laws.friction)
    seek_lower(the_case, grid, options, how.kicks, branches);
  return branches;
}

std::vector<int> Branches::drop_lowest(Branch& branch) {
  std::vector<Branch> others = std::move(branch.others);
  std::vector<int> starts = std::move(branch.starts);
  std::vector<int> dropped;
  if (branch.own_start >= 0) {
    dropped = {branch.own_start};
    members[branch.own_start].clear();
    std::erase(starts, branch.own_start);
  }
  const double spread_m = branch.spread_m;
  if (others.empty()) {
    branch.starts.clear();
    return dropped;
  }
  branch = std::move(others.front());
  others.erase(others.begin());
  branch.others = std::move(others);
  branch.starts = std::move(starts);
  branch.spread_m = spread_m;
  return dropped;
}

Json branches_json(const Branches& branches) {
  Json json;
  json["schema"] = "drapebench/branches/1";
  json["scene_round_about_the_vertical"] = branches.round;
  json["linking_distance_mm"] = branches.linked_m / mm;
  json["starts_not_at_rest"] = branches.not_at_rest;
  json["refused"] = Json::array();
  for (const RefusedStarts& one : branches.refused) {
    json["refused"].push_back({{"starts", one.starts}, {"why", one.why}});
  }
  Json list = Json::array();
  for (std::size_t k = 0; k < branches.found.size(); ++k) {
    const Branch& branch = branches.found[k];
    Json one;
    one["branch"] = k + 1;
    one["sheet"] = fmt::format("branch-{:02}/sheet.ply", k + 1);
    one["energy_uJ"] = branch.energy_j / 1e-6;
    one["largest_residual_per_particle_weight"] = branch.report.residual;
    one["stable"] = branch.report.stable;
    one["starts"] = branch.starts;
    one["fraction"] = static_cast<double>(branch.starts.size()) /
                      static_cast<double>(std::max<std::size_t>(branches.members.size(), 1));
    if (branch.own_start < 0) one["sought"] = true;
    one["friction"] = branch.friction;
    one["farthest_member_mm"] = branch.spread_m / mm;
    one["hem_nodes"] = branch.hem.nodes;
    Json spectrum = Json::array();
    for (const double amplitude : branch.hem.amplitude_m) spectrum.push_back(amplitude / mm);
    one["hem_radius_spectrum_mm"] = spectrum;
    list.push_back(one);
  }
  json["branches"] = list;
  return json;
}

}  // namespace drape::simulate
