// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/relaxation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr int kBoundsEvery = 100;  // steps between two sets of fictitious masses
constexpr int kReportEvery = 100;  // steps between two looks at the residual

double height_energy(const MeshCloth& cloth, const MeshCloth::State& state, const Vector3d& g) {
  double sum = 0;
  for (int i = 0; i < cloth.points(); ++i) sum -= cloth.mass_kg()[i] * g.dot(state[i]);
  return sum;
}

}  // namespace

RelaxationReport relax(MeshCloth& cloth, MeshCloth::State& state, const std::vector<bool>& held,
                       const Contact& contact, const RelaxationOptions& options) {
  const auto n = static_cast<std::size_t>(cloth.unknowns());
  const int points = cloth.points();
  MeshCloth::State force(n), velocity(n, Vector3d::Zero()), normal(n, Vector3d::Zero());
  std::vector<double> mass;
  const double weight = options.gravity_m_per_s2.norm() *
                        std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0) /
                        points;
  RelaxationReport report;
  double before = 0;
  for (int step = 0; step < options.most_steps; ++step) {
    if (step % kBoundsEvery == 0) {
      mass = cloth.stiffness_bounds(state);
      for (double& m : mass) m *= options.masses;
    }
    std::fill(force.begin(), force.end(), Vector3d::Zero());
    cloth.add_forces(state, force);
    for (int i = 0; i < points; ++i) force[i] += cloth.mass_kg()[i] * options.gravity_m_per_s2;
    double kinetic = 0, largest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (held[i]) continue;
      Vector3d f = force[i];
      const double push = -f.dot(normal[i]);
      if (push > 0) f -= f.dot(normal[i]) * normal[i];
      // From the velocity and not by stopping points, which would end all motion with each stop.
      if (contact.friction > 0 && push > 0) {
        const double bears = contact.friction * push, along = f.norm();
        velocity[i] += f / mass[i];
        const double speed = velocity[i].norm(), stopped = bears / mass[i];
        velocity[i] *= speed > stopped ? 1 - stopped / speed : 0;
        force[i] = speed > stopped ? (-push * normal[i]).eval() : Vector3d::Zero().eval();
        f *= along > bears ? 1 - bears / along : 0;
      }
      if (i < static_cast<std::size_t>(points)) largest = std::max(largest, f.norm());
      velocity[i] += force[i] / mass[i];
      kinetic += mass[i] * velocity[i].squaredNorm();
    }
    report.steps = step + 1;
    report.residual = largest / weight;
    if (!std::isfinite(kinetic)) return report;
    if (step % kReportEvery == 0 && report.residual <= options.residual) {
      report.at_rest = true;
      break;
    }
    if (kinetic < before) {
      std::fill(velocity.begin(), velocity.end(), Vector3d::Zero());
      kinetic = 0;
    }
    before = kinetic;
    for (std::size_t i = 0; i < n; ++i) {
      if (held[i]) continue;
      state[i] += velocity[i];
      if (!contact.project || i >= static_cast<std::size_t>(points)) continue;
      // Rounding must not lift a point that friction stops, or it would creep.
      if (contact.friction > 0 && velocity[i].isZero(0)) continue;
      Vector3d outward = Vector3d::Zero();
      if (contact.project(state[i], outward)) {
        velocity[i] -= std::min(0.0, velocity[i].dot(outward)) * outward;
        normal[i] = outward;
      } else {
        normal[i].setZero();
      }
    }
  }
  cloth.settle(state);
  report.dissipated_j = cloth.dissipated_j();
  report.energy_j =
      cloth.energies(state).sum_j() + height_energy(cloth, state, options.gravity_m_per_s2);
  return report;
}

}  // namespace drape::simulate
