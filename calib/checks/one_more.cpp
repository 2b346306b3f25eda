// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/one_more.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "calib/joint/statistics.hpp"

namespace drape::calib {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

OneMore one_more(const std::vector<ViewInformation>& views) {
  OneMore out;
  if (views.size() < 4) return out;
  const Index size = views[0].score.size(), rest = size - 1;
  MatrixXd all = MatrixXd::Zero(size, size);
  VectorXd score = VectorXd::Zero(size);
  for (const ViewInformation& view : views) {
    all += view.with_world;
    score += view.score;
  }
  const VectorXd unit = all.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<MatrixXd> factor(
      (unit.asDiagonal() * all * unit.asDiagonal()).topLeftCorner(rest, rest));
  const VectorXd others =
      unit.head(rest).asDiagonal() *
      factor.solve(VectorXd(unit.head(rest).asDiagonal() * all.col(rest).head(rest)));
  out.others = others;
  VectorXd pick(size);
  pick << -others, 1;
  const double information = pick.dot(all * pick);
  if (!(information > 1e-9 * all(rest, rest))) return out;
  out.estimate = -pick.dot(score) / information;
  double scatter = 0;
  for (const ViewInformation& view : views) {
    const double own = pick.dot(view.score) + out.estimate * pick.dot(view.with_world * pick);
    scatter += own * own;
  }
  const auto n = static_cast<double>(views.size());
  scatter *= n / (n - 1);
  const double t2 = std::pow(out.estimate * information, 2) / std::max(scatter, 1e-300);
  out.explained = out.estimate * out.estimate * information;
  out.p = f_tail(t2, 1, n - 1);
  return out;
}

}  // namespace drape::calib
