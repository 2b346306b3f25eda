// SPDX-License-Identifier: Apache-2.0
// What the model of the paper adds to the springs and triples it shares with the model
// "consistent": springs along the cells' diagonals, and what they take off the grid lines.
#include "simulate/cloth.hpp"

namespace drape::sim {
namespace {

using Eigen::Vector3d;

constexpr double kSmallestSine = 1e-9;    // below it K_diag is its limit
constexpr double kSmallestStrain = 1e-9;  // below it K_st is its limit

Vector3d at(const Field& x, int i) {
  const std::size_t n = x.size() / 3;
  return {x[i], x[n + i], x[2 * n + i]};
}

double secant(const ForceCurve& law, double argument, double divisor, double smallest) {
  return std::abs(divisor) < smallest ? law.slope : law.value(argument) / divisor;
}

}  // namespace

/// Calls visit(spring) for each diagonal and for each grid line spring's part -K_diag.
template <class Visit>
void Cloth::visit_paper_springs(const Field& x, Visit visit) const {
  const int n = count();
  const int s = grid_.cols;
  const double hu = lines_[0].spacing;
  const double hv = lines_[1].spacing;
  const double diagonal = std::hypot(hu, hv);
  // In a cell that is not square this stiffness gives the same modulus G; 1 in a square.
  const double oblong = diagonal * diagonal / (2 * hu * hv);
  std::vector<double> k_diag(n, 0.0);
  for (int i = 0; i + s + 1 < n; ++i) {
    if (cell_[i] == 0) continue;
    const double sine = std::abs(shear_sine(x, i));
    k_diag[i] = secant(laws_.shear, std::asin(sine), sine, kSmallestSine);
    visit(PaperSpring{i, i + s + 1, k_diag[i] * oblong, diagonal, true, false});
    visit(PaperSpring{i + 1, i + s, k_diag[i] * oblong, diagonal, true, false});
  }
  for (int d = 0; d < 2; ++d) {
    const Line& line = lines_[d];
    const int side = lines_[1 - d].stride;  // from a cell to its neighbour across the line
    const double l = line.spacing;
    const double across = lines_[1 - d].spacing;
    for (int i = 0; i + line.stride < n; ++i) {
      if (line.width[i] == 0) continue;
      const bool before = i >= side && cell_[i - side] != 0;
      const bool after = cell_[i] != 0;
      const double sum = (before ? k_diag[i - side] : 0.0) + (after ? k_diag[i] : 0.0);
      const double share = sum / (before + after) * l * l / (across * across);
      const double strain = (at(x, i + line.stride) - at(x, i)).norm() / l - 1;
      const double k_st = secant(laws_.tensile[d], strain, strain, kSmallestStrain);
      visit(PaperSpring{i, i + line.stride, -std::min(share, k_st) * line.width[i] / l, l, false,
                        share > k_st});
    }
  }
}

void Cloth::add_paper_springs(const Field& x, Field& force) const {
  const int n = count();
  visit_paper_springs(x, [&](const PaperSpring& spring) {
    const Vector3d way = at(x, spring.b) - at(x, spring.a);
    const double length = way.norm();
    const double pull = spring.stiffness * (1 - spring.rest / length);
    for (int axis = 0; axis < 3; ++axis) {
      const double f = pull * way[axis];
      force[axis * n + spring.a] += f;
      force[axis * n + spring.b] -= f;
    }
  });
}

void Cloth::add_paper_energies(const Field& x, InternalEnergies& sum) const {
  visit_paper_springs(x, [&](const PaperSpring& spring) {
    const double over = (at(x, spring.b) - at(x, spring.a)).norm() - spring.rest;
    (spring.diagonal ? sum.shear_j : sum.stretch_j) += 0.5 * spring.stiffness * over * over;
  });
}

int Cloth::clamped_springs(const Field& x) const {
  int clamped = 0;
  if (model_ == ClothModel::consistent) return clamped;
  visit_paper_springs(x, [&](const PaperSpring& spring) { clamped += spring.clamped; });
  return clamped;
}

}  // namespace drape::sim
