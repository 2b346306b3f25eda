// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/one_more.hpp"

#include <cmath>

#include "core/geometry/dense.hpp"
#include "core/statistics/distributions.hpp"

namespace drape::calib {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd MoreParameters::step() const {
  VectorXd step(others.rows() + estimate.size());
  step << -others * estimate, estimate;
  return step;
}

MoreParameters fit_more(const ViewsInformation& given, Index count) {
  MoreParameters out;
  const std::vector<ViewInformation>& views = given.views;
  const auto n = static_cast<Index>(views.size());
  if (n < count + 3) return out;
  const Index size = views[0].score.size(), fitted = size - count;
  const MatrixXd all = given.sum();
  VectorXd score = VectorXd::Zero(size);
  for (const ViewInformation& view : views) score += view.score;
  const VectorXd unit = all.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = unit.asDiagonal() * all * unit.asDiagonal();
  const MatrixXd others = unit.head(fitted).asDiagonal() *
                          solve_symmetric(scaled.topLeftCorner(fitted, fitted),
                                          MatrixXd(scaled.topRightCorner(fitted, count))) *
                          unit.tail(count).cwiseInverse().asDiagonal();
  MatrixXd pick(size, count);
  pick << -others, MatrixXd::Identity(count, count);
  const MatrixXd information = pick.transpose() * all * pick;
  for (Index k = 0; k < count; ++k)
    if (!(information(k, k) > 1e-9 * all(fitted + k, fitted + k))) return out;
  const VectorXd estimate = -solve_symmetric(information, VectorXd(pick.transpose() * score));
  MatrixXd scatter = MatrixXd::Zero(count, count);
  for (const ViewInformation& view : views) {
    const VectorXd own =
        pick.transpose() * view.score + pick.transpose() * view.with_world * pick * estimate;
    scatter += own * own.transpose();
  }
  scatter *= static_cast<double>(n) / static_cast<double>(n - count);
  const MatrixXd once = solve_symmetric(information, scatter);
  const MatrixXd covariance = solve_symmetric(information, MatrixXd(once.transpose()));
  const double t2 = estimate.dot(solve_symmetric(covariance, estimate));
  if (!std::isfinite(t2)) return out;
  out.estimate = estimate;
  out.covariance = covariance;
  out.others = others;
  out.explained = estimate.dot(information * estimate);
  out.p = f_tail(t2 / static_cast<double>(count), static_cast<double>(count),
                 static_cast<double>(n - count));
  return out;
}

}  // namespace drape::calib
