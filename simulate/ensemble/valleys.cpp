// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/valleys.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/parallel.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/equilibrium/prolong.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kInPlane = 1e-9;                      // m
constexpr double kSameEnergy = 1e-6;                   // of the energy; nearer rests are one
constexpr double kLeastPart = 0.15, kMostPart = 0.6;   // of the patch; reach of a kick
constexpr double kLeastMove = 0.02, kMostMove = 0.15;  // of the patch

/// SplitMix64 (Steele, Lea, Flood 2014): the same numbers with every library.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL) {}
  double uniform(double low, double high) {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return low + (high - low) * static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

/// Moves a round part of the sheet: its mirror image in its own plane, or across that plane.
void kick(const GridSpec& grid, int index, Field& x) {
  Draw draw(static_cast<std::uint64_t>(index) + 1);
  const double u0 = draw.uniform(0, 1), v0 = draw.uniform(0, 1);
  const double reach = draw.uniform(kLeastPart, kMostPart);
  const double side = std::max(grid.patch_m.x(), grid.patch_m.y());
  const double move =
      side * draw.uniform(kLeastMove, kMostMove) * (draw.uniform(-1, 1) < 0 ? -1 : 1);
  const bool mirrors = index % 2 == 0;
  std::vector<double> weight(grid.count());
  double total = 0;
  Vector3d middle = Vector3d::Zero();
  for (int i = 0; i < grid.count(); ++i) {
    const int row = i / grid.cols, col = i % grid.cols;
    const double u = row / (grid.rows - 1.0) - u0;
    const double v = col / (grid.cols - 1.0) - v0;
    const double inside = std::max(0.0, 1 - (u * u + v * v) / (reach * reach));
    weight[i] = std::min(1.0, 2 * inside * inside);
    total += weight[i];
    middle += weight[i] * at(x, i);
  }
  if (!(total > 0)) return;
  middle /= total;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (int i = 0; i < grid.count(); ++i) {
    const Vector3d p = at(x, i) - middle;
    spread += weight[i] * p * p.transpose();
  }
  const Vector3d across =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  for (int i = 0; i < grid.count(); ++i) {
    const Vector3d p = at(x, i);
    const double way = mirrors ? -2 * (p - middle).dot(across) : move;
    put_at(x, i, p + weight[i] * way * across);
  }
}

struct Rest {
  Field position;
  double energy_j = 0;
};

/// Keeps `most` rests of different energies, lowest first.
void keep(std::vector<Rest>& pool, Rest rest, std::size_t most) {
  const auto place =
      std::lower_bound(pool.begin(), pool.end(), rest,
                       [](const Rest& a, const Rest& b) { return a.energy_j < b.energy_j; });
  const double same_j = kSameEnergy * std::abs(rest.energy_j);
  if (place != pool.end() && place->energy_j - rest.energy_j < same_j) {
    *place = std::move(rest);
    return;
  }
  if (place != pool.begin() && rest.energy_j - std::prev(place)->energy_j < same_j) return;
  pool.insert(place, std::move(rest));
  if (pool.size() > most) pool.pop_back();
}

/// At rest from `from`, apart from itself; from the scene's start where that is empty.
std::optional<StaticDrape> settle(const StaticCase& the_case, const GridSpec& grid,
                                  const StaticOptions& options, const Field& from,
                                  const GridSpec& of) {
  StaticOptions how = options;
  how.threads = 1;
  how.falls = false;
  how.cloth_thickness_m = 0;  // what would meet itself is no such rest
  StaticDrape drape =
      drape_statically(the_case, grid, how, [&](const GridSpec& here, Field& position) {
        if (!from.empty()) position = prolong(from, of, here);
      });
  const bool good = drape.report.status == StaticStatus::at_rest &&
                    drape.report.touching + drape.report.between == 0 &&
                    self_distance(grid, drape.position).crossings == 0;
  if (!good) return std::nullopt;
  return drape;
}

}  // namespace

