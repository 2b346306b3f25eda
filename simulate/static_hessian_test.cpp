// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_hessian.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "simulate/static_dense.hpp"
#include "simulate/static_factor.hpp"

namespace drape::sim {
namespace {

ClothLaws knotted_laws() {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  laws.tensile[0] = {1500, {{0.01, 700}}};
  laws.tensile[1] = {900, {{0.02, 400}}};
  laws.shear = {40, {{0.1, -15}}};
  laws.bending[0] = {8e-6, {{30, -2e-6}}};
  laws.bending[1] = {5e-6, {{20, -1e-6}}};
  laws.twist_n_m = 9e-6;
  return laws;
}

/// A sheet rolled, sheared and shaken, so that no element is in a special state.
Field crumpled(const GridSpec& grid, double noise, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> shake(-noise, noise);
  const int n = grid.count();
  Field x(3 * static_cast<std::size_t>(n));
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      const double u = r * grid.warp_spacing_m();
      const double v = c * grid.weft_spacing_m();
      const int i = grid.index(r, c);
      x[i] = 0.05 * std::sin(u / 0.05) + 0.1 * v + shake(random);
      x[n + i] = 1.01 * v + shake(random);
      x[2 * n + i] = 0.05 * std::cos(u / 0.05) + 0.02 * std::sin(v / 0.02) + shake(random);
    }
  }
  return x;
}

Eigen::VectorXd interleaved(const Field& field) {
  const std::size_t n = field.size() / 3;
  Eigen::VectorXd v(field.size());
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) v[3 * i + axis] = field[axis * n + i];
  }
  return v;
}

TEST(StaticHessian, IsTheDerivativeOfTheForces) {
  const GridSpec grid{9, 7, {0.08, 0.05}};
  Cloth cloth(grid, knotted_laws(), MassRule::area);
  const std::size_t n = grid.count();
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Field x = crumpled(grid, 2e-4, seed);
    GridMatrix hessian(grid);
    add_hessian(cloth, x, false, hessian);
    const Field direction = crumpled(grid, 1.0, seed + 100);
    Eigen::VectorXd exact;
    hessian.multiply(interleaved(direction), exact);
    // Fourth order differences; the step keeps clear of the knots of the laws.
    const double h = 3e-9;
    Eigen::VectorXd difference = Eigen::VectorXd::Zero(exact.size());
    for (const auto& [step, weight] :
         {std::pair{-2.0, 1.0}, {-1.0, -8.0}, {1.0, 8.0}, {2.0, -1.0}}) {
      Field moved = x;
      for (std::size_t i = 0; i < 3 * n; ++i) moved[i] += step * h * direction[i];
      Field force(3 * n, 0.0);
      cloth.add_forces(moved, nullptr, force);
      difference -= weight / (12 * h) * interleaved(force);
    }
    EXPECT_LT((difference - exact).norm(), 1e-7 * exact.norm()) << "seed " << seed;
  }
}

TEST(StaticHessian, ConvexFormIsPositiveSemidefinite) {
  const GridSpec grid{8, 8, {0.05, 0.05}};
  const Cloth cloth(grid, knotted_laws(), MassRule::area);
  const Field x = crumpled(grid, 5e-4, 7);
  GridFactor factor(grid, 1);
  const std::vector<double> tiny(grid.count(), 1e-7);
  GridMatrix exact(grid);
  add_hessian(cloth, x, false, exact);
  EXPECT_FALSE(factor.factorise(exact, tiny)) << "the sheet is compressed: a test without point";
  GridMatrix convex(grid);
  add_hessian(cloth, x, true, convex);
  EXPECT_TRUE(factor.factorise(convex, tiny));
}

TEST(GridFactor, SolvesOnAnyGridAndTheSameWithTwoThreads) {
  for (const auto& [rows, cols] : {std::pair{3, 3}, {3, 9}, {17, 4}, {5, 5}, {23, 31}}) {
    const GridSpec grid{rows, cols, {0.2, 0.2}};
    const Cloth cloth(grid, knotted_laws(), MassRule::area);
    GridMatrix matrix(grid);
    add_hessian(cloth, crumpled(grid, 1e-4, 3), true, matrix);
    const std::vector<double> shift(grid.count(), 2.0);
    GridFactor one(grid, 1);
    GridFactor two(grid, 2);
    ASSERT_TRUE(one.factorise(matrix, shift));
    ASSERT_TRUE(two.factorise(matrix, shift));
    const Eigen::VectorXd b = interleaved(crumpled(grid, 1.0, 9));
    Eigen::VectorXd x = b;
    one.solve(x);
    Eigen::VectorXd same = b;
    two.solve(same);
    EXPECT_EQ(x, same);
    Eigen::VectorXd back;
    matrix.multiply(x, back);
    back += 2.0 * x;
    EXPECT_LT((back - b).norm(), 1e-10 * b.norm()) << rows << "x" << cols;
  }
}

// Fused multiply-add rounds once wherever it is computed, so the bytes do not depend on the
// processor: the portable kernels are what one without the instruction runs.
TEST(DenseKernels, GiveTheSameBytesWithAndWithoutTheProcessorsInstruction) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(-1, 1);
  for (const auto& [rows, cols] : {std::pair{1, 1}, {5, 3}, {13, 12}, {37, 29}, {91, 60}}) {
    std::vector<double> matrix(static_cast<std::size_t>(rows) * cols);
    for (double& v : matrix) v = value(random);
    for (int c = 0; c < cols; ++c) matrix[static_cast<std::size_t>(c) * rows + c] = 2.0 * rows;
    std::vector<double> other = matrix;
    DenseScratch fast, portable;
    portable.portable = true;
    ASSERT_TRUE(factor_columns(matrix.data(), rows, cols, fast));
    ASSERT_TRUE(factor_columns(other.data(), rows, cols, portable));
    EXPECT_EQ(std::memcmp(matrix.data(), other.data(), matrix.size() * sizeof(double)), 0) << rows;
    std::vector<double> result(static_cast<std::size_t>(rows) * rows, 1.0);
    std::vector<double> result_other = result;
    subtract_outer(matrix.data(), rows, rows, rows, cols, result.data(), rows, fast);
    subtract_outer(other.data(), rows, rows, rows, cols, result_other.data(), rows, portable);
    EXPECT_EQ(std::memcmp(result.data(), result_other.data(), result.size() * sizeof(double)), 0)
        << rows;
  }
}

TEST(GridFactor, SaysWhenAMatrixIsIndefinite) {
  const GridSpec grid{12, 12, {0.2, 0.2}};
  const Cloth cloth(grid, knotted_laws(), MassRule::area);
  GridMatrix matrix(grid);
  add_hessian(cloth, crumpled(grid, 1e-4, 3), true, matrix);
  matrix.add(5, 5, -1e5 * Eigen::Matrix3d::Identity());
  GridFactor factor(grid, 1);
  EXPECT_FALSE(factor.factorise(matrix, std::vector<double>(grid.count(), 0.1)));
}

}  // namespace
}  // namespace drape::sim
