// SPDX-License-Identifier: Apache-2.0
// Matrices in which layers of a sheet couple far particles.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>
#include <set>
#include <utility>

#include "simulate/sparse/dissection.hpp"
#include "simulate/sparse/factor.hpp"

namespace drape::simulate {
namespace {

/// Springs along the pattern and between `count` pairs of random particles, and the same on the
/// ground.
GridMatrix springs(int rows, int cols, int count, unsigned seed) {
  GridMatrix matrix(GridSpec{rows, cols, {0.2, 0.2}});
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> between(-1, 1);
  std::uniform_int_distribution<int> particle(0, rows * cols - 1);
  const auto block = [&] {
    const Eigen::Vector3d displacement(between(random), between(random), between(random));
    return Eigen::Matrix3d(displacement * displacement.transpose());
  };
  std::vector<std::pair<int, int>> pairs;
  std::vector<GridMatrix::Coupling> couplings;
  for (int k = 0; k < count; ++k) {
    const int i = particle(random), j = particle(random);
    if (i == j) continue;
    pairs.emplace_back(i, j);
    couplings.push_back({i, j});
  }
  matrix.couple(couplings);
  const auto join = [&](int i, int j) {
    const Eigen::Matrix3d spring = block();
    matrix.add(i, i, spring);
    matrix.add(j, j, spring);
    // Not symmetric on its own, as blocks of bending elements are.
    Eigen::Matrix3d off = -spring;
    off(0, 1) += 0.1;
    matrix.add_far(i, j, off);
  };
  for (int j = 0; j < rows * cols; ++j) {
    matrix.add(j, j, Eigen::Matrix3d::Identity());
    for (int s = 1; s < GridMatrix::slots; ++s) {
      if (matrix.has(j, s)) join(j, j + matrix.step(s));
    }
  }
  for (const auto& [i, j] : pairs) join(i, j);
  return matrix;
}

Eigen::MatrixXd dense_of(const GridMatrix& matrix) {
  const Eigen::Index size = 3 * matrix.grid().count();
  Eigen::MatrixXd dense(size, size);
  Eigen::VectorXd column;
  for (Eigen::Index k = 0; k < size; ++k) {
    matrix.multiply(Eigen::VectorXd::Unit(size, k), column);
    dense.col(k) = column;
  }
  return dense;
}

TEST(Couplings, AreSolvedLikeADenseMatrixAndTheSameOnTwoThreads) {
  for (const auto& [rows, cols, count] :
       {std::tuple{3, 3, 4}, {5, 9, 3}, {12, 11, 40}, {17, 13, 1}, {16, 16, 200}, {7, 20, 2000}}) {
    const GridMatrix matrix = springs(rows, cols, count, 5);
    const std::vector<double> shift(matrix.grid().count(), 2.0);
    const Eigen::MatrixXd dense =
        dense_of(matrix) + 2.0 * Eigen::MatrixXd::Identity(3 * rows * cols, 3 * rows * cols);
    ASSERT_LT((dense - dense.transpose()).norm(), 1e-12);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(dense.rows(), -1, 2);
    const Eigen::VectorXd truth = dense.llt().solve(b);
    GridFactor<double> one(matrix.grid(), 1), two(matrix.grid(), 2);
    ASSERT_TRUE(one.factorise(matrix, shift)) << rows << "x" << cols;
    ASSERT_TRUE(two.factorise(matrix, shift));
    Eigen::VectorXd x = b, same = b;
    one.solve(x);
    two.solve(same);
    EXPECT_LT((x - truth).norm(), 1e-11 * truth.norm()) << rows << "x" << cols;
    EXPECT_EQ(x, same);
  }
}

// As the layers of a falling sheet do.
TEST(Couplings, ComeAndGoFromMatrixToMatrix) {
  const GridSpec grid{12, 14, {0.2, 0.2}};
  GridFactor<double> factor(grid, 1);
  const std::vector<double> shift(grid.count(), 2.0);
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * grid.count(), -1, 2);
  for (const auto& [count, seed] :
       {std::pair{0, 1u}, {10, 2u}, {30, 2u}, {25, 2u}, {0, 3u}, {5, 4u}, {80, 5u}, {1, 6u}}) {
    const GridMatrix matrix = springs(grid.rows, grid.cols, count, seed);
    ASSERT_TRUE(factor.factorise(matrix, shift));
    Eigen::VectorXd x = b, back;
    factor.solve(x);
    matrix.multiply(x, back);
    back += 2.0 * x;
    EXPECT_LT((back - b).norm(), 1e-11 * b.norm()) << count;
  }
}

TEST(Couplings, OnlyJoinRegionsOfOneBranch) {
  const GridMatrix matrix = springs(17, 19, 120, 3);
  const std::vector<Region> regions = dissect(matrix);
  std::vector<int> region_of(matrix.grid().count(), -1), parent(regions.size(), -1);
  for (std::size_t k = 0; k < regions.size(); ++k) {
    for (const int particle : regions[k].own) {
      EXPECT_EQ(region_of[particle], -1);
      region_of[particle] = static_cast<int>(k);
    }
    for (const int child : regions[k].children) {
      if (child >= 0) parent[child] = static_cast<int>(k);
    }
  }
  ASSERT_GT(matrix.couplings().size(), 100U);
  for (const auto& [high, low] : matrix.couplings()) {
    int lower = std::min(region_of[high], region_of[low]);
    const int upper = std::max(region_of[high], region_of[low]);
    while (lower >= 0 && lower < upper) lower = parent[lower];
    EXPECT_EQ(lower, upper);
  }
  EXPECT_TRUE(regions.back().border.empty());
}

TEST(Couplings, OfTheGridsOwnPatternAreItsBlocks) {
  GridMatrix matrix(GridSpec{6, 7, {0.2, 0.2}});
  std::vector<GridMatrix::Coupling> all;
  std::set<std::pair<int, int>> far;
  for (int i = 0; i < matrix.grid().count(); ++i) {
    for (int j = 0; j < i; ++j) {
      all.push_back({j, i});
      far.emplace(i, j);
    }
    for (int s = 1; s < GridMatrix::slots; ++s) {
      if (matrix.has(i, s)) far.erase({i + matrix.step(s), i});
    }
  }
  // Those below i were erased before they were listed.
  for (int i = 0; i < matrix.grid().count(); ++i) {
    for (int s = 1; s < GridMatrix::slots; ++s) {
      if (matrix.has(i, s)) far.erase({i + matrix.step(s), i});
    }
  }
  matrix.couple(all);
  EXPECT_EQ(matrix.couplings().size(), far.size());
  for (const auto& [high, low] : matrix.couplings()) EXPECT_TRUE(far.count({high, low}));
}

}  // namespace
}  // namespace drape::simulate
