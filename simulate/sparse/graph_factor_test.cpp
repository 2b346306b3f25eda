// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/graph_factor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <utility>

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Random points in the unit square, joined if they are close to each other.
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

/// Fills the matrix with 1 plus a sum of squares over neighbours (definite); returns it as dense.
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
    // rounding to single precision, times the condition number
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

// Fused multiply-add rounds once on every processor, so the bytes do not depend on it: the plain
// kernels are those used by a processor without these instructions.
TEST(DenseKernels, GiveTheSameBytesWithAnyInstructions) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(-1, 1);
  for (const auto& [rows, cols] :
       {std::pair{1, 1}, {5, 3}, {13, 12}, {37, 29}, {91, 60}, {130, 130}, {210, 110}}) {
    std::vector<float> matrix(trapezoid_size(rows, cols));
    for (float& v : matrix) v = static_cast<float>(value(random));
    for (int c = 0; c < cols; ++c) {
      matrix[trapezoid_column(rows, c) + c] = static_cast<float>(2 * rows);
    }
    std::vector<float> x(rows);
    for (float& v : x) v = static_cast<float>(value(random));
    std::vector<float> bytes[3];
    for (const Instructions most :
         {Instructions::plain, Instructions::avx2, Instructions::avx512}) {
      DenseScratch scratch;
      scratch.most = most;
      std::vector<float>& all = bytes[static_cast<int>(most)];
      all = matrix;
      ASSERT_TRUE(factor_columns(all.data(), rows, cols, scratch));
      std::vector<float> triangle(trapezoid_size(rows - cols, rows - cols));
      set_minus_outer(all.data(), rows, cols, triangle.data(), scratch);
      std::vector<float> forward = x;
      solve_columns(all.data(), rows, cols, forward.data(), most);
      std::vector<float> back = x;
      solve_columns_transposed(all.data(), rows, cols, back.data(), most);
      for (const auto& part : {triangle, forward, back}) {
        all.insert(all.end(), part.begin(), part.end());
      }
    }
    for (const int k : {0, 1}) {
      EXPECT_EQ(std::memcmp(bytes[k].data(), bytes[2].data(), bytes[2].size() * sizeof(float)), 0)
          << rows << " rows, instructions " << k;
    }
  }
  if (best_instructions() != Instructions::avx512) {
    GTEST_SKIP() << "AVX-512 is missing on this processor: its kernels were not compared";
  }
}

// Tests L L^T = matrix, with the diagonal of L stored inverted, and the Schur complement of the
// rest, against Eigen.
TEST(DenseKernels, FactorIsEigens) {
  constexpr int width = DenseKernels::tile_rows;
  constexpr double rounding = 100 * std::numeric_limits<float>::epsilon();
  std::mt19937 random(8);
  std::uniform_real_distribution<double> value(-1, 1);
  for (const auto& [rows, cols] : {std::pair{3, 2}, {24, 24}, {61, 25}, {133, 77}, {190, 130}}) {
    Eigen::MatrixXd full(rows, rows);
    for (double& v : full.reshaped()) v = value(random);
    full = (full * full.transpose()).eval() + rows * Eigen::MatrixXd::Identity(rows, rows);
    std::vector<float> part(trapezoid_size(rows, cols));
    for (int c = 0; c < cols; ++c) {
      for (int r = c - c % width; r < rows; ++r) {
        part[trapezoid_column(rows, c) + r] = static_cast<float>(full(r, c));
      }
    }
    DenseScratch scratch;
    ASSERT_TRUE(factor_columns(part.data(), rows, cols, scratch));
    const int rest = rows - cols;
    std::vector<float> triangle(trapezoid_size(rest, rest));
    set_minus_outer(part.data(), rows, cols, triangle.data(), scratch);
    const Eigen::MatrixXd lower = full.llt().matrixL();
    for (int c = 0; c < cols; ++c) {
      for (int r = c; r < rows; ++r) {
        const double stored = part[trapezoid_column(rows, c) + r];
        EXPECT_NEAR(r == c ? 1 / stored : stored, lower(r, c), rounding * rows);
      }
    }
    const Eigen::MatrixXd below = lower.bottomLeftCorner(rest, cols);
    const Eigen::MatrixXd loss = below * below.transpose();
    for (int c = 0; c < rest; ++c) {
      for (int r = c; r < rest; ++r) {
        EXPECT_NEAR(triangle[trapezoid_column(rest, c) + r], -loss(r, c), rounding * rows);
      }
    }
  }
}

// Single precision is off by its rounding times the condition number; solving again for what is

}  // namespace
}  // namespace drape::simulate
