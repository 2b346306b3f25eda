// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "simulate/refine/refine.hpp"

namespace drape::simulate {
namespace {

using Eigen::MatrixX3d;

constexpr double kLeastOrder = 1, kMostOrder = 3;  // of an error that grids show, to be believed

/// The order p at which (h3^p - h2^p) / (h2^p - h1^p) is `ratio`, of spacings from fine to coarse;
/// nothing beyond kLeastOrder to kMostOrder. That quotient grows with p.
std::optional<double> order_of(const std::array<double, 3>& h, double ratio) {
  const auto ratio_of = [&](double p) {
    return (std::pow(h[2] / h[1], p) - 1) / (1 - std::pow(h[0] / h[1], p));
  };
  double low = kLeastOrder, high = kMostOrder;
  if (!(ratio >= ratio_of(low) && ratio <= ratio_of(high))) return std::nullopt;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (ratio_of(middle) < ratio ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// How far the limit lies beyond the finer of two grids, in displacements from one to the other.
double beyond(double fine_m, double coarse_m, double order) {
  return 1 / (std::pow(coarse_m / fine_m, order) - 1);
}

}  // namespace

GridLeft left_of(double fine_spacing_m, double coarse_spacing_m, const MatrixX3d& fine_m,
                 const MatrixX3d& coarse_m) {
  return {std::nullopt,
          beyond(fine_spacing_m, coarse_spacing_m, kLeastOrder) * (fine_m - coarse_m)};
}

GridLeft left_of(const std::array<double, 3>& spacing_m,
                 const std::array<const MatrixX3d*, 3>& places_m) {
  const MatrixX3d fine_m = *places_m[0] - *places_m[1];
  const MatrixX3d rough_m = *places_m[1] - *places_m[2];
  const std::optional<double> order =
      order_of(spacing_m, (fine_m.array() * rough_m.array()).sum() / fine_m.squaredNorm());
  if (!order) return left_of(spacing_m[0], spacing_m[1], *places_m[0], *places_m[1]);
  return {order, beyond(spacing_m[0], spacing_m[1], std::min(*order, kModelOrder)) * fine_m};
}

}  // namespace drape::simulate
