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
  std::vector<VectorXd> ways, forces;

  /// Takes what is new in `way`, M^-1 `force`, and returns its parts along all directions, the new
  /// one last; that is 0 where there is nothing new.
  VectorXd add(VectorXd way, VectorXd force) {
    VectorXd parts(ways.size() + 1);
    for (std::size_t i = 0; i < ways.size(); ++i) {
      const double part = ways[i].dot(force);
      way -= part * ways[i];
      force -= part * forces[i];
      parts[static_cast<Index>(i)] = part;
    }
    const double energy = way.dot(force);
    const double size = energy > 0 ? std::sqrt(energy) : 0.0;
    parts[parts.size() - 1] = size;
    if (size > 0) {
      ways.push_back(way / size);
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
  VectorXd way = rest;
  system.solve(way);
  ResidualsLeft left{std::max(0.0, way.dot(rest)), 1};
  if (!(left.energy > enough)) return left;
  Basis basis;
  VectorXd wanted = VectorXd::Zero(most + 1);
  wanted[0] = basis.add(way, rest)[0];
  MatrixXd made = MatrixXd::Zero(most + 1, most);  // by each direction, of all
  VectorXd shares;
  for (Index k = 0; k < most && left.energy > enough; ++k) {
    system.multiply(basis.ways[k], product);
    way = product;
    system.solve(way);
    ++left.solves;
    made.col(k).head(k + 2) = basis.add(way, product);
    const auto so_far = made.topLeftCorner(k + 2, k + 1);
    shares = so_far.householderQr().solve(wanted.head(k + 2));
    left.energy = (wanted.head(k + 2) - so_far * shares).squaredNorm();
    if (made(k + 1, k) == 0) break;
  }
  for (Index k = 0; k < shares.size(); ++k) answer += shares[k] * basis.ways[k];
  return left;
}

}  // namespace drape::simulate
