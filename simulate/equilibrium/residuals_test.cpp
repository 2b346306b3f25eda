// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/residuals.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <random>

namespace drape::simulate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kSize = 40;
constexpr int kRank = 3;

/// Stiffnesses over six decades along turned axes, and a part of low rank that is not symmetric.
struct System {
  MatrixXd near, full;
  VectorXd right;
  Eigen::LLT<MatrixXd> factor;

  System() {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> any(-1, 1);
    const auto fill = [&](int rows, int cols) {
      return MatrixXd(MatrixXd::NullaryExpr(rows, cols, [&] { return any(random); }));
    };
    const MatrixXd turn = fill(kSize, kSize).householderQr().householderQ();
    const VectorXd stiffness = VectorXd::NullaryExpr(kSize, [](Eigen::Index i) {
      return std::pow(10.0, 6.0 * static_cast<double>(i) / (kSize - 1));
    });
    near = turn * stiffness.asDiagonal() * turn.transpose();
    full = near + near * fill(kSize, kRank) * fill(kRank, kSize);
    right = fill(kSize, 1);
    factor.compute(near);
  }
  [[nodiscard]] NearlySymmetric functions() const {
    return {[this](const VectorXd& x, VectorXd& product) { product = full * x; },
            [this](VectorXd& b) { b = factor.solve(b); }};
  }
  [[nodiscard]] double energy_left(const VectorXd& answer) const {
    const VectorXd rest = right - full * answer;
    return rest.dot(factor.solve(rest));
  }
};

TEST(StaticResiduals, FindsTheSolutionInOneDirectionMoreThanTheRankOfWhatIsNotSymmetric) {
  const System system;
  VectorXd answer = VectorXd::Zero(kSize);
  const double begun = system.energy_left(answer);
  const ResidualsLeft left =
      minimise_residuals(system.functions(), system.right, answer, 1e-12 * begun, kSize);
  EXPECT_LE(left.solves, 1 + kRank + 1);
  EXPECT_LT(system.energy_left(answer), 1.1e-12 * begun);
  const VectorXd exact = system.full.fullPivLu().solve(system.right);
  const VectorXd off = answer - exact;
  EXPECT_LT(off.dot(system.near * off), 1e-10 * exact.dot(system.near * exact));
}

TEST(StaticResiduals, SaysWhatIsLeftAndNeverMakesItMore) {
  const System system;
  VectorXd answer = system.factor.solve(system.right);
  double before = system.energy_left(answer);
  for (int most = 1; most <= kRank; ++most) {
    VectorXd better = answer;
    const ResidualsLeft left =
        minimise_residuals(system.functions(), system.right, better, 0, most);
    EXPECT_EQ(left.solves, 1 + most);
    EXPECT_NEAR(left.energy, system.energy_left(better), 1e-6 * before);
    EXPECT_LE(left.energy, before * (1 + 1e-9));
    before = left.energy;
  }
}

TEST(StaticResiduals, LeavesAnAnswerThatIsGoodEnough) {
  const System system;
  VectorXd answer = VectorXd::Constant(kSize, 0.5);
  const VectorXd given = answer;
  const double begun = system.energy_left(answer);
  const ResidualsLeft left =
      minimise_residuals(system.functions(), system.right, answer, 1.01 * begun, kSize);
  EXPECT_EQ(left.solves, 1);
  EXPECT_EQ(answer, given);
}

}  // namespace
}  // namespace drape::simulate
