// SPDX-License-Identifier: Apache-2.0

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "detect/targets/board.hpp"

namespace drape::detect {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;

constexpr int kMostSaddleSteps = 40;
constexpr double kSaddleConverged_px = 1e-4;
constexpr double kCentred_px = 0.02;  ///< largest offset of the window from the corner
constexpr int kDirections = 36;       ///< directions per half turn, for the initial values
constexpr double kFirstBlur_px = 0.8, kLeastBlur_px = 0.15;
/// Least sine of the angle between the edges; below it they count as one line.
constexpr double kLeastSine = 0.2;
/// Width of the window's rim, over which weights fall to zero, so that none jumps when it moves.
constexpr double kRim_px = 1.5;

/// Parameters: cx, cy, directions of both edges, m, k, log s, g.
using Parameters = Eigen::Matrix<double, 9, 1>;
enum Index { kX, kY, kFirst = 2, kSecond = 3, kMiddle, kContrast, kBlur, kLightX, kLightY };

/// Score of a corner's position by direction. Noise of neighbouring pixels is correlated, so each
/// eighth of a turn is one observation, together with the opposite one, which cancels the effect of
/// symmetric misfits.
class Scores {
 public:
  void add(const Vector2d& from_centre, const Vector2d& score) {
    const double turn = std::atan2(from_centre.y(), from_centre.x()) / (2 * kPi) + 0.5;
    scores_.col(static_cast<int>(turn * 8) % 4) += score;
  }
  [[nodiscard]] Matrix2d squares() const { return scores_ * scores_.transpose(); }

 private:
  Eigen::Matrix<double, 2, 4> scores_ = Eigen::Matrix<double, 2, 4>::Zero();
};

/// True if the information of a corner determines it along both axes.
bool determines_point(const Matrix2d& information) {
  const double trace = information.trace();
  return trace > 0 && information.determinant() >= 1e-4 * trace * trace;
}

struct Pixel {
  Vector2d at;  ///< relative to the first centre
  double level = 0, weight = 1;
};

std::vector<Pixel> window_of(const GreyImage& image, const Vector2d& centre, double radius) {
  std::vector<Pixel> window;
  const int left = static_cast<int>(std::ceil(centre.x() - radius));
  const int right = static_cast<int>(std::floor(centre.x() + radius));
  const int top = static_cast<int>(std::ceil(centre.y() - radius));
  const int bottom = static_cast<int>(std::floor(centre.y() + radius));
  if (left < 0 || top < 0 || right >= image.width_px || bottom >= image.height_px) return window;
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const Vector2d at = Vector2d(x, y) - centre;
      const double inside = radius - at.norm();
      if (inside > 0) window.push_back({at, image.level(x, y), std::min(1.0, inside / kRim_px)});
    }
  }
  return window;
}

/// Directions of the two edges whose quadrants explain the levels best. Uses the mean of opposite
/// levels per direction, so that a gradient of the light or an off-centre start has little
/// effect.
std::optional<Parameters> start_of(const std::vector<Pixel>& window, double radius) {
  std::array<double, kDirections> sums{}, weights{};
  for (const Pixel& pixel : window) {
    if (pixel.at.norm() < 0.3 * radius) continue;
    const double turn = std::atan2(pixel.at.y(), pixel.at.x()) / kPi + 1;
    const auto bin = static_cast<std::size_t>(turn * kDirections) % kDirections;
    sums[bin] += pixel.weight * pixel.level;
    weights[bin] += pixel.weight;
  }
  // Cumulative sums over directions, so that a sector's sum is a difference.
  std::array<double, kDirections + 1> level{}, weight{};
  for (std::size_t i = 0; i < kDirections; ++i) {
    level[i + 1] = level[i] + sums[i];
    weight[i + 1] = weight[i] + weights[i];
  }
  const double all = level[kDirections], whole = weight[kDirections];
  double best = 0;
  std::optional<Parameters> start;
  for (std::size_t a = 0; a < kDirections; ++a) {
    for (std::size_t b = a + 1; b < kDirections; ++b) {
      const double inside = weight[b] - weight[a], outside = whole - inside;
      if (inside <= 0 || outside <= 0) continue;
      const double in = (level[b] - level[a]) / inside;
      const double out = (all - level[b] + level[a]) / outside;
      const double explained = inside * outside / whole * (in - out) * (in - out);
      if (explained <= best) continue;
      best = explained;
      Parameters found = Parameters::Zero();
      found[kFirst] = kPi * static_cast<double>(a) / kDirections;
      found[kSecond] = kPi * static_cast<double>(b) / kDirections;
      found[kMiddle] = (in + out) / 2;
      // Between the two edges the distances have opposite signs.
      found[kContrast] = (out - in) / 2;
      found[kBlur] = std::log(kFirstBlur_px);
      start = found;
    }
  }
  return start;
}

