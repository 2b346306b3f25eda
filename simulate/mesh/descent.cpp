// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/descent.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using State = MeshCloth::State;

constexpr double kSink_m = 0.5e-3;  // depth of cloth in the table, by its own weight
// Relative to the wall's radius; the checker takes it as on the wall
constexpr double kOnWall = 1e-5;
constexpr double kWallWeights = 100;  // mean weights of a point that press it in so far
// Relative to the slope, that a step must gain (Nocedal and Wright)
constexpr double kArmijo = 1e-4;
constexpr double kRounding = 1e-14;                // relative to the energy, that a step may lose
constexpr double kShorter = 0.5, kShortest = 0.1;  // relative to a step that was too long
constexpr int kTries = 12;
constexpr double kFlat = 1e-8;  // relative to a step's slope: less curvature is not remembered

Eigen::Map<Eigen::VectorXd> flat(State& state) {
  return {state.front().data(), 3 * static_cast<Eigen::Index>(state.size())};
}

/// Energy, forces and what supports the cloth.
class Potential {
 public:
  Potential(const MeshCloth& cloth, const std::vector<bool>& held, const Drapemeter& bodies,
            const DescentOptions& options, Pushes* pushes)
      : cloth_(cloth),
        held_(held),
        bodies_(bodies),
        gravity_(options.gravity_m_per_s2),
        inertia_(options.inertia),
        pushes_(pushes) {
    const double mass = std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
    weight_n_ = gravity_.norm() * mass / cloth.points();
    wall_n_per_m_ = kWallWeights * weight_n_ / (kOnWall * std::max(bodies.wall_radius_m, 1e-9));
    for (const MaterialMesh::Edge& edge : cloth.mesh().edges)
      side_m_ += (cloth.mesh().points_m[edge.to] - cloth.mesh().points_m[edge.from]).norm() /
                 static_cast<double>(cloth.mesh().edges.size());
  }

  [[nodiscard]] double mean_side_m() const { return side_m_; }

  /// Internal and of height.
  [[nodiscard]] double own_energy_j(const State& state) const {
    double sum = cloth_.energies(state).sum_j();
    for (int i = 0; i < cloth_.points(); ++i) sum -= cloth_.mass_kg()[i] * gravity_.dot(state[i]);
    return sum;
  }
  struct Balance {
    double energy_j = 0;         ///< with what wall, table and the rest hold, and inertia
    double point = 0, side = 0;  ///< residuals, as in the options
    double reported = 0;         ///< on points, less what support takes; as the checker has it
  };
  /// Sets minus the energy's gradient, nothing where held.
  Balance balance(const State& state, State& force) const {
    Balance found;
    std::fill(force.begin(), force.end(), Vector3d::Zero());
    found.energy_j = cloth_.add_forces(state, force).sum_j();
    for (int i = 0; i < cloth_.points(); ++i) {
      const Vector3d weight = cloth_.mass_kg()[i] * gravity_;
      found.energy_j -= weight.dot(state[i]);
      force[i] += weight;
    }
    if (pushes_ != nullptr) {
      found.energy_j += pushes_->energy_j(state);
      pushes_->add_forces(state, force);
    }
    visit_inertia([&](int i, double stiffness) {
      const Vector3d away = state[i] - inertia_->towards[i];
      found.energy_j += stiffness / 2 * away.squaredNorm();
      force[i] -= stiffness * away;
    });
    std::vector<int> supported;
    visit_supports(state, [&](int i, const Vector3d& normal, double depth, double stiffness) {
      const Vector3d along = force[i] - std::min(0.0, force[i].dot(normal)) * normal;
      found.reported = std::max(found.reported, along.norm() / weight_n_);
      found.energy_j += stiffness / 2 * depth * depth;
      supported.push_back(i);
      force[i] += stiffness * depth * normal;
    });
    auto next = supported.begin();
    for (int i = 0; i < cloth_.unknowns(); ++i) {
      if (held_[i]) force[i].setZero();
      if (i >= cloth_.points()) {
        found.side = std::max(found.side, force[i].norm() / (weight_n_ * side_m_));
        continue;
      }
      const double size = force[i].norm() / weight_n_;
      found.point = std::max(found.point, size);
      while (next != supported.end() && *next < i) ++next;
      if (next == supported.end() || *next != i) found.reported = std::max(found.reported, size);
    }
    return found;
  }
  [[nodiscard]] std::vector<Support> supports(const State& state) const {
    std::vector<Support> found;
    visit_supports(state, [&](int i, const Vector3d& normal, double, double stiffness) {
      found.push_back({i, i, stiffness * normal * normal.transpose()});
    });
    visit_inertia([&](int i, double stiffness) {
      found.push_back({i, i, stiffness * Matrix3d::Identity()});
    });
    if (pushes_ == nullptr) return found;
    const auto others = pushes_->supports(state);
    found.insert(found.end(), others.begin(), others.end());
    return found;
  }

 private:
  /// visit(point, normal, depth, N/m) for each point in the table or in the wall.
  template <class Visit>
  void visit_supports(const State& state, Visit visit) const {
    for (int i = 0; i < cloth_.points(); ++i) {
      if (held_[i]) continue;
      const Vector3d& p = state[i];
      if (p.z() < bodies_.table_z_m)
        visit(i, Vector3d::UnitZ(), bodies_.table_z_m - p.z(),
              bodies_.table_n_per_m3 > 0 ? cloth_.area_m2()[i] * bodies_.table_n_per_m3
                                         : cloth_.mass_kg()[i] * gravity_.norm() / kSink_m);
      const double r = p.head<2>().norm();
      if (p.z() < 0 && r < bodies_.wall_radius_m && r > 0)
        visit(i, Vector3d(p.x() / r, p.y() / r, 0), bodies_.wall_radius_m - r, wall_n_per_m_);
    }
  }