std::vector<StaticDrape> seek_valleys(const StaticCase& the_case, const GridSpec& grid,
                                      const StaticOptions& options,
                                      const std::vector<const Field*>& rests,
                                      const ValleySearch& how) {
  const auto fewer = [&](int points) { return std::min(points, how.particles); };
  const GridSpec coarse{fewer(grid.rows), fewer(grid.cols), grid.patch_m};
  StaticOptions rough = options;
  rough.judge_stability = false;
  const std::size_t most = std::max(how.parents, how.finished);
  std::vector<Rest> pool;
  const auto settle_all = [&](const std::vector<Field>& from, const GridSpec& of,
                              const GridSpec& to, const StaticOptions& with) {
    std::vector<std::optional<StaticDrape>> found(from.size());
    parallel_for(from.size(), options.threads,
                 [&](std::size_t k) { found[k] = settle(the_case, to, with, from[k], of); });
    return found;
  };
  const auto take = [&](std::vector<std::optional<StaticDrape>> found) {
    for (std::optional<StaticDrape>& drape : found) {
      if (!drape) continue;
      const double energy_j = drape->report.history.back().sum_j();
      keep(pool, {std::move(drape->position), energy_j}, most);
    }
  };
  std::vector<Field> starts(1);  // the scene's own
  for (const Field* rest : rests) starts.push_back(*rest);
  take(settle_all(starts, grid, coarse, rough));
  for (int done = 0; done < how.kicks && !pool.empty(); done += how.together) {
    const int parents = std::min(how.parents, static_cast<int>(pool.size()));
    starts.clear();
    for (int k = 0; k < how.together; ++k) {
      starts.push_back(pool[k % parents].position);
      kick(coarse, done + k, starts.back());
    }
    take(settle_all(starts, coarse, coarse, rough));
  }
  starts.clear();
  for (std::size_t k = 0; k < pool.size() && k < static_cast<std::size_t>(how.finished); ++k)
    starts.push_back(std::move(pool[k].position));
  std::vector<StaticDrape> finished;
  for (std::optional<StaticDrape>& drape : settle_all(starts, coarse, grid, options)) {
    if (drape) finished.push_back(std::move(*drape));
  }
  return finished;
}

std::optional<MirrorPlane> MirrorPlane::of(const StaticCase& the_case) {
  const Scene& scene = the_case.scene;
  if (scene.pins.size() < 2 || !scene.clamps.empty() || !scene.gravity_m_per_s2.head<2>().isZero(0))
    return std::nullopt;
  std::vector<Vector3d> places;
  MirrorPlane plane;
  const auto count = static_cast<double>(scene.pins.size());
  for (const Pin& pin : scene.pins) {
    if (!pin.point_in_world) return std::nullopt;
    places.push_back(*pin.point_in_world);
    plane.point_ += places.back() / count;
    plane.pinned_m_ += pin.material_m(the_case.print) / count;
  }
  const auto far_from_middle = [&](const Vector3d& a, const Vector3d& b) {
    return (a - plane.point_).head<2>().norm() < (b - plane.point_).head<2>().norm();
  };
  const Vector3d along =
      *std::max_element(places.begin(), places.end(), far_from_middle) - plane.point_;
  if (along.head<2>().norm() < kInPlane) return std::nullopt;
  plane.normal_ = Vector3d(-along.y(), along.x(), 0).normalized();
  for (const Vector3d& place : places) {
    if (std::abs(plane.normal_.dot(place - plane.point_)) > kInPlane) return std::nullopt;
  }
  const double start = -plane.normal_.dot(plane.point_);  // its middle is the origin
  const double x = plane.normal_.x(), y = plane.normal_.y();
  const double side = std::abs(start) > kInPlane ? start : std::abs(x) > kInPlane ? x : y;
  if (side < 0) plane.normal_ = -plane.normal_;
  return plane;
}

/// The sheet's middle of mass lies in the plane, so what is farther from the pins counts more.
bool MirrorPlane::is_reported(const GridSpec& grid, const Field& position) const {
  double sum = 0;
  for (int i = 0; i < grid.count(); ++i) {
    const Eigen::Vector2d from_pins = material_of(grid, i / grid.cols, i % grid.cols) - pinned_m_;
    sum += from_pins.squaredNorm() * normal_.dot(at(position, i) - point_);
  }
  return sum >= 0;
}

void MirrorPlane::mirror(Field& position) const {
  for (int i = 0, n = static_cast<int>(position.size() / 3); i < n; ++i) {
    const Vector3d p = at(position, i);
    put_at(position, i, p - 2 * normal_.dot(p - point_) * normal_);
  }
}

}  // namespace drape::simulate