/// Correction for edges that are not perpendicular: mean of the product of the blurred signs of two
/// edges minus the product of their means (Drezner and Wesolowsky 1990, integrated over the angle).
class JointExcess {
 public:
  explicit JointExcess(double angle) {
    constexpr std::array<double, 3> kNodes = {0.2386191860831969, 0.6612093864662645,
                                              0.9324695142031521};
    constexpr std::array<double, 3> kWeights = {0.4679139345726910, 0.3607615730481386,
                                                0.1713244923791704};
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const double t = angle / 2 * (1 + (i % 2 == 0 ? -1 : 1) * kNodes[i / 2]);
      const double cosine = std::cos(t);
      nodes_[i] = {2 / kPi * angle / 2 * kWeights[i / 2], std::sin(t), -0.5 / (cosine * cosine)};
    }
  }
  [[nodiscard]] double at(double a, double b) const {
    double sum = 0;
    for (const Node& node : nodes_)
      sum += node.weight * std::exp(node.factor * (a * a + b * b - 2 * a * b * node.sine));
    return sum;
  }

 private:
  struct Node {
    double weight = 0, sine = 0, factor = 0;
  };
  std::array<Node, 6> nodes_;
};

/// Distance from the nearer edge, in blurs, beyond which the two edges do not interact.
constexpr double kFar = 6;

/// An edge through the corner.
struct Edge {
  Vector2d along, normal;
  explicit Edge(double direction)
      : along(std::cos(direction), std::sin(direction)), normal(-along.y(), along.x()) {}
};

/// Distance of a point from an edge in blurs, the blurred sign of its side, and that sign's
/// derivative far from the other edge.
struct Side {
  double sigmas = 0, value = 0, slope = 0;
  explicit Side(double distance) : sigmas(distance), value(distance < 0 ? -1 : 1) {
    if (!is_near()) return;
    value = std::erf(sigmas / std::numbers::sqrt2);
    slope = std::sqrt(2 / kPi) * std::exp(-0.5 * sigmas * sigmas);
  }
  [[nodiscard]] bool is_near() const { return std::abs(sigmas) < kFar; }
};

/// Nodes of three-point Gauss-Legendre quadrature across a pixel.
constexpr std::array<double, 3> kPixelPoints_px = {-0.3872983346207417, 0, 0.3872983346207417};
constexpr std::array<double, 3> kPixelWeights = {5.0 / 18, 8.0 / 18, 5.0 / 18};
/// Above this blur, integration over a pixel is equivalent to slightly more blur.
constexpr double kBlurOfAreas_px = 0.6;

/// Two blurred edges that cross, with the residuals and derivatives of every pixel.
class Saddle {
 public:
  explicit Saddle(const Parameters& p)
      : p_(p),
        blur_(std::exp(p[kBlur])),
        first_(p[kFirst]),
        second_(p[kSecond]),
        cosine_(first_.normal.dot(second_.normal)),
        sine_(std::sin(p[kSecond] - p[kFirst])),
        excess_(std::asin(cosine_)) {}

