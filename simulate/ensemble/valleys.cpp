// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/valleys.hpp"

#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/ensemble/folds.hpp"
#include "simulate/ensemble/kicks.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/equilibrium/prolong.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kInPlane = 1e-9;      // m
constexpr double kSameEnergy = 1e-6;   // of the energy; nearer rests are one
constexpr double kFirstStep_s = 0.03;  // of pseudo-time, as on a finer grid

/// Different rests, lowest first.
class Pool {
 public:
  explicit Pool(int most) : most_(most) {}
  [[nodiscard]] bool empty() const { return rests_.empty(); }
  [[nodiscard]] std::vector<const Field*> positions() const {
    std::vector<const Field*> all;
    for (const StaticDrape& rest : rests_) all.push_back(&rest.position);
    return all;
  }
  /// Whether it is among the lowest.
  bool take(StaticDrape rest) {
    const double energy_j = energy_of(rest), same_j = kSameEnergy * std::abs(energy_j);
    const auto place = std::find_if(rests_.begin(), rests_.end(), [&](const StaticDrape& other) {
      return energy_of(other) > energy_j - same_j;
    });
    if (place != rests_.end() && energy_of(*place) < energy_j + same_j) return false;
    if (place == rests_.end() && rests_.size() == most_) return false;
    rests_.insert(place, std::move(rest));
    if (rests_.size() > most_) rests_.pop_back();
    return true;
  }
  [[nodiscard]] std::vector<StaticDrape> rests() && { return std::move(rests_); }

 private:
  static double energy_of(const StaticDrape& rest) { return rest.report.history.back().sum_j(); }
  std::size_t most_;
  std::vector<StaticDrape> rests_;
};

/// By steps as long as they are good: it may end in another fold than motion would.
StaticDrape settle_from(const StaticCase& the_case, const GridSpec& grid, StaticOptions options,
                        const Field& from, const GridSpec& of) {
  options.falls = Falls::never;
  options.paced = false;
  options.first_step_s = kFirstStep_s;
  return drape_statically(the_case, grid, options, [&](const GridSpec& here, Field& position) {
    position = prolong(from, of, here);
  });
}

bool is_valley(const StaticDrape& drape, const GridSpec& grid) {
  const StaticReport& report = drape.report;
  return report.status == StaticStatus::at_rest && report.touching + report.between == 0 &&
         !passes_through_itself(grid, drape.position);
}

/// Where those starts end by motion; layers that meet press on each other.
std::vector<StaticDrape> fallen_from(const std::vector<StartChange>& starts,
                                     const StaticCase& the_case, const GridSpec& grid,
                                     const StaticOptions& options, int most) {
  StaticOptions falls = options;
  falls.threads = 1;
  falls.falls = Falls::first;
  std::vector<StaticDrape> found(starts.size());
  parallel_for(found.size(), options.threads, [&](std::size_t k) {
    found[k] = drape_statically(the_case, grid, falls, starts[k]);
  });
  Pool pool(most);
  for (StaticDrape& drape : found) {
    if (is_valley(drape, grid)) pool.take(std::move(drape));
  }
  return std::move(pool).rests();
}

/// The grids of a search, coarse to fine: where the finest has more than twice the points of the
/// coarsest along a side, one between them.
std::vector<GridSpec> search_grids(const GridSpec& finest, int particles) {
  const auto coarse = [&](int points) { return std::min(points, particles); };
  const auto middle = [&](int points) {
    return static_cast<int>(std::lround(std::sqrt(coarse(points) * points)));
  };
  std::vector<GridSpec> grids{{coarse(finest.rows), coarse(finest.cols), finest.patch_m}};
  if (std::max(finest.rows, finest.cols) > 2 * particles)
    grids.push_back({middle(finest.rows), middle(finest.cols), finest.patch_m});
  grids.push_back(finest);
  return grids;
}

}  // namespace

std::vector<StaticDrape> seek_valleys(const StaticCase& the_case, const GridSpec& grid,
                                      const StaticOptions& options,
                                      const std::vector<const Field*>& rests,
                                      const ValleySearch& how) {
  const std::vector<StartChange> folded = folded_starts(the_case);
  if (!folded.empty()) return fallen_from(folded, the_case, grid, options, how.finished);
  StaticOptions exact = options;
  exact.threads = 1;
  exact.cloth_thickness_m = 0;  // what would meet itself is no rest that is sought
  StaticOptions rough = exact;
  rough.judge_stability = false;
  const auto take = [&](StaticDrape drape, const GridSpec& on, Pool& pool) {
    // A tight fold that a coarse grid keeps apart may have no room on the finest.
    return is_valley(drape, on) &&
           (on.count() == grid.count() ||
            !passes_through_itself(grid, prolong(drape.position, on, grid))) &&
           pool.take(std::move(drape));
  };
  const auto settle_all = [&](std::size_t count, const auto& start, const GridSpec& of,
                              const GridSpec& to, const StaticOptions& with, Pool& pool) {
    std::vector<StaticDrape> found(count);
    parallel_for(count, options.threads,
                 [&](std::size_t k) { found[k] = settle_from(the_case, to, with, start(k), of); });
    int taken = 0;
    for (StaticDrape& drape : found) taken += take(std::move(drape), to, pool);
    return taken;
  };
  const auto carry = [&](const std::vector<const Field*>& from, const GridSpec& of,
                         const GridSpec& to, const StaticOptions& with, Pool& pool) {
    settle_all(
        from.size(), [&](std::size_t k) { return *from[k]; }, of, to, with, pool);
  };
  const auto kick_all = [&](int first, int most, const GridSpec& on, const StaticOptions& with,
                            Pool& pool) {
    for (int done = 0, in_vain = 0; done < most && in_vain < how.in_vain() && !pool.empty();) {
      const int count = std::min(how.together, most - done);
      const std::vector<const Field*> parents = pool.positions();
      const auto start = [&](std::size_t k) { return kicked(on, first + done + k, parents); };
      in_vain = settle_all(count, start, on, on, with, pool) > 0 ? 0 : in_vain + count;
      done += count;
    }
  };
  const std::vector<GridSpec> grids = search_grids(grid, how.particles);
  Pool pool(how.kept);
  StaticOptions own = rough;
  own.falls = Falls::never;
  take(drape_statically(the_case, grids.front(), own), grids.front(), pool);
  carry(rests, grid, grids.front(), rough, pool);
  kick_all(0, how.kicks, grids.front(), rough, pool);
  for (std::size_t k = 1; k < grids.size(); ++k) {
    const bool last = k + 1 == grids.size();
    const StaticOptions& with = last ? exact : rough;
    Pool finer(last ? how.finished : how.kept);
    carry(rests, grid, grids[k], with, finer);
    carry(pool.positions(), grids[k - 1], grids[k], with, finer);
    kick_all(static_cast<int>(k) * how.kicks, last ? how.kicks : how.in_vain(), grids[k], with,
             finer);
    pool = std::move(finer);
  }
  return std::move(pool).rests();
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
