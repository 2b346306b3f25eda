// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/vectors.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

namespace drape {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double signed_area(std::span<const Eigen::Vector2d> polygon) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    sum += cross(polygon[i], polygon[(i + 1) % polygon.size()]) / 2;
  return sum;
}

Matrix3d cross_matrix(const Vector3d& v) {
  return (Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

Matrix3d rotation_about(const Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix()
                   : Matrix3d::Identity();
}

Vector3d rotation_vector(const Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

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

using Eigen::Vector2d;

namespace {

/// Similarity that moves the mean to 0 and scales the mean distance to sqrt(2).
Matrix3d normaliser(const std::vector<Vector2d>& points) {
  Vector2d mean = Vector2d::Zero();
  for (const Vector2d& p : points) mean += p / static_cast<double>(points.size());
  double distance = 0;
  for (const Vector2d& p : points)
    distance += (p - mean).norm() / static_cast<double>(points.size());
  const double scale = std::sqrt(2.0) / distance;
  Matrix3d n;
  n << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return n;
}

}  // namespace

std::optional<Matrix3d> homography(const std::vector<Vector2d>& from,
                                   const std::vector<Vector2d>& to) {
  if (from.size() < 4) return std::nullopt;
  const Matrix3d from_normal = normaliser(from), to_normal = normaliser(to);
  if (!from_normal.allFinite() || !to_normal.allFinite()) return std::nullopt;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vector3d a = from_normal * from[i].homogeneous();
    const Vector3d b = to_normal * to[i].homogeneous();
    Eigen::Matrix<double, 2, 9> rows;
    rows << a.transpose(), Eigen::RowVector3d::Zero(), -b.x() * a.transpose(),
        Eigen::RowVector3d::Zero(), a.transpose(), -b.y() * a.transpose();
    normal += rows.transpose() * rows;
  }
  const Eigen::JacobiSVD<Eigen::Matrix<double, 9, 9>> svd(normal, Eigen::ComputeFullV);
  // Two vanishing singular values mean that the points are collinear.
  if (!(svd.singularValues()[7] > 1e-9 * svd.singularValues()[0])) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = svd.matrixV().col(8);
  Matrix3d normalised;
  normalised << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  Matrix3d result = to_normal.inverse() * normalised * from_normal;
  if ((result * from_normal.inverse().col(2)).z() < 0) result = -result;
  return result / result.norm();
}

std::optional<Matrix3d> square_homography(const std::array<Vector2d, 4>& c) {
  Eigen::Matrix2d sides;
  sides << c[1] - c[2], c[3] - c[2];
  if (std::abs(sides.determinant()) < 1e-9) return std::nullopt;
  const Vector2d gh = sides.inverse() * (c[0] - c[1] + c[2] - c[3]);
  Matrix3d map;
  map << c[1] - c[0] + gh.x() * c[1], c[3] - c[0] + gh.y() * c[3], c[0], gh.transpose(), 1;
  return map;
}

Vector2d mapped(const Matrix3d& map, const Vector2d& point) {
  return (map * point.homogeneous()).hnormalized();
}

Eigen::Matrix2d derivative_at(const Matrix3d& map, const Vector2d& point) {
  const Vector3d seen = map * point.homogeneous();
  return (map.topLeftCorner<2, 2>() - seen.hnormalized() * map.row(2).head<2>()) / seen.z();
}

}  // namespace drape
