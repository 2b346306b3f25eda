// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/view_scatter.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/dense.hpp"
#include "core/statistics/distributions.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// T with T A T' = 1; empty if A is numerically singular.
MatrixXd whitener_of(const MatrixXd& information) {
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return {};
  const SymmetricEigen eigen =
      symmetric_eigen(scale.asDiagonal() * information * scale.asDiagonal());
  const VectorXd& values = eigen.values;
  if (!(values[0] > 1e-14 * values[values.size() - 1])) return {};
  return values.cwiseSqrt().cwiseInverse().asDiagonal() * eigen.vectors.transpose() *
         scale.asDiagonal();
}

/// Corrects a view's gradient for leverage: for white noise the result has covariance `own`, the
/// gradient at the optimum own - own^2.
VectorXd without_leverage(const MatrixXd& own, const VectorXd& pull) {
  const SymmetricEigen eigen = symmetric_eigen(own);
  VectorXd along = eigen.vectors.transpose() * pull;
  for (Index i = 0; i < along.size(); ++i) {
    // A direction determined by this view alone leaves no residual to test it with.
    const double left = 1 - eigen.values[i];
    along[i] = left > 1e-9 ? along[i] / std::sqrt(left) : 0;
  }
  return eigen.vectors * along;
}

}  // namespace

ViewScatter scatter_of_views(const JointModel& model, const JointFit& fit, double least_inflation) {
  ViewScatter out;
  const ViewsInformation information = information_by_view(model, fit);
  const std::vector<ViewInformation>& views = information.views;
  if (views.empty()) return out;
  const MatrixXd all = information.sum();
  const MatrixXd whiten = whitener_of(all);
  if (whiten.size() == 0) return out;
  const Index size = all.rows();
  MatrixXd seen = MatrixXd::Zero(size, size), scatter = seen;
  std::vector<MatrixXd> owns, squares;
  double concentration = 0;
  for (const ViewInformation& view : views) {
    MatrixXd own = whiten * view.information * whiten.transpose();
    const VectorXd pull = without_leverage(own, whiten * view.score);
    seen += own;
    squares.push_back(pull * pull.transpose());
    scatter += squares.back();
    concentration += own.squaredNorm();
    owns.push_back(std::move(own));
  }
  // Directions fixed by the placement that defines the world have no residual and get the mean.
  const double directions = seen.trace();
  const double by_direction = std::max(directions / concentration - 1, 1.0);
  out.inflation = std::max(scatter.trace() / directions, least_inflation);
  double noise = 0;
  for (std::size_t i = 0; i < squares.size(); ++i)
    noise += (squares[i] - owns[i].trace() / directions * scatter).squaredNorm();
  const double apart = (scatter - out.inflation * seen).squaredNorm();
  out.shrinkage = apart > 0 ? std::min(1.0, noise / apart) : 1;
  const double own_part = 1 - out.shrinkage;
  const MatrixXd mean = out.inflation * MatrixXd::Identity(size, size);
  MatrixXd whitened =
      out.shrinkage * mean +
      own_part * (scatter + out.inflation * (MatrixXd::Identity(size, size) - seen));
  // A stated error keeps its size, whatever the scatter between views.
  whitened -= (out.inflation - model.noise) * whiten * information.stated * whiten.transpose();
  const SymmetricEigen eigen = symmetric_eigen(whitened);
  whitened = eigen.vectors * eigen.values.cwiseMax(least_inflation).asDiagonal() *
             eigen.vectors.transpose();
  out.degrees_of_freedom = 1 / (std::pow(out.shrinkage, 2) / (by_direction * directions) +
                                std::pow(own_part, 2) / by_direction);
  const double widening =
      student_quantile(0.975, std::max(out.degrees_of_freedom, 2.0)) / normal_quantile(0.975);
  out.covariance = widening * widening * whiten.transpose() * whitened * whiten;
  out.covariance = (0.5 * (out.covariance + out.covariance.transpose())).eval();
  return out;
}

}  // namespace drape::calib