  /// Level at a point, with its derivatives by the parameters.
  double level_of_point(const Vector2d& at, Parameters& derivatives) const {
    const Vector2d from_centre = at - p_.head<2>();
    const Side first(first_.normal.dot(from_centre) / blur_);
    const Side second(second_.normal.dot(from_centre) / blur_);
    const double width = std::numbers::sqrt2 * std::abs(sine_);
    const bool blended = first.is_near() && second.is_near();
    const double product =
        first.value * second.value + (blended ? excess_.at(first.sigmas, second.sigmas) : 0);
    const double surface = p_[kMiddle] + p_[kContrast] * product;
    const double light = 1 + p_.tail<2>().dot(at);
    const double scale = light * p_[kContrast];
    const auto by = [&](const Side& side, const Side& other) {
      return side.is_near()
                 ? scale * side.slope * std::erf((other.sigmas - cosine_ * side.sigmas) / width)
                 : 0;
    };
    const double by_first = by(first, second), by_second = by(second, first);
    const double by_cosine =
        blended ? scale * 2 / (kPi * std::abs(sine_)) *
                      std::exp(-0.5 *
                               (first.sigmas * first.sigmas + second.sigmas * second.sigmas -
                                2 * cosine_ * first.sigmas * second.sigmas) /
                               (sine_ * sine_))
                : 0;
    derivatives.head<2>() = -(by_first * first_.normal + by_second * second_.normal) / blur_;
    derivatives[kFirst] = -by_first * first_.along.dot(from_centre) / blur_ + by_cosine * sine_;
    derivatives[kSecond] = -by_second * second_.along.dot(from_centre) / blur_ - by_cosine * sine_;
    derivatives[kMiddle] = light;
    derivatives[kContrast] = light * product;
    derivatives[kBlur] = -by_first * first.sigmas - by_second * second.sigmas;
    derivatives.tail<2>() = surface * at;
    return light * surface;
  }
  /// Mean level over the area of a pixel, with its derivatives by the parameters.
  double level_at(const Vector2d& at, Parameters& derivatives) const {
    const Vector2d from_centre = at - p_.head<2>();
    const double nearest = std::min(std::abs(first_.normal.dot(from_centre)),
                                    std::abs(second_.normal.dot(from_centre)));
    if (blur_ > kBlurOfAreas_px || nearest > kFar * blur_ + 1)
      return level_of_point(at, derivatives);
    double level = 0;
    Parameters part;
    derivatives.setZero();
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        const double weight = kPixelWeights[i] * kPixelWeights[j];
        const Vector2d within(kPixelPoints_px[i], kPixelPoints_px[j]);
        level += weight * level_of_point(at + within, part);
        derivatives += weight * part;
      }
    }
    return level;
  }

 private:
  Parameters p_;
  double blur_;
  Edge first_, second_;
  double cosine_, sine_;
  JointExcess excess_;
};

struct Normal {
  Eigen::Matrix<double, 9, 9> matrix = Eigen::Matrix<double, 9, 9>::Zero();
  Parameters right = Parameters::Zero();
  double squares = 0;
};

Normal normal_at(const std::vector<Pixel>& window, const Parameters& p) {
  Normal normal;
  Parameters derivatives;
  const Saddle saddle(p);
  for (const Pixel& pixel : window) {
    const double miss = pixel.level - saddle.level_at(pixel.at, derivatives);
    normal.matrix.selfadjointView<Eigen::Lower>().rankUpdate(derivatives, pixel.weight);
    normal.right += pixel.weight * miss * derivatives;
    normal.squares += pixel.weight * miss * miss;
  }
  normal.matrix = normal.matrix.selfadjointView<Eigen::Lower>();
  return normal;
}

bool is_corner(const Parameters& p, double radius) {
  const double blur = std::exp(p[kBlur]);
  return p.allFinite() && p.head<2>().norm() < 0.5 * radius && blur < 0.7 * radius &&
         std::abs(std::sin(p[kSecond] - p[kFirst])) > kLeastSine;
}

/// Gauss-Newton with Levenberg-Marquardt damping until a step moves the corner by less than
/// `converged_px`.
std::optional<Parameters> fitted(const std::vector<Pixel>& window, Parameters p, double radius,
                                 double converged_px) {
  double damping = 1e-3;
  Normal normal = normal_at(window, p);
  for (int iteration = 0; iteration < kMostSaddleSteps; ++iteration) {
    Eigen::Matrix<double, 9, 9> damped = normal.matrix;
    damped.diagonal() *= 1 + damping;
    const Parameters step = damped.ldlt().solve(normal.right);
    Parameters next = p + step;
    next[kBlur] = std::max(next[kBlur], std::log(kLeastBlur_px));
    if (!is_corner(next, radius)) {
      if (damping > 1e6) return std::nullopt;
      damping *= 10;
      continue;
    }
    const Normal at_next = normal_at(window, next);
    if (at_next.squares > normal.squares) {
      // Rounding at the minimum: no step reduces the cost any more.
      if (step.head<2>().norm() < converged_px) return p;
      damping *= 10;
      continue;
    }
    p = next;
    normal = at_next;
    damping = std::max(damping / 10, 1e-9);
    if (step.head<2>().norm() < converged_px) return p;
  }
  return std::nullopt;
}

/// Squared scores of the centre after projecting out the other parameters.
Matrix2d score_squares(const std::vector<Pixel>& window, const Parameters& p,
                       const Eigen::Matrix<double, 2, 7>& taken_up) {
  Scores scores;
  Parameters derivatives;
  const Saddle saddle(p);
  for (const Pixel& pixel : window) {
    const double miss = pixel.level - saddle.level_at(pixel.at, derivatives);
    scores.add(pixel.at - p.head<2>(),
               pixel.weight * miss * (derivatives.head<2>() - taken_up * derivatives.tail<7>()));
  }
  return scores.squares();
}

