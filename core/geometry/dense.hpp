// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

// Factorisations of matrices of any size, by Eigen; compiled here once, since each takes the
// compiler seconds in every source that names it.
namespace drape {

/// Ascending eigenvalues of a symmetric matrix, and one unit vector per column.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

/// The x for which |a x - b| is least, by Householder reflections with column pivoting.
[[nodiscard]] Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
[[nodiscard]] Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// The x of a x = b for a symmetric semidefinite a, by L D L' with pivoting.
[[nodiscard]] Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
[[nodiscard]] Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// The x of a x = b for a positive definite a, by L L'.
[[nodiscard]] Eigen::VectorXd solve_positive(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
[[nodiscard]] Eigen::MatrixXd solve_positive(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Inverse of a symmetric positive matrix of mixed units; empty when it is numerically singular:
/// the reciprocal condition of the matrix, scaled to a unit diagonal, is not above
/// `least_condition`.
[[nodiscard]] Eigen::MatrixXd inverse_of_information(const Eigen::MatrixXd& information,
                                                     double least_condition = 1e-14);

/// True for a square matrix that is symmetric and positive semidefinite to rounding, whatever the
/// units of its parameters are.
[[nodiscard]] bool is_covariance(const Eigen::MatrixXd& matrix);

}  // namespace drape
