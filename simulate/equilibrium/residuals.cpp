// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/residuals.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

namespace drape::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Directions of unit energy, orthogonal to each other, and M times each: so that no product with
/// M is needed.
struct Basis {
  std::vector<VectorXd> displacements, forces;

  /// Takes what is new in `displacement`, M^-1 `force`, and returns its parts along all directions,
  /// the new one last; that is 0 where there is nothing new.
  VectorXd add(VectorXd displacement, VectorXd force) {
    VectorXd parts(displacements.size() + 1);
    for (std::size_t i = 0; i < displacements.size(); ++i) {
      const double part = displacements[i].dot(force);
      displacement -= part * displacements[i];
      force -= part * forces[i];
      parts[static_cast<Index>(i)] = part;
    }
    const double energy = displacement.dot(force);
    const double size = energy > 0 ? std::sqrt(energy) : 0.0;
    parts[parts.size() - 1] = size;
    if (size > 0) {
      displacements.push_back(displacement / size);
      forces.push_back(force / size);
    }
    return parts;
  }
};

}  // namespace

ResidualsLeft minimise_residuals(const NearlySymmetric& system, const VectorXd& right,
                                 VectorXd& answer, double enough, int most) {
  VectorXd product;
  system.multiply(answer, product);
  const VectorXd rest = right - product;
  VectorXd displacement = rest;
  system.solve(displacement);
  ResidualsLeft left{std::max(0.0, displacement.dot(rest)), 1};
  if (!(left.energy > enough)) return left;
  Basis basis;
  VectorXd wanted = VectorXd::Zero(most + 1);
  wanted[0] = basis.add(displacement, rest)[0];
  MatrixXd made = MatrixXd::Zero(most + 1, most);  // by each direction, of all
  VectorXd parts;
  for (Index k = 0; k < most && left.energy > enough; ++k) {
    system.multiply(basis.displacements[k], product);
    displacement = product;
    system.solve(displacement);
    ++left.solves;
    made.col(k).head(k + 2) = basis.add(displacement, product);
    const auto so_far = made.topLeftCorner(k + 2, k + 1);
    parts = so_far.householderQr().solve(wanted.head(k + 2));
    left.energy = (wanted.head(k + 2) - so_far * parts).squaredNorm();
    if (made(k + 1, k) == 0) break;
  }
  for (Index k = 0; k < parts.size(); ++k) answer += parts[k] * basis.displacements[k];
  return left;
}

}  // namespace drape::simulate