constexpr int kMaxIterations = 50;
constexpr double kConverged_px = 1e-4;

/// Grey levels around a subpixel position, one pixel wider than the window.
cv::Mat window_at(const cv::Mat& image, const Vector2d& centre_px, int half_window_px) {
  cv::Mat window;
  const int side = 2 * (half_window_px + 1) + 1;
  cv::getRectSubPix(
      image, cv::Size(side, side),
      cv::Point2f(static_cast<float>(centre_px.x()), static_cast<float>(centre_px.y())), window,
      CV_32F);
  return window;
}

/// Calls visit(offset from the window's centre, gradient, weight) for each pixel of the window.
template <class Visit>
void for_each_gradient(const cv::Mat& window, int half_window_px, const Visit& visit) {
  const double width = half_window_px;
  for (int y = -half_window_px; y <= half_window_px; ++y) {
    for (int x = -half_window_px; x <= half_window_px; ++x) {
      const int row = y + half_window_px + 1, col = x + half_window_px + 1;
      const Vector2d gradient(
          0.5 * (window.at<float>(row, col + 1) - window.at<float>(row, col - 1)),
          0.5 * (window.at<float>(row + 1, col) - window.at<float>(row - 1, col)));
      visit(Vector2d(x, y), gradient, std::exp(-(x * x + y * y) / (width * width)));
    }
  }
}

/// Largest half window inside the image, up to the requested one.
int half_window_within(const cv::Mat& image, const Vector2d& px, int half_window_px) {
  if (!px.allFinite()) return 0;
  const double free_px =
      std::min({px.x(), px.y(), image.cols - 1 - px.x(), image.rows - 1 - px.y()});
  // Gradients need one more pixel.
  return free_px < 1 ? 0 : std::min(half_window_px, static_cast<int>(std::floor(free_px - 1)));
}

std::optional<CornerPoint> point_of_gradients(const GreyImage& picture, const Vector2d& start_px,
                                              int most_px) {
  const cv::Mat image = view_of(picture);
  CornerPoint corner{start_px, Matrix2d::Zero(), Matrix2d::Zero(), most_px};
  int& half_window_px = corner.half_window_px;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    half_window_px = half_window_within(image, corner.centre_px, half_window_px);
    if (half_window_px < kLeastHalfWindow_px) return std::nullopt;
    const cv::Mat window = window_at(image, corner.centre_px, half_window_px);
    Matrix2d normal = Matrix2d::Zero();
    Vector2d right = Vector2d::Zero();
    for_each_gradient(window, half_window_px,
                      [&](const Vector2d& p, const Vector2d& g, double weight) {
                        normal += weight * g * g.transpose();
                        right += weight * g * g.dot(p);
                      });
    if (!determines_point(normal)) return std::nullopt;
    const Vector2d step = normal.inverse() * right;
    corner.centre_px += step;
    if ((corner.centre_px - start_px).cwiseAbs().maxCoeff() > most_px) return std::nullopt;
    if (step.norm() > kConverged_px) continue;
    corner.normal_matrix = normal;
    Scores scores;
    for_each_gradient(window, half_window_px,
                      [&](const Vector2d& p, const Vector2d& g, double weight) {
                        scores.add(p, weight * g * g.dot(p));
                      });
    corner.score_squares = scores.squares();
    return corner;
  }
  return std::nullopt;
}

/// Degree of the polynomial in the board's plane that models lens distortion of the homography: at
/// least two and a half corners for each of its terms.
int degree_for(std::size_t corners) {
  for (const int degree : {4, 3, 2}) {
    const int terms = (degree + 1) * (degree + 2) / 2;
    if (static_cast<double>(corners) >= 2.5 * terms) return degree;
  }
  return 1;
}

Eigen::VectorXd terms_at(const Vector2d& at, int degree) {
  Eigen::VectorXd terms((degree + 1) * (degree + 2) / 2);
  Eigen::Index i = 0;
  for (int x = 0; x <= degree; ++x)
    for (int y = 0; x + y <= degree; ++y) terms[i++] = std::pow(at.x(), x) * std::pow(at.y(), y);
  return terms;
}

