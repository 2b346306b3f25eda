// SPDX-License-Identifier: Apache-2.0
#include "simulate/validation/test_equilibrium.hpp"

#include <Eigen/SparseCholesky>
#include <cmath>

namespace drape::simulate {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

constexpr int kReach = 2;             // particles: how far one particle's move changes forces
constexpr double kDifference = 1e-5;  // relative to the spacing
// Relative to the force scale; Newton's last step goes far below
constexpr double kConverged = 1e-6;
constexpr double kEnergyNoise = 1e-9;  // relative; below this an energy rise is rounding

}  // namespace

Equilibrium::Equilibrium(Cloth& cloth, Field load, std::vector<bool> held, double force_scale_n)
    : cloth_(cloth), load_(std::move(load)), position_(load_.size(), -1) {
  force_scale_n_ = force_scale_n > 0 ? force_scale_n : largest(load_);
  for (std::size_t k = 0; k < load_.size(); ++k) {
    if (held[k]) continue;
    position_[k] = static_cast<int>(free_.size());
    free_.push_back(static_cast<int>(k));
  }
}

Field Equilibrium::net_force(const Field& x) {
  Field force = load_;
  cloth_.add_forces(x, nullptr, force);
  for (std::size_t k = 0; k < force.size(); ++k) {
    if (position_[k] < 0) force[k] = 0;
  }
  return force;
}

Matrix Equilibrium::tangent(const Field& x) {
  const GridSpec& grid = cloth_.grid();
  const int n = grid.count();
  constexpr int kPeriod = 2 * kReach + 1;
  const double h = kDifference * std::min(grid.warp_spacing_m(), grid.weft_spacing_m());
  std::vector<Eigen::Triplet<double>> entries;
  for (int colour = 0; colour < 3 * kPeriod * kPeriod; ++colour) {
    const int axis = colour / (kPeriod * kPeriod);
    const int first_row = colour / kPeriod % kPeriod;
    const int first_col = colour % kPeriod;
    Field shifted[2] = {x, x};
    std::vector<int> moved;
    for (int r = first_row; r < grid.rows; r += kPeriod) {
      for (int c = first_col; c < grid.cols; c += kPeriod) {
        const int k = axis * n + grid.index(r, c);
        if (position_[k] < 0) continue;
        moved.push_back(k);
        shifted[0][k] -= h;
        shifted[1][k] += h;
      }
    }
    if (moved.empty()) continue;
    const Field before = net_force(shifted[0]);
    const Field after = net_force(shifted[1]);
    for (const int k : moved) {
      const int r = k % n / grid.cols;
      const int c = k % n % grid.cols;
      for (int rr = std::max(0, r - kReach); rr <= std::min(grid.rows - 1, r + kReach); ++rr) {
        for (int cc = std::max(0, c - kReach); cc <= std::min(grid.cols - 1, c + kReach); ++cc) {
          if (std::abs(rr - r) + std::abs(cc - c) > kReach) continue;
          for (int other = grid.index(rr, cc); other < 3 * n; other += n) {
            const double slope = (before[other] - after[other]) / (2 * h);
            if (position_[other] >= 0) entries.emplace_back(position_[other], position_[k], slope);
          }
        }
      }
    }
  }
  const auto count = static_cast<Eigen::Index>(free_.size());
  Matrix matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Matrix transposed = matrix.transpose();
  const Matrix difference = matrix - transposed;
  asymmetry_ = difference.coeffs().cwiseAbs().maxCoeff() / matrix.coeffs().cwiseAbs().maxCoeff();
  return 0.5 * (matrix + transposed);
}

double Equilibrium::energy(const Field& x) const {
  double sum = cloth_.energies(x).sum_j();
  for (std::size_t k = 0; k < x.size(); ++k) sum -= load_[k] * x[k];
  return sum;
}

double Equilibrium::largest(const Field& f) const {
  double most = 0;
  for (const double value : f) most = std::max(most, std::abs(value));
  return most;
}

Equilibrium::Outcome Equilibrium::find(Field& x, double stride, int most_iterations) {
  Outcome outcome;
  const double scale = force_scale_n_;
  const auto count = static_cast<Eigen::Index>(free_.size());
  Matrix identity(count, count);
  identity.setIdentity();
  Eigen::SimplicialLDLT<Matrix> factor;
  double shift = 0;
  double now = energy(x);
  for (; outcome.iterations < most_iterations; ++outcome.iterations) {
    const Field net = net_force(x);
    outcome.residual = largest(net) / scale;
    if (outcome.residual < kConverged) {
      outcome.found = true;
      return outcome;
    }
    Eigen::VectorXd right(count);
    for (Eigen::Index i = 0; i < count; ++i) right[i] = net[free_[i]];
    const Matrix matrix = tangent(x);
    const double stiffest = matrix.diagonal().cwiseAbs().maxCoeff();
    if (outcome.iterations == 0) factor.analyzePattern(matrix + identity);
    shift *= 0.2;
    if (shift < 1e-14 * stiffest) shift = 0;
    for (int trial = 0; trial < 60; ++trial) {
      factor.factorize(matrix + shift * identity);
      if (factor.info() == Eigen::Success && factor.vectorD().minCoeff() > 0) {
        const Eigen::VectorXd move = factor.solve(right);
        const double cut = std::min(1.0, stride / move.cwiseAbs().maxCoeff());
        Field next = x;
        for (Eigen::Index i = 0; i < count; ++i) next[free_[i]] += cut * move[i];
        const double then = energy(next);
        if (then <= now + kEnergyNoise * std::abs(now) ||
            largest(net_force(next)) < 0.5 * outcome.residual * scale) {
          x = next;
          now = then;
          break;
        }
      }
      shift = std::max(10 * shift, 1e-12 * stiffest);
    }
  }
  return outcome;
}

int Equilibrium::unstable_directions(const Field& x) {
  const Eigen::SimplicialLDLT<Matrix> factor(tangent(x));
  // Sylvester's law of inertia: as many negative pivots as negative eigenvalues.
  return static_cast<int>((factor.vectorD().array() < 0).count());
}

}  // namespace drape::simulate