  /// visit(point, N/m) for each free point of a cloth in motion.
  template <class Visit>
  void visit_inertia(Visit visit) const {
    if (inertia_ == nullptr) return;
    for (int i = 0; i < cloth_.points(); ++i)
      if (!held_[i]) visit(i, inertia_->per_s2 * cloth_.mass_kg()[i]);
  }

  const MeshCloth& cloth_;
  const std::vector<bool>& held_;
  const Drapemeter& bodies_;
  Vector3d gravity_;
  const Inertia* inertia_;
  Pushes* pushes_;
  double weight_n_ = 0, wall_n_per_m_ = 0, side_m_ = 0;
};

/// Steps and what the forces lost over them; the newest last.
class Pairs {
 public:
  explicit Pairs(int most) : most_(static_cast<std::size_t>(most)) {}
  [[nodiscard]] bool empty() const { return pairs_.empty(); }
  void clear() { pairs_.clear(); }
  void add(const Eigen::VectorXd& step, const Eigen::VectorXd& lost, double product) {
    if (pairs_.size() >= most_) {
      pairs_.push_back(std::move(pairs_.front()));
      pairs_.pop_front();
    } else {
      pairs_.emplace_back();
    }
    pairs_.back().step = step.cast<float>();
    pairs_.back().lost = lost.cast<float>();
    pairs_.back().product = product;
  }
  /// The inverse of what they tell of the second derivatives, times a force, in place.
  void apply(State& force, const MeshStiffness& stiffness) const {
    std::vector<double> taken(pairs_.size());
    for (std::size_t k = pairs_.size(); k-- > 0;) {
      taken[k] = pairs_[k].step.cast<double>().dot(flat(force)) / pairs_[k].product;
      flat(force) -= taken[k] * pairs_[k].lost.cast<double>();
    }
    stiffness.solve(force);
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
      const double put = pairs_[k].lost.cast<double>().dot(flat(force)) / pairs_[k].product;
      flat(force) += (taken[k] - put) * pairs_[k].step.cast<double>();
    }
  }

 private:
  struct Pair {
    Eigen::VectorXf step, lost;  ///< single precision: they only choose the next step
    double product = 0;
  };
  std::size_t most_;
  std::deque<Pair> pairs_;
};

}  // namespace

DescentReport descend(MeshCloth& cloth, State& state, const std::vector<bool>& held,
                      MeshStiffness& stiffness, const Drapemeter& bodies,
                      const DescentOptions& options, Pushes* pushes) {
  const Potential potential(cloth, held, bodies, options, pushes);
  State force(state.size()), step(state.size()), next(state.size()), next_force(state.size());
  Pairs pairs(options.pairs);
  Eigen::VectorXd moved(3 * static_cast<Eigen::Index>(state.size())), lost(moved.size());
  DescentReport report;
  Potential::Balance now = potential.balance(state, force);
  if (!options.keep_matrix) stiffness.outdate();
  while (std::isfinite(now.energy_j)) {
    report.at_rest = std::max(now.point, now.side) <= options.residual;
    if (report.at_rest || report.steps >= options.most_steps) break;
    if (stiffness.solves() >= options.factor_every &&
        !stiffness.factorise(state, potential.supports(state)))
      break;
    step = force;
    pairs.apply(step, stiffness);
    const double slope = flat(force).dot(flat(step));
    double far = 0;
    for (int i = 0; i < cloth.points(); ++i) far = std::max(far, step[i].norm());
    double part = std::min(1.0, options.farthest_step * potential.mean_side_m() / far);
    if (pushes != nullptr && slope > 0) {
      flat(next) = flat(state) + part * flat(step);
      part *= pushes->clear_part(state, next, false);
    }
    Potential::Balance then;
    bool down = false;
    int tries = 0;
    for (; slope > 0 && tries < kTries && !down; ++tries) {
      flat(next) = flat(state) + part * flat(step);
      then = potential.balance(next, next_force);
      const double gain = now.energy_j - then.energy_j;
      down = gain >= kArmijo * part * slope - kRounding * std::abs(now.energy_j);
      if (down) break;
      // The least of the parabola through both energies and the slope.
      const double least = slope * part * part / (2 * (slope * part - gain));
      part = std::isfinite(least) ? std::clamp(least, kShortest * part, kShorter * part)
                                  : kShortest * part;
    }
    if (!down) {
      // With a fresh matrix and nothing remembered nothing but rounding leads down.
      if (pairs.empty() && stiffness.solves() == 1) break;
      pairs.clear();
      stiffness.outdate();
      continue;
    }
    moved = flat(next) - flat(state);
    lost = flat(force) - flat(next_force);
    const double product = moved.dot(lost);
    if (product > kFlat * part * slope) pairs.add(moved, lost, product);
    if (tries > 1) stiffness.outdate();
    std::swap(state, next);
    std::swap(force, next_force);
    now = then;
    ++report.steps;
  }
  cloth.settle(state);
  if (pushes != nullptr) pushes->settle(state);
  report.residual = now.reported;
  report.dissipated_j = cloth.dissipated_j();
  report.energy_j = potential.own_energy_j(state);
  return report;
}

}  // namespace drape::simulate