/// Variance of a corner along one axis, px^2, from the residuals of a smooth map of the board's
/// plane: the best homography, then a polynomial of its image. The median is robust (2 ln 2 for a
/// circular normal error).
std::optional<double> scatter_px2(const Target& target, const FrameDetections& frame) {
  const std::size_t corners = frame.detections.size();
  if (corners < 8) return std::nullopt;
  std::vector<Vector2d> board, seen, flat;
  for (const Detection& corner : frame.detections) {
    board.emplace_back(target.point_in_target(corner.mark).head<2>() / target.pitch_m);
    seen.push_back(corner.centre_px);
  }
  const auto map = projective_map(board, seen);
  if (!map) return std::nullopt;
  Vector2d middle = Vector2d::Zero();
  for (const Vector2d& at : board) {
    flat.push_back(mapped(*map, at));
    middle += flat.back() / static_cast<double>(corners);
  }
  double size = 0;
  for (const Vector2d& at : flat) size = std::max(size, (at - middle).norm());
  const int degree = degree_for(corners);
  const Eigen::Index terms = (degree + 1) * (degree + 2) / 2;
  Eigen::MatrixXd design(corners, terms);
  Eigen::MatrixX2d off(corners, 2);
  for (std::size_t i = 0; i < corners; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    design.row(row) = terms_at((flat[i] - middle) / size, degree).transpose();
    off.row(row) = (seen[i] - flat[i]).transpose();
  }
  // Three reweighted passes (Huber) reduce the influence of outlying corners.
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(corners));
  std::vector<double> squares(corners);
  double typical = 0;
  for (int pass = 0; pass < 3; ++pass) {
    const Eigen::MatrixXd weighted = weights.asDiagonal() * design;
    const auto normal = (design.transpose() * weighted).ldlt();
    const Eigen::MatrixX2d left = off - design * normal.solve(weighted.transpose() * off);
    for (std::size_t i = 0; i < corners; ++i) {
      // Corrects for the share of a corner's error that the fit absorbs.
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

std::optional<CornerPoint> fit_saddle(const GreyImage& image, const Vector2d& start_px,
                                      double radius_px) {
  if (!start_px.allFinite()) return std::nullopt;
  Vector2d middle = start_px;
  std::vector<Pixel> window = window_of(image, middle, radius_px);
  if (window.size() < 2 * Parameters::RowsAtCompileTime) return std::nullopt;
  const auto start = start_of(window, radius_px);
  if (!start) return std::nullopt;
  auto p = fitted(window, *start, radius_px, kCentred_px);
  if (!p) return std::nullopt;
  // Repeats in a window centred on the corner, in which remaining model errors are symmetric.
  middle += p->head<2>();
  window = window_of(image, middle, radius_px);
  if (window.empty()) return std::nullopt;
  p->head<2>().setZero();
  p = fitted(window, *p, radius_px, kSaddleConverged_px);
  if (!p) return std::nullopt;
  const Eigen::Matrix<double, 9, 9> normal = normal_at(window, *p).matrix;
  const Eigen::Matrix<double, 2, 7> taken_up =
      normal.bottomRightCorner<7, 7>().ldlt().solve(normal.bottomLeftCorner<7, 2>()).transpose();
  CornerPoint fit;
  fit.centre_px = middle + p->head<2>();
  fit.normal_matrix = normal.topLeftCorner<2, 2>() - taken_up * normal.bottomLeftCorner<7, 2>();
  fit.score_squares = score_squares(window, *p, taken_up);
  if (!determines_point(fit.normal_matrix)) return std::nullopt;
  return fit;
}

std::optional<CornerPoint> find_corner_point(const GreyImage& image, const Vector2d& start_px,
                                             int half_window_px) {
  auto start = point_of_gradients(image, start_px, half_window_px);
  if (!start) return std::nullopt;
  const int used_px = start->half_window_px;
  auto fit = fit_saddle(image, start->centre_px, used_px + 0.5);
  if (!fit || (fit->centre_px - start->centre_px).norm() >= 0.5 * used_px) return start;
  fit->half_window_px = used_px;
  return fit;
}

std::optional<Eigen::Matrix3d> projective_map(const std::vector<Vector2d>& from,
                                              const std::vector<Vector2d>& to) {
  const auto points = [](const std::vector<Vector2d>& all) {
    return cv::Mat(static_cast<int>(all.size()), 2, CV_64F,
                   const_cast<double*>(all.front().data()));
  };
  const cv::Mat found = cv::findHomography(points(from), points(to), 0);
  if (found.empty()) return std::nullopt;
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(found.ptr<double>());
}

void set_corner_covariances(const Target& target, const std::vector<CornerPoint>& points,
                            FrameDetections& frame) {
  std::vector<double> scores, variances;
  for (const CornerPoint& point : points) {
    const Matrix2d inverse = point.normal_matrix.inverse();
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
