// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/corner_covariance.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "core/statistics/sample.hpp"

namespace drape::detect {
namespace {

/// Degree of the polynomial in the board's plane that bends a projective map as a lens does: at
/// least two and a half corners for each of its terms.
int degree_for(std::size_t corners) {
  for (const int degree : {4, 3, 2}) {
    const int terms = (degree + 1) * (degree + 2) / 2;
    if (static_cast<double>(corners) >= 2.5 * terms) return degree;
  }
  return 1;
}

Eigen::VectorXd terms_at(const Eigen::Vector2d& at, int degree) {
  Eigen::VectorXd terms((degree + 1) * (degree + 2) / 2);
  Eigen::Index i = 0;
  for (int x = 0; x <= degree; ++x)
    for (int y = 0; x + y <= degree; ++y) terms[i++] = std::pow(at.x(), x) * std::pow(at.y(), y);
  return terms;
}

/// Variance of a corner along one axis, px^2, from what a smooth map of the board's plane leaves:
/// the best projective map, then a polynomial in its image. The median is robust (2 ln 2 of a
/// circular normal error).
std::optional<double> scatter_px2(const Target& target, const FrameDetections& frame) {
  const std::size_t corners = frame.detections.size();
  if (corners < 8) return std::nullopt;
  std::vector<cv::Point2d> board, seen;
  for (const Detection& corner : frame.detections) {
    const Eigen::Vector2d at = target.point_in_target(corner.mark).head<2>() / target.pitch_m;
    board.emplace_back(at.x(), at.y());
    seen.emplace_back(corner.centre_px.x(), corner.centre_px.y());
  }
  const cv::Mat map = cv::findHomography(board, seen, 0);
  if (map.empty()) return std::nullopt;
  std::vector<cv::Point2d> flat;
  cv::perspectiveTransform(board, flat, map);
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const cv::Point2d& p : flat)
    middle += Eigen::Vector2d(p.x, p.y) / static_cast<double>(corners);
  double size = 0;
  for (const cv::Point2d& p : flat)
    size = std::max(size, (Eigen::Vector2d(p.x, p.y) - middle).norm());
  const int degree = degree_for(corners);
  const Eigen::Index terms = (degree + 1) * (degree + 2) / 2;
  Eigen::MatrixXd design(corners, terms);
  Eigen::MatrixX2d off(corners, 2);
  for (std::size_t i = 0; i < corners; ++i) {
    const Eigen::Vector2d at(flat[i].x, flat[i].y);
    const auto row = static_cast<Eigen::Index>(i);
    design.row(row) = terms_at((at - middle) / size, degree).transpose();
    off.row(row) = (frame.detections[i].centre_px - at).transpose();
  }
  // Three passes in which a corner far off weighs less and less (Huber).
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(corners));
  std::vector<double> squares(corners);
  double typical = 0;
  for (int pass = 0; pass < 3; ++pass) {
    const Eigen::MatrixXd weighted = weights.asDiagonal() * design;
    const auto normal = (design.transpose() * weighted).ldlt();
    const Eigen::MatrixX2d left = off - design * normal.solve(weighted.transpose() * off);
    for (std::size_t i = 0; i < corners; ++i) {
      // What a corner takes up of its own error is not left over.
      const auto row = static_cast<Eigen::Index>(i);
      const double own = design.row(row).dot(normal.solve(weighted.row(row).transpose()));
      squares[i] = left.row(row).squaredNorm() / std::max(1 - own, 0.05);
    }
    typical = median(squares) / (2 * std::numbers::ln2);
    for (std::size_t i = 0; i < corners; ++i) {
      const double sigmas = std::sqrt(squares[i] / std::max(typical, 1e-30));
      weights[static_cast<Eigen::Index>(i)] = sigmas > 2 ? 2 / sigmas : 1;
    }
  }
  return typical;
}

}  // namespace

void set_corner_covariances(const Target& target, const std::vector<CornerPoint>& points,
                            FrameDetections& frame) {
  std::vector<double> scores, variances;
  for (const CornerPoint& point : points) {
    const Eigen::Matrix2d inverse = point.normal_matrix.inverse();
    scores.push_back((inverse * point.score_squares * inverse).trace() / inverse.trace());
    variances.push_back(inverse.trace() / 2);
  }
  if (points.empty()) return;
  const double typical_score = median(scores);
  const double scatter = scatter_px2(target, frame).value_or(typical_score * median(variances));
  for (std::size_t i = 0; i < points.size(); ++i) {
    frame.detections[i].covariance_px2 =
        scatter / median(variances) * points[i].normal_matrix.inverse();
    frame.detections[i].chi2_per_dof = typical_score > 0 ? scores[i] / typical_score : 0;
  }
}

}  // namespace drape::detect
