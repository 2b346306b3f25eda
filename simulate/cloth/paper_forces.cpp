// SPDX-License-Identifier: Apache-2.0
// Forces that the model of the paper adds to the springs and triples of the model
// "consistent": springs along the cells' diagonals, and what they take off the grid lines.
#include "simulate/cloth/kernels.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kSmallestSine = 1e-9;    // below it K_diag is its limit
constexpr double kSmallestStrain = 1e-9;  // below it K_st is its limit

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
      const double fraction = sum / (before + after) * l * l / (across * across);
      const double strain = (at(x, i + line.stride) - at(x, i)).norm() / l - 1;
      const double k_st = secant(laws_.tensile[d], strain, strain, kSmallestStrain);
      visit(PaperSpring{i, i + line.stride, -std::min(fraction, k_st) * line.width[i] / l, l, false,
                        fraction > k_st});
    }
  }
}

/// The same springs for the inner loops: K_diag per cell, and the cell's stiffnesses between its
/// mid-lines a and b, whose half sum and half difference are the diagonals.
DRAPE_WIDE void Cloth::find_diagonals(Band band) {
  const std::ptrdiff_t s = grid_.cols;
  const std::ptrdiff_t m = kernels::rounded_up(band.end - band.begin);
  const double* __restrict x = work_.of(Work::x) + band.begin;
  const double* __restrict y = work_.of(Work::x + 1) + band.begin;
  const double* __restrict z = work_.of(Work::x + 2) + band.begin;
  const double* __restrict cell = work_.of(Work::cell) + band.begin;
  const double hu = lines_[0].spacing;
  const double hv = lines_[1].spacing;
  const double rest = std::hypot(hu, hv);
  const double quarter = 0.25 * rest * rest / (2 * hu * hv);
  double* __restrict sine = work_.in_band(Work::angle);
  double* __restrict k_diag = work_.in_band(Work::k_diag);
  double* __restrict sum = work_.in_band(Work::stiff_a);
  double* __restrict difference = work_.in_band(Work::stiff_ab);
  double* __restrict sum_too = work_.in_band(Work::stiff_b);
  double* __restrict angle = work_.in_band(Work::before);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double dx = x[i + s + 1] - x[i], dy = y[i + s + 1] - y[i], dz = z[i + s + 1] - z[i];
    const double ex = x[i + s] - x[i + 1], ey = y[i + s] - y[i + 1], ez = z[i + s] - z[i + 1];
    // The mid-lines are a = d + e along the warp and b = d - e along the weft.
    const double dd = kernels::kNoLength2 + (dx * dx + dy * dy + dz * dz);
    const double ee = kernels::kNoLength2 + (ex * ex + ey * ey + ez * ez);
    const double de = dx * ex + dy * ey + dz * ez;
    const double ab = std::abs(dd - ee);
    const double both = kernels::kNoArea2 + (dd + ee + 2 * de) * (dd + ee - 2 * de);
    const double across = std::sqrt(std::max(1e-6 * both, both - ab * ab));
    const double inverse = rest / std::sqrt(dd * ee);
    const double pull = 1 - inverse * std::sqrt(ee), push = 1 - inverse * std::sqrt(dd);
    sine[i] = ab / std::sqrt(both);
    angle[i] = kernels::wide_atan(ab / across);
    sum[i] = quarter * (pull + push);
    difference[i] = quarter * (pull - push);
  }
  const kernels::Law law(laws_.shear);
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double over = law.value(angle[i]) / std::max(sine[i], kSmallestSine);
    k_diag[i] = cell[i] * (sine[i] < kSmallestSine ? law.slope : over);
  }
  for (std::size_t h = kernels::kHingesAtOnce; h < laws_.shear.hinges.size(); ++h) {
    const ForceCurve::Hinge hinge = laws_.shear.hinges[h];
    DRAPE_INDEPENDENT
    for (std::ptrdiff_t i = 0; i < m; ++i) {
      const double over = std::max(0.0, angle[i] - hinge.at);
      k_diag[i] += cell[i] * hinge.change * over / std::max(sine[i], kSmallestSine);
    }
  }
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    sum[i] *= k_diag[i];
    sum_too[i] = sum[i];
    difference[i] *= k_diag[i];
  }
}

/// K'_st = K_st - K_diag, not below 0.
DRAPE_WIDE void Cloth::take_off_lines(int direction, Band band) {
  const ForceCurve& law = laws_.tensile[direction];
  const std::ptrdiff_t side = lines_[1 - direction].stride;
  const std::ptrdiff_t m = kernels::rounded_up(band.end - band.begin);
  const double* __restrict fraction = work_.of(Work::part + direction) + band.begin;
  const double* __restrict k_diag = work_.in_band(Work::k_diag);
  const double* __restrict strain = work_.in_band(Work::strain + direction);
  const double* __restrict width = work_.of(Work::width + direction) + band.begin;
  const double* __restrict inverse = work_.in_band(Work::inverse + direction);
  double* __restrict tension = work_.in_band(Work::tension + direction);
  double* __restrict k_st = work_.in_band(Work::before);
  for (std::ptrdiff_t i = 0; i < m; ++i) k_st[i] = law.slope;
  for (const ForceCurve::Hinge hinge : law.hinges) {
    DRAPE_INDEPENDENT
    for (std::ptrdiff_t i = 0; i < m; ++i) {
      const double over = std::max(0.0, strain[i] - hinge.at);
      k_st[i] += hinge.change * over / std::max(strain[i], kSmallestStrain);
    }
  }
  DRAPE_INDEPENDENT
  for (std::ptrdiff_t i = 0; i < m; ++i) {
    const double less = std::min(fraction[i] * (k_diag[i - side] + k_diag[i]), k_st[i]);
    tension[i] -= less * strain[i] * (width[i] * inverse[i]);
  }
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

}  // namespace drape::simulate
