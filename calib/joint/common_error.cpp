// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/common_error.hpp"

#include <Eigen/QR>
#include <cmath>

namespace drape::calib {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd smooth_shapes(const JointFrame& frame) {
  const auto points = static_cast<Index>(frame.points.size());
  MatrixXd shapes(points, 6);
  double reach_m = 0;
  for (const TargetPoint& point : frame.points)
    reach_m = std::max(reach_m, point.point_in_target.head<2>().cwiseAbs().maxCoeff());
  for (Index i = 0; i < points; ++i) {
    const Eigen::Vector2d at =
        frame.points[static_cast<std::size_t>(i)].point_in_target.head<2>() / reach_m;
    shapes.row(i) << 1, at.x(), at.y(), at.x() * at.x(), at.x() * at.y(), at.y() * at.y();
  }
  const Eigen::ColPivHouseholderQR<MatrixXd> factor(shapes);
  const Index rank = factor.rank();
  const MatrixXd first = MatrixXd::Identity(points, rank);
  return std::sqrt(static_cast<double>(points)) * (factor.householderQ() * first);
}

MatrixXd common_error_pull(const JointModel& model, const JointFit& fit, double share) {
  const int size = free_parameters(model, fit);
  MatrixXd sum = MatrixXd::Zero(size, size);
  for (const JointFrame& frame : model.frames) {
    if (frame.points.empty()) continue;
    double variance_px2 = 0;
    for (const TargetPoint& point : frame.points)
      variance_px2 += point.covariance_px2.trace() / 2 / static_cast<double>(frame.points.size());
    const MatrixXd shapes = share * std::sqrt(variance_px2) * smooth_shapes(frame);
    MatrixXd disturbance = MatrixXd::Zero(2 * shapes.rows(), 2 * shapes.cols());
    for (Index i = 0; i < shapes.rows(); ++i) {
      disturbance.block(2 * i, 0, 1, shapes.cols()) = shapes.row(i);
      disturbance.block(2 * i + 1, shapes.cols(), 1, shapes.cols()) = shapes.row(i);
    }
    const MatrixXd pull = pull_of(model, fit, frame, disturbance);
    sum += pull * pull.transpose();
  }
  return sum;
}

}  // namespace drape::calib
