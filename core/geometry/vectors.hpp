// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

namespace drape {

/// z of a x b; twice the signed area of the triangle 0, a, b.
[[nodiscard]] inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Area of a closed polygon, positive if it runs counter-clockwise.
[[nodiscard]] double signed_area(std::span<const Eigen::Vector2d> polygon);

/// Skew-symmetric matrix [v]x, with [v]x w = v x w.
[[nodiscard]] Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// Converts a rotation vector (rad) to a rotation, and back.
[[nodiscard]] Eigen::Matrix3d rotation_about(const Eigen::Vector3d& rotation_vector);
[[nodiscard]] Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation);

// Factorisations of dynamic matrices. Eigen compiles them here once, since each costs seconds of
// compile time in every source that uses it.

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

/// Homography that maps the points `from` to the points `to`: minimises the algebraic error on
/// normalised coordinates (Hartley 1997), with Frobenius norm 1 and a positive scale at the mean of
/// `from`. nullopt for fewer than four points or collinear ones.
[[nodiscard]] std::optional<Eigen::Matrix3d> homography(const std::vector<Eigen::Vector2d>& from,
                                                        const std::vector<Eigen::Vector2d>& to);

/// Homography of the unit square, corners (0, 0), (1, 0), (1, 1), (0, 1), to a quadrilateral
/// (Heckbert 1989). nullopt if three of its corners are collinear.
[[nodiscard]] std::optional<Eigen::Matrix3d> square_homography(
    const std::array<Eigen::Vector2d, 4>& corners);

/// Image of a point under a homography, and the derivative there.
[[nodiscard]] Eigen::Vector2d mapped(const Eigen::Matrix3d& map, const Eigen::Vector2d& point);
[[nodiscard]] Eigen::Matrix2d derivative_at(const Eigen::Matrix3d& map,
                                            const Eigen::Vector2d& point);

}  // namespace drape
