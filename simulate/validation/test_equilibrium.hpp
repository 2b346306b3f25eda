// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

/// Newton's method on the forces of a Cloth for the closed-form checks: small sheets without
/// contact, single coordinates held. The tangent comes from coloured central differences of the
/// public forces, so that the check depends on nothing but those forces.
class Equilibrium {
 public:
  /// `load` is a constant force per coordinate (N); `held` marks coordinates that do not move.
  /// Residuals are relative to `force_scale_n`; 0 means the largest load.
  Equilibrium(Cloth& cloth, Field load, std::vector<bool> held, double force_scale_n = 0);

  /// Net force on the free coordinates; 0 on held ones.
  [[nodiscard]] Field net_force(const Field& x);
  /// Minus the derivative of the net force over the free coordinates (N/m), made symmetric.
  [[nodiscard]] Eigen::SparseMatrix<double> tangent(const Field& x);
  /// Largest difference between the derivative and its transpose, over the largest entry.
  [[nodiscard]] double asymmetry() const { return asymmetry_; }

  struct Outcome {
    bool found = false;
    int iterations = 0;
    double residual = 0;  ///< largest net force over the force scale
  };
  /// Walks to a stable equilibrium near x; every coordinate by at most `stride` per iteration.
  Outcome find(Field& x, double stride, int most_iterations = 3000);
  /// Directions in which the energy falls at x: 0 for a stable equilibrium.
  [[nodiscard]] int unstable_directions(const Field& x);

 private:
  [[nodiscard]] double energy(const Field& x) const;
  [[nodiscard]] double largest(const Field& f) const;

  Cloth& cloth_;
  Field load_;
  std::vector<int> free_;      ///< coordinates
  std::vector<int> position_;  ///< place of a coordinate in free_, -1 when held
  double force_scale_n_ = 0;
  double asymmetry_ = 0;
};

}  // namespace drape::simulate
