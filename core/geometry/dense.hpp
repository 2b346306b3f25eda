// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

// Eigen factorisations of dynamic matrices. They are compiled here once, since each costs seconds
// of compile time in every source that uses it.
namespace drape {

/// Ascending eigenvalues of a symmetric matrix, and one unit vector per column.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

/// Least-squares solution: the x that minimises |a x - b|, by Householder QR with column pivoting.
[[nodiscard]] Eigen::VectorXd least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
[[nodiscard]] Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Solves a x = b for a symmetric semidefinite a, by L D L' with pivoting.
[[nodiscard]] Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
[[nodiscard]] Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Solves a x = b for a positive definite a, by L L'.
[[nodiscard]] Eigen::VectorXd solve_positive(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
[[nodiscard]] Eigen::MatrixXd solve_positive(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Inverse of a positive definite matrix with mixed units; empty if it is numerically singular,
/// that is if the reciprocal condition of the matrix, scaled to a unit diagonal, is not above
/// `least_condition`.
[[nodiscard]] Eigen::MatrixXd inverse_of_information(const Eigen::MatrixXd& information,
                                                     double least_condition = 1e-14);

/// True for a square matrix that is symmetric and positive semidefinite within rounding, whatever
/// the units of its parameters.
[[nodiscard]] bool is_covariance(const Eigen::MatrixXd& matrix);

}  // namespace drape
