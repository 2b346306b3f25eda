// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/draws.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "core/geometry/dense.hpp"
#include "core/statistics/distributions.hpp"
#include "core/statistics/sample.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd normals(Index rows, Index columns, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// Root of the covariance scaled to a unit diagonal, so that rad and px have equal weight.
MatrixXd root_of(const MatrixXd& covariance) {
  if (covariance.size() == 0) return {};
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd by = sd.unaryExpr([](double s) { return s > 0 ? 1 / s : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(by.asDiagonal() * covariance * by.asDiagonal());
  const double floor = 1e-12 * std::max(eigen.values.maxCoeff(), 0.0);
  const Index kept = (eigen.values.array() > floor).count();
  return sd.asDiagonal() * eigen.vectors.rightCols(kept) *
         eigen.values.tail(kept).cwiseSqrt().asDiagonal();
}

}  // namespace

Draws::Draws(const MatrixXd& covariance, int count)
    : count_(count), root_(root_of(covariance)), unit_(normals(root_.cols(), count, 1)) {}

MatrixXd Draws::errors_mm(const std::vector<const MeasuredPoint*>& points, double noise_variance,
                          unsigned seed) const {
  const auto rows = 3 * static_cast<Index>(points.size());
  MatrixXd errors = normals(rows, count_, 1000 + seed);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at = 3 * static_cast<Index>(i);
    const Eigen::Matrix3d root =
        Eigen::LLT<Eigen::Matrix3d>(noise_variance * points[i]->noise_mm2).matrixL();
    errors.middleRows<3>(at) = (root * errors.middleRows<3>(at)).eval();
  }
  if (root_.size() == 0) return errors;
  MatrixXd by(rows, root_.cols());
  for (std::size_t i = 0; i < points.size(); ++i)
    by.middleRows<3>(3 * static_cast<Index>(i)) = points[i]->by_calibration_mm * root_;
  errors.noalias() += by * unit_;
  return errors;
}

Eigen::RowVectorXd Draws::standard_normal(unsigned seed) const {
  return normals(1, count_, 500 + seed);
}

Faultless faultless_of(std::vector<double> draws, double false_no_go) {
  const auto n = static_cast<double>(draws.size());
  double sum = 0, squares = 0;
  for (const double value : draws) sum += value;
  const double mean = sum / n;
  for (const double value : draws) squares += (value - mean) * (value - mean);
  const double scale = std::sqrt(6 * squares / n) / std::numbers::pi;
  const auto place = static_cast<std::size_t>(std::min(kCoverage * n, n - 1));
  const double covered = order_statistic(std::move(draws), place);
  const double mode = mean - std::numbers::egamma * scale;
  return {covered, std::max(covered, mode - scale * std::log(-std::log1p(-false_no_go)))};
}

Faultless faultless_of_normal(double sd, int count, double false_no_go) {
  const auto beyond = [&](double p) {
    return sd * std::sqrt(chi2_per_dof_beyond(1, -std::expm1(std::log1p(-p) / count)));
  };
  return {beyond(1 - kCoverage), beyond(false_no_go)};
}

double chi2_per_dof_beyond(int dof, double p) {
  return chi_square_beyond(p, dof) / dof;
}

}  // namespace drape::calib
