// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/corner_covariance.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <numbers>
#include <optional>

namespace drape::detect {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Variance of a corner along one axis, px^2, from the third differences along the board's lines:
/// perspective and lens bend a line smoothly, so what stays is 20 variances of scatter (binomial
/// weights 1, 3, 3, 1), of which the median is robust (2 ln 2 of a circular normal error).
std::optional<double> scatter_px2(const Target& target, const FrameDetections& frame) {
  const std::size_t rows = static_cast<std::size_t>(target.rows);
  const std::size_t cols = static_cast<std::size_t>(target.cols);
  std::vector<const Detection*> at(rows * cols, nullptr);
  for (const Detection& corner : frame.detections)
    at[static_cast<std::size_t>(corner.mark.row) * cols + corner.mark.col] = &corner;
  // Only every second corner of an AprilGrid has the same distance from the next.
  const std::size_t stride = target.kind == TargetKind::aprilgrid ? 2 : 1;
  std::vector<double> squares;
  const auto look = [&](std::size_t first, std::size_t step) {
    const Detection *a = at[first], *b = at[first + step], *c = at[first + 2 * step],
                    *d = at[first + 3 * step];
    if (a == nullptr || b == nullptr || c == nullptr || d == nullptr) return;
    squares.push_back(
        (a->centre_px - 3 * b->centre_px + 3 * c->centre_px - d->centre_px).squaredNorm());
  };
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t col = 0; col < cols; ++col) {
      if (col + 3 * stride < cols) look(row * cols + col, stride);
      if (row + 3 * stride < rows) look(row * cols + col, stride * cols);
    }
  }
  if (squares.empty()) return std::nullopt;
  return median(squares) / (20 * 2 * std::numbers::ln2);
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
