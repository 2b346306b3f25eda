// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

namespace drape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

SymmetricEigen symmetric_eigen(const MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

VectorXd least_squares(const MatrixXd& a, const VectorXd& b) {
  return a.colPivHouseholderQr().solve(b);
}
MatrixXd least_squares(const MatrixXd& a, const MatrixXd& b) {
  return a.colPivHouseholderQr().solve(b);
}

VectorXd solve_symmetric(const MatrixXd& a, const VectorXd& b) {
  return a.ldlt().solve(b);
}
MatrixXd solve_symmetric(const MatrixXd& a, const MatrixXd& b) {
  return a.ldlt().solve(b);
}

VectorXd solve_positive(const MatrixXd& a, const VectorXd& b) {
  return a.llt().solve(b);
}
MatrixXd solve_positive(const MatrixXd& a, const MatrixXd& b) {
  return a.llt().solve(b);
}

MatrixXd inverse_of_information(const MatrixXd& information, double least_condition) {
  // Scaled to a unit diagonal, so that the rank test does not depend on units.
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return {};
  const MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::LLT<MatrixXd> factor(scaled);
  if (factor.info() != Eigen::Success || !(factor.rcond() > least_condition)) return {};
  const MatrixXd inverse = factor.solve(MatrixXd::Identity(scaled.rows(), scaled.cols()));
  const MatrixXd result = scale.asDiagonal() * inverse * scale.asDiagonal();
  return 0.5 * (result + result.transpose());
}

bool is_covariance(const MatrixXd& matrix) {
  constexpr double kRounding = 1e-9;
  if (matrix.size() == 0) return true;
  if (!(matrix.diagonal().minCoeff() >= 0) || !matrix.allFinite()) return false;
  const VectorXd scale =
      matrix.diagonal().unaryExpr([](double v) { return v > 0 ? 1 / std::sqrt(v) : 1.0; });
  const MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  return (scaled - scaled.transpose()).cwiseAbs().maxCoeff() <= kRounding &&
         symmetric_eigen(scaled).values[0] >= -kRounding * static_cast<double>(scaled.rows());
}

}  // namespace drape
