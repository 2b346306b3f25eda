// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/valleys.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.hpp"
#include "core/statistics/random.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/equilibrium/prolong.hpp"

namespace drape::simulate {

namespace {

using Eigen::Vector3d;

constexpr double kInPlane = 1e-9;      // m
constexpr double kSameEnergy = 1e-6;   // relative to the energy; nearer rests are one
constexpr double kFirstStep_s = 0.03;  // step of pseudo-time, as on a finer grid

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
  /// True if it is among the lowest.
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

using Eigen::Vector2d;

constexpr double kTurn = 1.2;    // rad, by which a side hangs down; upright sides would meet
constexpr double kRound = 0.05;  // relative to the pins' distance in the sheet: the fold's radius
constexpr double kHigh = 0.1;    // relative to that distance: the height of waves
constexpr double kSteep = 1e-3;  // horizontal part of the pins' direction below which none is seen

/// The line through the pins, in the sheet and in the world.
struct Line {
  Vector2d from_m, along_m, across_m;
  Vector3d from, along, across, down;
  double length_m = 0;
};

/// True if there is sheet to hang on either side.
bool parts(const Line& line, const Vector2d& patch_m) {
  double least = 0, most = 0;
  for (const Vector2d& part : {Vector2d(0, 0), Vector2d(0, 1), Vector2d(1, 0), Vector2d(1, 1)}) {
    const double d = (part.cwiseProduct(patch_m) - line.from_m).dot(line.across_m);
    least = std::min(least, d);
    most = std::max(most, d);
  }
  return std::min(most, -least) > kRound * line.length_m;
}

/// `halves`: of a wave along the fold between the pins, the sign its side.
void fold(const Line& line, bool left, bool right, int halves, const GridSpec& grid,
          Field& position) {
  const double round_m = kRound * line.length_m;
  for (int i = 0; i < grid.count(); ++i) {
    const Vector2d from_pin = material_of(grid, i / grid.cols, i % grid.cols) - line.from_m;
    const double s = from_pin.dot(line.along_m), d = from_pin.dot(line.across_m);
    const double between = std::clamp(s / line.length_m, 0.0, 1.0);
    const double turn = (d < 0 ? left : right) ? kTurn : 0.0, far = std::abs(d);
    const double bent = std::min(far / round_m, turn), straight = far - round_m * bent;
    const double out = round_m * std::sin(bent) + straight * std::cos(turn);
    const double low = round_m * (1 - std::cos(bent)) + straight * std::sin(turn);
    const double wave = kHigh * line.length_m * std::sin(halves * std::numbers::pi * between);
    put_at(position, i,
           line.from + s * line.along + (std::copysign(out, d) + wave) * line.across +
               low * line.down);
  }
}

// Shares of the patch: reach of a moved part, and how far it moves.
constexpr double kLeastPart = 0.15, kMostPart = 0.6, kLeastMove = 0.02, kMostMove = 0.15;
// Shares of the patch: how far from its border a line crosses it, and how wide the border of two
// rests is.
constexpr double kInside = 0.2, kLeastBorder = 0.1, kMostBorder = 0.5;
// Every eighth: it costs three times a move, for more of the sheet has to settle.
constexpr std::uint64_t kMirrored = 8;

class Draw {
 public:
  /// Neighbouring seeds would be one sequence with a shift, so a seed is mixed first.
  explicit Draw(std::uint64_t seed) : random_(SplitMix64(seed).next()) {}
  double uniform(double low, double high) { return low + (high - low) * random_.uniform(); }
  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(uniform(0, static_cast<double>(count))));
  }

 private:
  SplitMix64 random_;
};

/// Material place of a particle, of the patch.
Vector2d place_of(const GridSpec& grid, int i) {
  return {int{i / grid.cols} / (grid.rows - 1.0), (i % grid.cols) / (grid.cols - 1.0)};
}

