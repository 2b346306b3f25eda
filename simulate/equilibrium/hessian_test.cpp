// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/hessian.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "simulate/sparse/dense.hpp"
#include "simulate/sparse/mixed_factor.hpp"

namespace drape::simulate {
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

/// Curvatures of a crumpled sheet along one direction by the exact Hessian and differences of
/// forces.
void expect_derivative_of_forces(const GridSpec& grid, unsigned seed) {
  Cloth cloth(grid, knotted_laws(), MassRule::area);
  const std::size_t n = grid.count();
  const Field x = crumpled(grid, 2e-4, seed);
  const Field direction = crumpled(grid, 1.0, seed + 100);
  Eigen::VectorXd exact;
  for (const int threads : {1, 2}) {
    GridMatrix hessian(grid);
    add_hessian(cloth, x, false, hessian, nullptr, threads);
    Eigen::VectorXd product;
    hessian.multiply(interleaved(direction), product);
    if (threads > 1) {
      EXPECT_EQ(product, exact) << grid.rows << " rows";
    }
    exact = product;
  }
  // Fourth order differences; the step keeps clear of the knots of the laws.
  const double h = 3e-9;
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(exact.size());
  for (const auto& [step, weight] : {std::pair{-2.0, 1.0}, {-1.0, -8.0}, {1.0, 8.0}, {2.0, -1.0}}) {
    Field moved = x;
    for (std::size_t i = 0; i < 3 * n; ++i) moved[i] += step * h * direction[i];
    Field force(3 * n, 0.0);
    cloth.add_forces(moved, nullptr, force);
    difference -= weight / (12 * h) * interleaved(force);
  }
  EXPECT_LT((difference - exact).norm(), 1e-7 * exact.norm()) << grid.rows << ", seed " << seed;
}

TEST(StaticHessian, IsTheDerivativeOfTheForces) {
  for (unsigned seed = 1; seed <= 5; ++seed)
    expect_derivative_of_forces({9, 7, {0.08, 0.05}}, seed);
}

// Tall grids are added in bands of 24 rows: no element may be missed where they meet or end.
TEST(StaticHessian, OfTallGridsIsTheDerivativeOfTheForces) {
  for (const int rows : {60, 61, 71, 72, 73, 74, 95}) {
    expect_derivative_of_forces({rows, 5, {0.01 * rows, 0.04}}, 1);
  }
}

TEST(StaticHessian, ConvexFormIsPositiveSemidefinite) {
  const GridSpec grid{8, 8, {0.05, 0.05}};
  const Cloth cloth(grid, knotted_laws(), MassRule::area);
  const Field x = crumpled(grid, 5e-4, 7);
  GridFactor<double> factor(grid, 1);
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
    GridFactor<double> one(grid, 1);
    GridFactor<double> two(grid, 2);
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

template <class Real>
class DenseKernelsOf : public testing::Test {};
using Precisions = testing::Types<double, float>;
TYPED_TEST_SUITE(DenseKernelsOf, Precisions);

// Fused multiply-add rounds once wherever it is computed, so the bytes do not depend on the
// processor: the plain kernels are what one without these instructions runs.
TYPED_TEST(DenseKernelsOf, GiveTheSameBytesWithAnyInstructions) {
  using Real = TypeParam;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(-1, 1);
  for (const auto& [rows, cols] :
       {std::pair{1, 1}, {5, 3}, {13, 12}, {37, 29}, {91, 60}, {130, 130}, {210, 110}}) {
    std::vector<Real> matrix(trapezoid_size<Real>(rows, cols));
    for (Real& v : matrix) v = static_cast<Real>(value(random));
    for (int c = 0; c < cols; ++c) {
      matrix[trapezoid_column<Real>(rows, c) + c] = static_cast<Real>(2 * rows);
    }
    std::vector<Real> x(rows);
    for (Real& v : x) v = static_cast<Real>(value(random));
    std::vector<Real> bytes[3];
    for (const Instructions most :
         {Instructions::plain, Instructions::avx2, Instructions::avx512}) {
      DenseScratch<Real> scratch;
      scratch.most = most;
      std::vector<Real>& all = bytes[static_cast<int>(most)];
      all = matrix;
      ASSERT_TRUE(factor_columns(all.data(), rows, cols, scratch));
      std::vector<Real> triangle(trapezoid_size<Real>(rows - cols, rows - cols));
      set_minus_outer(all.data(), rows, cols, triangle.data(), scratch);
      std::vector<Real> forward = x;
      solve_columns(all.data(), rows, cols, forward.data(), most);
      std::vector<Real> back = x;
      solve_columns_transposed(all.data(), rows, cols, back.data(), most);
      for (const auto& part : {triangle, forward, back}) {
        all.insert(all.end(), part.begin(), part.end());
      }
    }
    for (const int k : {0, 1}) {
      EXPECT_EQ(std::memcmp(bytes[k].data(), bytes[2].data(), bytes[2].size() * sizeof(Real)), 0)
          << rows << " rows, instructions " << k;
    }
  }
  if (best_instructions() != Instructions::avx512) {
    GTEST_SKIP() << "AVX-512 is missing on this processor: its kernels were not compared";
  }
}

// L L^T is the matrix, L stored with its diagonal inverted, and the rest loses what the rows below
// make: Eigen says the same.
TYPED_TEST(DenseKernelsOf, FactorIsEigens) {
  using Real = TypeParam;
  constexpr int width = DenseKernels<Real>::tile_rows;
  constexpr double rounding = 100 * std::numeric_limits<Real>::epsilon();
  std::mt19937 random(8);
  std::uniform_real_distribution<double> value(-1, 1);
  for (const auto& [rows, cols] : {std::pair{3, 2}, {24, 24}, {61, 25}, {133, 77}, {190, 130}}) {
    Eigen::MatrixXd full(rows, rows);
    for (double& v : full.reshaped()) v = value(random);
    full = (full * full.transpose()).eval() + rows * Eigen::MatrixXd::Identity(rows, rows);
    std::vector<Real> part(trapezoid_size<Real>(rows, cols));
    for (int c = 0; c < cols; ++c) {
      for (int r = c - c % width; r < rows; ++r) {
        part[trapezoid_column<Real>(rows, c) + r] = static_cast<Real>(full(r, c));
      }
    }
    DenseScratch<Real> scratch;
    ASSERT_TRUE(factor_columns(part.data(), rows, cols, scratch));
    const int rest = rows - cols;
    std::vector<Real> triangle(trapezoid_size<Real>(rest, rest));
    set_minus_outer(part.data(), rows, cols, triangle.data(), scratch);
    const Eigen::MatrixXd lower = full.llt().matrixL();
    for (int c = 0; c < cols; ++c) {
      for (int r = c; r < rows; ++r) {
        const double stored = part[trapezoid_column<Real>(rows, c) + r];
        EXPECT_NEAR(r == c ? 1 / stored : stored, lower(r, c), rounding * rows);
      }
    }
    const Eigen::MatrixXd below = lower.bottomLeftCorner(rest, cols);
    const Eigen::MatrixXd loss = below * below.transpose();
    for (int c = 0; c < rest; ++c) {
      for (int r = c; r < rest; ++r) {
        EXPECT_NEAR(triangle[trapezoid_column<Real>(rest, c) + r], -loss(r, c), rounding * rows);
      }
    }
  }
}

// Single precision is off by its rounding times the condition number; solving again for what is
// left gains as many digits each time.
TEST(MixedFactor, GainsDigitsByIteratingOnTheResidual) {
  const GridSpec grid{23, 31, {0.2, 0.2}};
  const Cloth cloth(grid, knotted_laws(), MassRule::area);
  GridMatrix matrix(grid);
  add_hessian(cloth, crumpled(grid, 1e-4, 3), true, matrix);
  const std::vector<double> shift(grid.count(), 2.0);
  GridFactor<double> exact(grid, 1);
  MixedFactor mixed(grid, 1);
  ASSERT_TRUE(exact.factorise(matrix, shift));
  ASSERT_TRUE(mixed.factorise(matrix, shift, MixedFactor::Doubt::ask_double));
  EXPECT_FALSE(mixed.in_double());
  const Eigen::VectorXd b = interleaved(crumpled(grid, 1.0, 9));
  Eigen::VectorXd truth = b;
  exact.solve(truth);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  double before = 1;
  for (int k = 0; k < 3; ++k) {
    Eigen::VectorXd rest;
    matrix.multiply(x, rest);
    rest = b - rest - 2.0 * x;
    mixed.solve(rest);
    x += rest;
    const double error = (x - truth).norm() / truth.norm();
    EXPECT_LT(error, 1e-3 * before) << k;
    before = error;
  }
  EXPECT_GT(before, 0);
}

TEST(MixedFactor, GoesOnInDoubleWhereSinglePrecisionIsNotEnough) {
  const GridSpec grid{23, 31, {0.2, 0.2}};
  GridMatrix matrix(grid);
  // A spring whose stiffness swallows what holds it: in single precision the second pivot is 0.
  const Eigen::Matrix3d stiff = std::ldexp(1.0, 34) * Eigen::Matrix3d::Identity();
  matrix.add(40, 40, stiff);
  matrix.add(41, 41, stiff);
  matrix.add(41, 40, -stiff);
  const std::vector<double> shift(grid.count(), 1.0);
  MixedFactor mixed(grid, 1);
  EXPECT_FALSE(mixed.factorise(matrix, shift, MixedFactor::Doubt::believe));
  EXPECT_FALSE(mixed.in_double());
  EXPECT_TRUE(mixed.factorise(matrix, shift, MixedFactor::Doubt::ask_double));
  EXPECT_TRUE(mixed.in_double());
  Eigen::VectorXd x = Eigen::VectorXd::Ones(3 * grid.count());
  mixed.solve(x);
  EXPECT_LT((x.array() - 1).abs().maxCoeff(), 1e-5);  // the spring is not stretched
}

// A factor that is not kept says the same of definiteness, on one thread and on two.
TEST(GridFactor, JudgesWithoutKeepingTheFactor) {
  const GridSpec grid{23, 31, {0.2, 0.2}};
  const Cloth cloth(grid, knotted_laws(), MassRule::area);
  GridMatrix matrix(grid);
  add_hessian(cloth, crumpled(grid, 1e-4, 3), false, matrix);
  // From definite to not: somewhere in between the answer changes.
  int definite = 0;
  int indefinite = 0;
  for (int power = 0; power < 17; ++power) {
    const double shift = std::ldexp(1.0, power);
    const std::vector<double> shifts(grid.count(), shift);
    const bool kept = GridFactor<double>(grid, 1).factorise(matrix, shifts);
    for (const int threads : {1, 2}) {
      GridFactor<double> judge(grid, threads, GridFactor<double>::Keep::nothing);
      EXPECT_EQ(judge.factorise(matrix, shifts), kept) << shift << ", threads " << threads;
    }
    ++(kept ? definite : indefinite);
  }
  EXPECT_GT(definite, 0);
  EXPECT_GT(indefinite, 0);
}

TEST(GridFactor, SaysWhenAMatrixIsIndefinite) {
  const GridSpec grid{12, 12, {0.2, 0.2}};
  const Cloth cloth(grid, knotted_laws(), MassRule::area);
  GridMatrix matrix(grid);
  add_hessian(cloth, crumpled(grid, 1e-4, 3), true, matrix);
  matrix.add(5, 5, -1e5 * Eigen::Matrix3d::Identity());
  GridFactor<double> factor(grid, 1);
  EXPECT_FALSE(factor.factorise(matrix, std::vector<double>(grid.count(), 0.1)));
}

}  // namespace
}  // namespace drape::simulate
