// SPDX-License-Identifier: Apache-2.0
// What a moving sheet is asked: its energies, and what force is left on it.
#include <algorithm>
#include <cmath>

#include "simulate/dynamics/motion.hpp"

namespace drape::simulate {

using Eigen::Vector3d;

double Motion::kinetic_energy_j() const {
  const std::size_t n = inverse_mass_.size();
  const std::vector<double>& mass = cloth_.mass_kg();
  double twice = 0;
  for (std::size_t i = 0; i < n; ++i) {
    twice += mass[i] * (velocity[i] * velocity[i] + velocity[n + i] * velocity[n + i] +
                        velocity[2 * n + i] * velocity[2 * n + i]);
  }
  return 0.5 * twice;
}

double Motion::gravity_energy_j() const {
  double sum = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    sum -= cloth_.mass_kg()[i] * at(position, i).dot(options_.gravity_m_per_s2);
  }
  return sum;
}

double Motion::residual() {
  std::fill(net_.begin(), net_.end(), 0.0);
  cloth_.add_forces(position, nullptr, net_);
  if (options_.contact_between_particles) {
    line_contacts_.choose_all();
    line_contacts_.add_forces(position, nullptr, net_);
  }
  pair_contacts_.watch(position, path_m_, kChooseMargin);
  pair_contacts_.add_forces(position, nullptr, net_);
  const int n = cloth_.count();
  for (int i = 0; i < n; ++i) {
    Vector3d pull = at(net_, i) * inverse_mass_[i] + options_.gravity_m_per_s2;
    if (touch_of_[i] >= 0) {
      const Vector3d& normal = touching_[touch_of_[i]].normal;
      const double outward = pull.dot(normal);
      if (outward < 0) {
        pull -= outward * normal;
        const double size = pull.norm();
        const double held = -options_.friction * outward;
        pull *= size <= held ? 0.0 : 1 - held / size;
      }
    }
    put_at(net_, i, pull);
  }
  for (const int i : no_cloth_) put_at(net_, i, Vector3d::Zero());
  project_holds(net_);
  double largest = 0;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double force = at(net_, i).norm() * cloth_.mass_kg()[i];
    largest = std::max(largest, force);
    sum += force * force;
  }
  const auto whole = static_cast<double>(n - static_cast<int>(no_cloth_.size()));
  const double weight = cloth_.total_mass_kg() * options_.gravity_m_per_s2.norm() / whole;
  residual_rms_ = std::sqrt(sum / whole) / weight;
  return largest / weight;
}

}  // namespace drape::simulate