/// With a round part of the sheet moved across its own plane of least spread, or mirrored in it,
/// which turns a fold inside out.
Field moved_part(const GridSpec& grid, Draw& draw, bool mirrors, Field x) {
  const Vector2d centre(draw.uniform(0, 1), draw.uniform(0, 1));
  const double reach = draw.uniform(kLeastPart, kMostPart);
  const double side = std::max(grid.patch_m.x(), grid.patch_m.y());
  const double move =
      side * draw.uniform(kLeastMove, kMostMove) * (draw.uniform(-1, 1) < 0 ? -1 : 1);
  std::vector<double> weight(grid.count());
  double total = 0;
  Vector3d middle = Vector3d::Zero();
  for (int i = 0; i < grid.count(); ++i) {
    const double square = (place_of(grid, i) - centre).squaredNorm();
    const double inside = std::max(0.0, 1 - square / (reach * reach));
    weight[i] = std::min(1.0, 2 * inside * inside);
    total += weight[i];
    middle += weight[i] * at(x, i);
  }
  if (!(total > 0)) return x;
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
    const double by = mirrors ? -2 * (p - middle).dot(across) : move;
    put_at(x, i, p + weight[i] * by * across);
  }
  return x;
}

/// With what lies beyond a line taken from another rest.
Field spliced(const GridSpec& grid, Draw& draw, Field x, const Field& other) {
  const Vector2d on_line(draw.uniform(kInside, 1 - kInside), draw.uniform(kInside, 1 - kInside));
  const double angle = draw.uniform(0, 2 * std::numbers::pi);
  const double border = draw.uniform(kLeastBorder, kMostBorder);
  const Vector2d beyond(std::cos(angle), std::sin(angle));
  for (int i = 0; i < grid.count(); ++i) {
    const double far = (place_of(grid, i) - on_line).dot(beyond);
    const double t = std::clamp(far / border + 0.5, 0.0, 1.0);
    const double part = t * t * (3 - 2 * t);
    put_at(x, i, (1 - part) * at(x, i) + part * at(other, i));
  }
  return x;
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
  exact.cloth_thickness_m = 0;  // a sheet that would meet itself is no rest that is sought
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

std::vector<StartChange> folded_starts(const StaticCase& the_case) {
  const std::vector<Pin>& pins = the_case.scene.pins;
  if (pins.size() != 2 || !the_case.scene.clamps.empty() || !pins[0].point_in_world ||
      !pins[1].point_in_world)
    return {};
  Line line;
  line.from_m = pins[0].material_m(the_case.print);
  line.from = *pins[0].point_in_world;
  const Vector2d in_sheet = pins[1].material_m(the_case.print) - line.from_m;
  const Vector3d in_world = *pins[1].point_in_world - line.from;
  line.length_m = in_sheet.norm();
  const Vector3d up = -the_case.scene.gravity_m_per_s2.normalized();
  if (!(up.cross(in_world).norm() > kSteep * in_world.norm()) || !(line.length_m > 0)) return {};
  line.along_m = in_sheet / line.length_m;
  line.across_m = {-line.along_m.y(), line.along_m.x()};
  line.along = in_world.normalized();
  line.across = up.cross(line.along).normalized();
  line.down = line.across.cross(line.along);
  if (line.down.dot(up) > 0) line.down = -line.down;
  if (!parts(line, the_case.print.patch_m)) return {};
  line.from += 0.5 * (in_world.norm() - line.length_m) * line.along;
  std::vector<StartChange> starts;
  for (const auto& [left, right] : {std::pair(true, false), {false, true}, {true, true}}) {
    for (const int halves : {0, 1, -1}) {
      if (left && right && halves == 0) continue;  // it balances on its pins and ends higher
      starts.emplace_back(
          [line, l = left, r = right, halves](const GridSpec& grid, Field& position) {
            fold(line, l, r, halves, grid, position);
          });
    }
  }
  return starts;
}

Field kicked(const GridSpec& grid, std::uint64_t index, const std::vector<const Field*>& rests) {
  Draw draw(index);
  const Field& rest = *rests[draw.below(rests.size())];
  if (index % 2 == 0) return spliced(grid, draw, rest, *rests[draw.below(rests.size())]);
  return moved_part(grid, draw, index % kMirrored == 1, rest);
}

}  // namespace drape::simulate
