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
  void take(StaticDrape rest) {
    const double energy_j = energy_of(rest), same_j = kSameEnergy * std::abs(energy_j);
    const auto place = std::find_if(rests_.begin(), rests_.end(), [&](const StaticDrape& other) {
      return energy_of(other) > energy_j - same_j;
    });
    if (place != rests_.end() && energy_of(*place) < energy_j + same_j) return;
    rests_.insert(place, std::move(rest));
    if (rests_.size() > most_) rests_.pop_back();
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
    if (is_valley(drape, on) && (on.count() == grid.count() ||
                                 !passes_through_itself(grid, prolong(drape.position, on, grid))))
      pool.take(std::move(drape));
  };
  const auto settle_all = [&](std::size_t count, const auto& start, const GridSpec& of,
                              const GridSpec& to, const StaticOptions& with, Pool& pool) {
    std::vector<StaticDrape> found(count);
    parallel_for(count, options.threads,
                 [&](std::size_t k) { found[k] = settle_from(the_case, to, with, start(k), of); });
    for (StaticDrape& drape : found) take(std::move(drape), to, pool);
  };
  const auto carry = [&](const std::vector<const Field*>& from, const GridSpec& of,
                         const GridSpec& to, const StaticOptions& with, Pool& pool) {
    settle_all(
        from.size(), [&](std::size_t k) { return *from[k]; }, of, to, with, pool);
  };
  const auto kick_all = [&](int first, int count, const GridSpec& on, const StaticOptions& with,
                            Pool& pool) {
    for (int done = 0; done < count && !pool.empty(); done += how.together) {
      const std::vector<const Field*> parents = pool.positions();
      const auto start = [&](std::size_t k) { return kicked(on, first + done + k, parents); };
      settle_all(std::min(how.together, count - done), start, on, on, with, pool);
    }
  };
  const auto fewer = [&](int points) { return std::min(points, how.particles); };
  const GridSpec coarse{fewer(grid.rows), fewer(grid.cols), grid.patch_m};
  Pool pool(how.kept), finest(how.finished);
  StaticOptions own = rough;
  own.falls = Falls::never;
  take(drape_statically(the_case, coarse, own), coarse, pool);
  carry(rests, grid, coarse, rough, pool);
  kick_all(0, how.kicks, coarse, rough, pool);
  carry(rests, grid, grid, exact, finest);
  carry(pool.positions(), coarse, grid, exact, finest);
  kick_all(how.kicks, how.kicks / how.coarse_per_fine, grid, exact, finest);
  return std::move(finest).rests();
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
