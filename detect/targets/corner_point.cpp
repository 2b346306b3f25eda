// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/corner_point.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "detect/targets/saddle_fit.hpp"

namespace drape::detect {
namespace {

constexpr int kMaxIterations = 50;
constexpr double kConverged_px = 1e-4;

/// Grey levels around a place between pixels, one pixel wider than the window.
cv::Mat window_at(const cv::Mat& image, const Eigen::Vector2d& centre_px, int half_window_px) {
  cv::Mat window;
  const int side = 2 * (half_window_px + 1) + 1;
  cv::getRectSubPix(
      image, cv::Size(side, side),
      cv::Point2f(static_cast<float>(centre_px.x()), static_cast<float>(centre_px.y())), window,
      CV_32F);
  return window;
}

/// Calls visit(offset from the window's middle, gradient, weight) for each pixel of the window.
template <class Visit>
void for_each_gradient(const cv::Mat& window, int half_window_px, const Visit& visit) {
  const double width = half_window_px;
  for (int y = -half_window_px; y <= half_window_px; ++y) {
    for (int x = -half_window_px; x <= half_window_px; ++x) {
      const int row = y + half_window_px + 1, col = x + half_window_px + 1;
      const Eigen::Vector2d gradient(
          0.5 * (window.at<float>(row, col + 1) - window.at<float>(row, col - 1)),
          0.5 * (window.at<float>(row + 1, col) - window.at<float>(row - 1, col)));
      visit(Eigen::Vector2d(x, y), gradient, std::exp(-(x * x + y * y) / (width * width)));
    }
  }
}

/// The largest half window, up to the one asked for, that stays in the image.
int half_window_within(const cv::Mat& image, const Eigen::Vector2d& px, int half_window_px) {
  if (!px.allFinite()) return 0;
  const double free_px =
      std::min({px.x(), px.y(), image.cols - 1 - px.x(), image.rows - 1 - px.y()});
  // Gradients reach one pixel farther.
  return free_px < 1 ? 0 : std::min(half_window_px, static_cast<int>(std::floor(free_px - 1)));
}

/// Score per direction: neighbouring pixels have correlated noise, so each eighth is one
/// observation, together with the opposite one, which cancels what a corner's own symmetric shape
/// contributes.
Eigen::Matrix2d score_squares(const cv::Mat& window, int half_window_px) {
  std::array<Eigen::Vector2d, 4> scores;
  scores.fill(Eigen::Vector2d::Zero());
  for_each_gradient(window, half_window_px,
                    [&](const Eigen::Vector2d& p, const Eigen::Vector2d& g, double weight) {
                      const double turn = std::atan2(p.y(), p.x()) / (2 * std::numbers::pi) + 0.5;
                      scores[static_cast<std::size_t>(turn * 8) % 4] += weight * g * g.dot(p);
                    });
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& score : scores) sum += score * score.transpose();
  return sum;
}

std::optional<CornerPoint> point_of_gradients(const GreyImage& picture,
                                              const Eigen::Vector2d& start_px, int most_px) {
  // A view without a copy; OpenCV only reads it.
  const cv::Mat image(picture.height_px, picture.width_px, CV_8UC1,
                      const_cast<std::uint8_t*>(picture.bytes.data()));
  CornerPoint corner{start_px, Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero(), most_px};
  int& half_window_px = corner.half_window_px;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    half_window_px = half_window_within(image, corner.centre_px, half_window_px);
    if (half_window_px < kLeastHalfWindow_px) return std::nullopt;
    const cv::Mat window = window_at(image, corner.centre_px, half_window_px);
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for_each_gradient(window, half_window_px,
                      [&](const Eigen::Vector2d& p, const Eigen::Vector2d& g, double weight) {
                        normal += weight * g * g.transpose();
                        right += weight * g * g.dot(p);
                      });
    const double trace = normal.trace();
    if (trace <= 0 || normal.determinant() < 1e-4 * trace * trace) return std::nullopt;
    const Eigen::Vector2d step = normal.inverse() * right;
    corner.centre_px += step;
    if ((corner.centre_px - start_px).cwiseAbs().maxCoeff() > most_px) return std::nullopt;
    if (step.norm() > kConverged_px) continue;
    corner.normal_matrix = normal;
    corner.score_squares = score_squares(window, half_window_px);
    return corner;
  }
  return std::nullopt;
}

}  // namespace

std::optional<CornerPoint> find_corner_point(const GreyImage& image,
                                             const Eigen::Vector2d& start_px, int half_window_px) {
  auto start = point_of_gradients(image, start_px, half_window_px);
  if (!start) return std::nullopt;
  const int used_px = start->half_window_px;
  auto fit = fit_saddle(image, start->centre_px, used_px + 0.5);
  if (!fit || (fit->centre_px - start->centre_px).norm() >= 0.5 * used_px) return start;
  fit->half_window_px = used_px;
  return fit;
}

}  // namespace drape::detect
