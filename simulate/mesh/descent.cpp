// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/descent.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using State = MeshCloth::State;

constexpr double kSink_m = 0.5e-3;  // depth of cloth in the table under its own weight
// relative to the wall's radius; the checker accepts it as on the wall
constexpr double kOnWall = 1e-5;
constexpr double kWallWeights = 100;  // mean point weights that press it in by this depth
// Least decrease of a step, relative to the slope (Nocedal and Wright).
constexpr double kArmijo = 1e-4;
constexpr double kRounding = 1e-14;  // largest increase due to rounding, relative to the energy
constexpr double kShorter = 0.5, kShortest = 0.1;  // new length of a rejected step, relative to it
constexpr int kTries = 20;
// Norm of the residual of a linear solution, relative to the right-hand side; its largest force,
// relative to the residual required of the descent.
constexpr double kSolved = 0.3, kOfResidual = 0.25;
constexpr double kPassingPart = 0.25;  // see DescentOptions::passing
constexpr int kProducts = 60;          // limit per step
// Products of a step, and displacement in mean sides, below which the next step keeps the matrix.
constexpr int kFewProducts = 20;
constexpr double kKeepsMatrix = 0.05;

Eigen::Map<Eigen::VectorXd> flat(State& state) {
  return {state.front().data(), 3 * static_cast<Eigen::Index>(state.size())};
}

/// Energy and forces of the cloth with its supports.
class Potential {
 public:
  Potential(const MeshCloth& cloth, const std::vector<bool>& held, const Drapemeter& bodies,
            const DescentOptions& options, Pushes* pushes)
      : cloth_(cloth),
        held_(held),
        bodies_(bodies),
        gravity_(options.gravity_m_per_s2),
        inertia_(options.inertia),
        pushes_(pushes),
        side_m_(cloth.mesh().mean_side_m()) {
    const double mass = std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
    weight_n_ = gravity_.norm() * mass / cloth.points();
    wall_n_per_m_ = kWallWeights * weight_n_ / (kOnWall * std::max(bodies.wall_radius_m, 1e-9));
  }

  /// Largest force: on a point in mean point weights, on a side in that unit times the mean side.
  [[nodiscard]] double largest(const State& force) const {
    double points2 = 0, sides2 = 0;
    for (int i = 0; i < cloth_.unknowns(); ++i) {
      double& most2 = i < cloth_.points() ? points2 : sides2;
      most2 = std::max(most2, force[i].squaredNorm());
    }
    return std::max(std::sqrt(points2), std::sqrt(sides2) / side_m_) / weight_n_;
  }
  [[nodiscard]] double mean_side_m() const { return side_m_; }

  /// Internal plus gravity energy.
  [[nodiscard]] double own_energy_j(const State& state) const {
    double sum = cloth_.energies(state).sum_j();
    for (int i = 0; i < cloth_.points(); ++i) sum -= cloth_.mass_kg()[i] * gravity_.dot(state[i]);
    return sum;
  }
  struct Balance {
    double energy_j = 0;         ///< including wall, table, other pushes and inertia
    double point = 0, side = 0;  ///< residuals in the units of the options
    double reported = 0;         ///< on points, minus support forces, as in the checker
  };
  /// Sets `force` to the negative gradient of the energy, zero for held unknowns.
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
  /// Sets `product` to the second derivative of the energy times a direction, zero for held
  /// unknowns. Contacts keep their state.
  void set_products(const State& state, const ClothTangent& tangent, const State& direction,
                    State& product) const {
    std::fill(product.begin(), product.end(), Vector3d::Zero());
    tangent.add_products(direction, product);
    if (pushes_ != nullptr) pushes_->add_products(state, direction, product);
    visit_inertia([&](int i, double stiffness) { product[i] += stiffness * direction[i]; });
    visit_supports(state, [&](int i, const Vector3d& normal, double, double stiffness) {
      product[i] += stiffness * normal.dot(direction[i]) * normal;
    });
    for (int i = 0; i < cloth_.unknowns(); ++i)
      if (held_[i]) product[i].setZero();
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
  /// Calls visit(point, normal, depth, N/m) for each point inside the table or wall.
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

  /// Calls visit(point, N/m) for each free point of a cloth in motion.
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
  double side_m_, weight_n_ = 0, wall_n_per_m_ = 0;
};

}  // namespace

DescentReport descend(MeshCloth& cloth, State& state, const std::vector<bool>& held,
                      MeshStiffness& stiffness, const Drapemeter& bodies,
                      const DescentOptions& options, Pushes* pushes) {
  const Potential potential(cloth, held, bodies, options, pushes);
  State force(state.size()), next(state.size()), next_force(state.size()), left, step;
  DescentReport report;
  Potential::Balance now = potential.balance(state, force);
  const double residual = std::max(
      options.residual, std::min(options.passing, kPassingPart * std::max(now.point, now.side)));
  // A matrix that was formed with another inertia is a poor preconditioner.
  if (options.inertia != nullptr) stiffness.outdate();
  while (std::isfinite(now.energy_j)) {
    report.at_rest = std::max(now.point, now.side) <= residual;
    if (report.at_rest || report.steps >= options.most_steps) break;
    if (!stiffness.serves(state, kKeepsMatrix * potential.mean_side_m()) &&
        !stiffness.factorise(state, potential.supports(state)))
      break;
    const ClothTangent tangent(cloth, state);
    left = force;
    const ConjugateGradients found = conjugate_gradients(
        stiffness,
        [&](const State& direction, State& product) {
          potential.set_products(state, tangent, direction, product);
        },
        [&](double norm, const State& of) {
          return norm <= kSolved || potential.largest(of) <= kOfResidual * residual;
        },
        kProducts, left, step);
    if (!found.positive || found.products > kFewProducts) stiffness.outdate();
    const double slope = flat(force).dot(flat(step));
    if (!(slope > 0)) break;
    double far = 0;
    for (int i = 0; i < cloth.points(); ++i) far = std::max(far, step[i].norm());
    double part = std::min(1.0, options.farthest_step * potential.mean_side_m() / far);
    if (pushes != nullptr) {
      flat(next) = flat(state) + part * flat(step);
      part *= pushes->clear_part(state, next, false);
    }
    Potential::Balance then;
    bool down = false;
    for (int tries = 0; tries < kTries && !down; ++tries) {
      flat(next) = flat(state) + part * flat(step);
      then = potential.balance(next, next_force);
      const double gain = now.energy_j - then.energy_j;
      down = gain >= kArmijo * part * slope - kRounding * std::abs(now.energy_j);
      if (down) break;
      // Minimum of the parabola through both energies and the initial slope.
      const double least = slope * part * part / (2 * (slope * part - gain));
      part = std::isfinite(least) ? std::clamp(least, kShortest * part, kShorter * part)
                                  : kShortest * part;
    }
    if (!down && stiffness.serves(state, 0)) break;
    if (!down) {
      stiffness.outdate();
      continue;
    }
    std::swap(state, next);
    std::swap(force, next_force);
    now = then;
    ++report.steps;
  }
  if (options.inertia != nullptr) stiffness.outdate();
  cloth.settle(state);
  if (pushes != nullptr) pushes->settle(state);
  report.residual = now.reported;
  report.dissipated_j = cloth.dissipated_j();
  report.energy_j = potential.own_energy_j(state);
  return report;
}

}  // namespace drape::simulate
