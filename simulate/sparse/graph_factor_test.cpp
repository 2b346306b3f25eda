// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/graph_factor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Places without order in the unit square, joined where they lie near each other.
struct Graph {
  std::vector<Vector2d> places;
  std::vector<std::vector<int>> neighbours;

  explicit Graph(int count) : neighbours(count) {
    for (int i = 0; i < count; ++i) {
      const double a = std::sin(12.9898 * i) * 437.5453, b = std::sin(78.233 * i) * 437.5453;
      places.emplace_back(a - std::floor(a), b - std::floor(b));
    }
    const double near = 2 / std::sqrt(count);
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < count; ++j)
        if (i != j && (places[i] - places[j]).norm() < near) neighbours[i].push_back(j);
  }
};

/// One plus a sum of squares over neighbours, so definite; the same as a dense matrix.
Eigen::MatrixXd fill(GraphMatrix& matrix) {
  const int count = matrix.count();
  Eigen::MatrixXd dense = Eigen::MatrixXd::Identity(3 * count, 3 * count);
  for (int i = 0; i < count; ++i) {
    for (const int j : matrix.neighbours(i)) {
      if (j > i) continue;
      const Vector3d a(std::sin(i + 2 * j), std::cos(i), 1), b(std::cos(3 * j), 1, std::sin(i));
      dense.block<3, 3>(3 * i, 3 * i) += a * a.transpose();
      dense.block<3, 3>(3 * j, 3 * j) += b * b.transpose();
      dense.block<3, 3>(3 * i, 3 * j) += a * b.transpose();
      dense.block<3, 3>(3 * j, 3 * i) += b * a.transpose();
    }
  }
  for (int j = 0; j < count; ++j) {
    matrix.block(matrix.place(j, j)) = dense.block<3, 3>(3 * j, 3 * j);
    for (const int i : matrix.neighbours(j))
      if (i > j) matrix.block(matrix.place(i, j)) = dense.block<3, 3>(3 * i, 3 * j);
  }
  return dense;
}

TEST(GraphFactor, SolvesWhatADenseFactorSolves) {
  for (const int count : {1, 7, 40, 300}) {
    const Graph graph(count);
    GraphMatrix matrix(graph.neighbours);
    const Eigen::MatrixXd dense = fill(matrix);
    GraphFactor factor(matrix, graph.places);
    // Rounding to single precision, times the condition number.
    const Eigen::VectorXd eigenvalues = dense.selfadjointView<Eigen::Lower>().eigenvalues();
    const double tolerance =
        std::numeric_limits<float>::epsilon() * eigenvalues.maxCoeff() / eigenvalues.minCoeff();
    for (int again = 0; again < 2; ++again) {
      ASSERT_TRUE(factor.factorise(matrix)) << count;
      Eigen::VectorXd right(3 * count);
      std::vector<Vector3d> x(count);
      for (int i = 0; i < count; ++i) {
        x[i] = Vector3d(std::sin(5 * i), 1, std::cos(i));
        right.segment<3>(3 * i) = x[i];
      }
      factor.solve(x);
      const Eigen::VectorXd expected = dense.llt().solve(right);
      for (int i = 0; i < count; ++i)
        EXPECT_LT((x[i] - expected.segment<3>(3 * i)).norm(), tolerance * expected.norm()) << count;
    }
  }
}

TEST(GraphFactor, SaysWhatIsNotDefinite) {
  const Graph graph(40);
  GraphMatrix matrix(graph.neighbours);
  static_cast<void>(fill(matrix));
  matrix.block(matrix.place(17, 17)) = -Matrix3d::Identity();
  GraphFactor factor(matrix, graph.places);
  EXPECT_FALSE(factor.factorise(matrix));
}

}  // namespace
}  // namespace drape::simulate
