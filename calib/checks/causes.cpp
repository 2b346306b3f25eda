// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/causes.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "calib/joint/start.hpp"
#include "calib/joint/uncertainty.hpp"
#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::Index, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d, Eigen::VectorXd;

namespace {

/// False-alarm probability of each of the three tests of a rig: 1 in 1,000 for all together.
constexpr double kFalseAlarms = 1e-3 / 3;

/// Additional parameters of a fit, estimated with all others to first order.
struct MoreParameters {
  Eigen::VectorXd estimate;    ///< empty if the views cannot determine them
  Eigen::MatrixXd covariance;  ///< from the scatter between views
  double p = 1;                ///< probability of a larger deviation from 0 (Hotelling 1931)
  double explained = 0;        ///< decrease of the weighted sum of squares
  Eigen::MatrixXd others;      ///< change of the other parameters without each, per unit

  /// Change of all parameters of the views' information, these last.
  [[nodiscard]] Eigen::VectorXd step() const;
};

VectorXd MoreParameters::step() const {
  VectorXd step(others.rows() + estimate.size());
  step << -others * estimate, estimate;
  return step;
}

/// `views` comes from information_by_view() with the additional parameters last.
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

/// A bias below this many stated standard deviations is covered by the stated interval.
constexpr double kHarmSigmas = 3;
constexpr double kNowhere = std::numeric_limits<double>::infinity();

constexpr const char* kRemedy =
    "use a lens of less view, or undistort its pictures by a fisheye model (OpenCV's "
    "fisheye::undistortImage) before they are imported and calibrate with those";

/// Radius covered by a camera's points: largest distance from the axis at depth 1.
double largest_radius(const JointModel& model, std::size_t camera) {
  double largest = 0;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    for (const TargetPoint& point : frame.points) {
      const Vector3d at =
          model.cameras[camera].camera.cam_from_world *
          (model.placements[frame.placement].world_from_target * point.point_in_target);
      largest = std::max(largest, at.head<2>().norm() / at.z());
    }
  }
  return largest;
}

double miss_of(const JointCamera& camera, const Placement& placement, const Board& board,
               const TargetPoint& point) {
  const auto px = pixel_of(camera, placement, board, point.point_in_target, point.place);
  return px ? (whitener(point.covariance_px2) * (*px - point.px())).norm() : kNowhere;
}

/// Median and 90 % quantile of a camera's residuals, in standard deviations. A robust fit may keep
/// the median low by giving up the points at the rim of a wide picture.
using Misses = Eigen::Array2d;
const Misses kExpectedMisses(kRayleighMedian, 2.1460);  // of a Rayleigh distribution

Misses quantiles(std::vector<double> misses) {
  if (misses.empty()) return Misses::Constant(kNowhere);
  std::sort(misses.begin(), misses.end());
  return {misses[misses.size() / 2], misses[misses.size() * 9 / 10]};
}

/// Residuals in the fit of all cameras.
Misses misses_together(const JointModel& model, std::size_t index) {
  std::vector<double> misses;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != index) continue;
    for (const TargetPoint& point : frame.points)
      misses.push_back(
          miss_of(model.cameras[index], model.placements[frame.placement], model.board, point));
  }
  return quantiles(std::move(misses));
}

/// Residuals in a fit of the camera's own views.
Misses misses_alone(JointModel model, std::size_t index) {
  SeenTargets alone;
  std::vector<std::string> dropped;
  try {
    alone = solve_alone(model, index, false, dropped, LensTerms::k1_k2_p1_p2_k3);
  } catch (const Error&) {
    return quantiles({});
  }
  JointCamera camera = model.cameras[index];
  camera.camera.cam_from_world = {};
  std::vector<double> misses;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (model.frames[f].camera != index) continue;
    for (const TargetPoint& point : model.frames[f].points) {
      misses.push_back(kNowhere);
      if (!alone[f]) continue;
      const CamFromTarget& pose = alone[f]->cam_from_target;
      misses.back() =
          miss_of(camera, {"", {pose.rotation, pose.translation_m}, true}, model.board, point);
    }
  }
  return quantiles(std::move(misses));
}

/// Converts the camera's points to those of a distortion-free lens, assuming an equidistant fisheye
/// of this focal length (r = f angle). Frames with fewer than four points are dropped.
JointModel without_fisheye(const JointModel& model, std::size_t index, double focal_px) {
  JointModel straight = model;
  const CameraModel& image = model.cameras[index].camera.model;
  const Vector2d middle((image.width_px - 1) / 2.0, (image.height_px - 1) / 2.0);
  std::erase_if(straight.frames, [&](const JointFrame& frame) { return frame.camera != index; });
  for (JointFrame& frame : straight.frames) {
    std::vector<TargetPoint> seen;
    for (TargetPoint point : frame.points) {
      const Vector2d off = point.px() - middle;
      const double angle = off.norm() / focal_px;
      if (angle > 1.45 || angle < 1e-9) continue;  // 83 degrees; the tangent diverges at 90
      const Vector2d along = off.normalized();
      const double tangent = std::tan(angle);
      const Eigen::Matrix2d radial = along * along.transpose();
      const Eigen::Matrix2d grows = (1 + tangent * tangent) * radial +
                                    tangent / angle * (Eigen::Matrix2d::Identity() - radial);
      point.measured_px = middle + focal_px * tangent * along;
      point.eccentricity_px.setZero();
      point.covariance_px2 = (grows * point.covariance_px2 * grows.transpose()).eval();
      seen.push_back(point);
    }
    frame.points = std::move(seen);
  }
  std::erase_if(straight.frames, [](const JointFrame& frame) { return frame.points.size() < 4; });
  return straight;
}

std::string fisheye(const JointModel& model, std::size_t index) {
  // One camera's parallel views may not determine a lens that all cameras together do.
  Misses brown = misses_together(model, index);
  const auto is_poor = [&] { return (brown > 2 * kExpectedMisses).any(); };
  if (is_poor()) brown = brown.min(misses_alone(model, index));
  // If cameras contradict each other, the board fitted to all of them is unreliable too.
  if (JointModel drawn = model; is_poor()) {
    drawn.board.edge_rise_mm.setZero();
    brown = brown.min(misses_alone(std::move(drawn), index));
  }
  if (!is_poor()) return "";
  const CameraModel& image = model.cameras[index].camera.model;
  const double half_px = std::hypot(image.width_px, image.height_px) / 2;
  double best = kNowhere, best_deg = 64;
  std::string found;
  const auto attempt = [&](double half_deg) {
    const Misses misses =
        misses_alone(without_fisheye(model, index, half_px / (half_deg * units::deg)), index);
    for (const int i : {0, 1}) {
      if (!(brown[i] > 2 * kExpectedMisses[i]) || !(misses[i] < best * brown[i])) continue;
      best = misses[i] / brown[i];
      best_deg = half_deg;
      found = fmt::format(
          "{}: its lens is wider than the lens model: a fisheye lens of about {:.0f} deg across "
          "fits {} of its points within {:.1f} standard deviations, Brown's lens within {:.1f}; {}",
          model.cameras[index].camera.name, 2 * half_deg, i == 0 ? "half" : "nine tenths",
          misses[i], brown[i], kRemedy);
    }
  };
  for (const double half_deg : {40.0, 52.0, 64.0, 76.0, 90.0, 105.0}) attempt(half_deg);
  for (const double step_deg : {6.0, 3.0, 1.5}) {
    const double middle_deg = best_deg;
    for (const double side : {-1.0, 1.0}) attempt(middle_deg + side * step_deg);
  }
  return best < 1 / std::sqrt(2.0) ? found : "";
}

/// Fits a further radial image height to a camera's points: `height_px` of the distance from the
/// axis at depth 1, less what Brown's radial terms take up of it.
MoreParameters radial_term(const JointModel& model, const JointFit& fit, std::size_t index,
                           const std::function<double(double)>& height_px) {
  const auto place_of = [&](const JointFrame& frame, const TargetPoint& point) -> Vector2d {
    const Vector3d at =
        model.cameras[index].camera.cam_from_world *
        (model.placements[frame.placement].world_from_target * point.point_in_target);
    return at.head<2>() / at.z();
  };
  std::vector<double> radii;
  for (const JointFrame& frame : model.frames)
    for (const TargetPoint& point : frame.points)
      if (frame.camera == index) radii.push_back(place_of(frame, point).norm());
  const double reach = largest_radius(model, index);
  const auto brown = [&](double radius) -> Eigen::RowVector4d {
    const double x = radius / reach;
    return {x, std::pow(x, 3), std::pow(x, 5), std::pow(x, 7)};
  };
  MatrixXd terms(static_cast<Index>(radii.size()), 4);
  VectorXd heights(terms.rows());
  for (Index i = 0; i < terms.rows(); ++i) {
    const double radius = radii[static_cast<std::size_t>(i)];
    terms.row(i) = brown(radius);
    heights[i] = height_px(radius);
  }
  const Eigen::Vector4d taken = terms.colPivHouseholderQr().solve(heights);
  const auto column = [&](const JointFrame& frame) -> Eigen::MatrixXd {
    VectorXd d = VectorXd::Zero(2 * static_cast<Index>(frame.points.size()));
    if (frame.camera != index) return d;
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      const Vector2d place = place_of(frame, frame.points[i]);
      const double radius = place.norm();
      d.segment<2>(2 * static_cast<Index>(i)) =
          (height_px(radius) - brown(radius) * taken) * place.normalized();
    }
    return d;
  };
  return fit_more(information_by_view(model, fit, {1, column}), 1);
}

/// Tests Brown's lens against fisheye lenses (P test, Davidson and MacKinnon 1981): in
/// (1 - s) Brown + s fisheye the share s is 0 for one and 1 for the other. Fisheye projections lie
/// between the stereographic and the orthographic one.
std::string likelier_fisheye(const JointModel& fitted, const JointFit& fit, std::size_t index) {
  const auto stereographic = [](double radius) { return 2 * std::tan(std::atan(radius) / 2); };
  const auto orthographic = [](double radius) { return std::sin(std::atan(radius)); };
  const CameraModel& image = fitted.cameras[index].camera.model;
  const auto& lens = std::get<BrownLens>(image.lens);
  const double reach = largest_radius(fitted, index), squared = reach * reach;
  if (!std::isfinite(reach)) return "";
  const double brown = 1 + squared * (lens.k1 + squared * (lens.k2 + squared * lens.k3));
  if (2 * brown > 1 + stereographic(reach) / reach) return "";  // nearer to a perspective image
  const JointModel model = fit_joint(fitted, fit, {}).model;
  const auto share_of = [&](const std::function<double(double)>& height) {
    return radial_term(model, fit, index,
                       [&](double radius) { return lens.fx_px * height(radius); });
  };
  const MoreParameters least = share_of(stereographic), most = share_of(orthographic);
  const double p = std::max(least.p, most.p);
  if (!(p * static_cast<double>(model.cameras.size()) < kFalseAlarms / 2)) return "";
  if (!(least.estimate[0] > 0.5) || !(most.estimate[0] < 1.5)) return "";
  return fmt::format(
      "{}: its lens is wider than the lens model: a fisheye lens of about {:.0f} deg across "
      "describes its points, up to {:.0f} deg off the axis, better than Brown's lens (probability "
      "by chance {:.0e}); {}",
      fitted.cameras[index].camera.name,
      std::hypot(image.width_px, image.height_px) / lens.fx_px / units::deg,
      std::atan(reach) / units::deg, p, kRemedy);
}

std::string missing_term(const JointModel& model, const JointFit& fit, const ViewScatter& scatter,
                         std::size_t index) {
  const double reach = largest_radius(model, index);
  const MoreParameters term =
      radial_term(model, fit, index, [&](double radius) { return std::pow(radius / reach, 9); });
  if (term.p * static_cast<double>(model.cameras.size()) > kFalseAlarms / 2) return "";
  const auto focal = static_cast<Index>(index * moved_camera_parameters(fit).size());
  const double moved_px = std::abs(term.others(focal, 0) * term.estimate[0]);
  const double sigmas = moved_px / std::sqrt(scatter.covariance(focal, focal));
  if (!(sigmas > kHarmSigmas)) return "";
  return fmt::format(
      "{}: its lens is wider than the lens model: a radial term of ninth order is missing, which "
      "moves the focal length by {:.1f} px, {:.0f} standard deviations, with points up to {:.0f} "
      "deg off the axis; {}",
      model.cameras[index].camera.name, moved_px, sigmas, std::atan(reach) / units::deg, kRemedy);
}

/// Names the first camera whose lens is too wide for Brown's model; empty if there is none. Three
/// tests: an equidistant fisheye lens combined with Brown's terms fits the camera's own views with
/// residuals below 1/sqrt(2) (half the squares); a fisheye lens alone is likelier than Brown's by
/// more than chance; or a further radial term changes the focal length by more than three stated
/// standard deviations, judged by the views' scatter.
std::string wide_lens(const JointModel& model, JointFit fit) {
  fit.lens = LensTerms::k1_k2_p1_p2_k3;
  const ViewScatter scatter = scatter_of_views(model, fit, 1);
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    if (std::string reason = fisheye(model, c); !reason.empty()) return reason;
    if (std::string reason = likelier_fisheye(model, fit, c); !reason.empty()) return reason;
    if (scatter.covariance.size() == 0) continue;
    if (std::string reason = missing_term(model, fit, scatter, c); !reason.empty()) return reason;
  }
  return "";
}

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Derivative of pixels by the placement's rotation (rad) and shift (mm), 2 rows per point.
MatrixXd by_placement(const JointModel& model, const JointFrame& frame) {
  MatrixXd d = MatrixXd::Zero(2 * static_cast<Index>(frame.points.size()), placement_parameters);
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const auto image = image_of(model, frame, frame.points[i]);
    if (image) d.middleRows<2>(2 * static_cast<Index>(i)) = image->by_placement;
  }
  return d;
}

/// A camera that sees the moving target later than the others.
struct TimeSkew {
  std::size_t camera = 0;
  double sets = 0, sd_sets = 0;  ///< lag, in intervals between sets; negative if early
  double explained = 0;          ///< share of the weighted sum of squares
  double effect_px = 0;          ///< RMS effect on images of the moving target
};

constexpr int kReach = 2;  ///< neighbouring sets on each side used to estimate motion

/// Motion of the target at a placement (rad and mm per set): slope of the polynomial through it and
/// up to `reach` neighbours on each side. A placement known from rig.toml has no motion and is not
/// used as a neighbour, since it was positioned separately.
std::optional<Vector6d> velocity(const JointModel& model, std::size_t placement,
                                 int reach = kReach) {
  const Placement& here = model.placements[placement];
  if (here.known) return std::nullopt;
  std::vector<std::pair<double, Vector6d>> neighbours;  // number of sets from here, change of pose
  for (int sets = -reach; sets <= reach; ++sets) {
    if (sets == 0) continue;
    const std::size_t at = placement + static_cast<std::size_t>(sets);  // negative wraps to large
    if (at >= model.placements.size() || model.placements[at].known) continue;
    const WorldFromTarget &from = here.world_from_target,
                          &to = model.placements[at].world_from_target;
    Vector6d change;
    change << rotation_vector(to.rotation * from.rotation.transpose()),
        (to.translation_m - from.translation_m) / units::mm;
    neighbours.emplace_back(sets, change);
  }
  if (neighbours.size() < static_cast<std::size_t>(reach)) return std::nullopt;
  Vector6d slope = Vector6d::Zero();
  for (const auto& [sets, change] : neighbours) {
    double weight = 1 / sets;
    for (const auto& [other, unused] : neighbours)
      if (other != sets) weight *= other / (other - sets);
    slope += weight * change;
  }
  return slope;
}

/// RMS displacement (px) of a camera's points as the target moves from set to set.
double motion_px(const JointModel& model, std::size_t camera) {
  double squares = 0;
  std::size_t points = 0;
  for (const JointFrame& frame : model.frames) {
    const auto v = velocity(model, frame.placement);
    if (frame.camera != camera || !v) continue;
    squares += (by_placement(model, frame) * *v).squaredNorm();
    points += frame.points.size();
  }
  return points > 0 ? std::sqrt(squares / static_cast<double>(points)) : 0;
}

/// Derivative by the lags of `count` cameras starting with `first`.
MoreColumns lags_from(const JointModel& model, std::size_t first, Index count, int reach) {
  return {count, [&model, first, count, reach](const JointFrame& frame) {
            MatrixXd d = MatrixXd::Zero(2 * static_cast<Index>(frame.points.size()), count);
            const auto v = velocity(model, frame.placement, reach);
            const Index at = static_cast<Index>(frame.camera) - static_cast<Index>(first);
            if (at >= 0 && at < count && v) d.col(at) = by_placement(model, frame) * *v;
            return d;
          }};
}

/// Lag of one camera, estimated together with all other parameters.
MoreParameters lag_of(const JointModel& model, const JointFit& fit, std::size_t camera,
                      int reach = kReach) {
  return fit_more(information_by_view(model, fit, lags_from(model, camera, 1, reach)), 1);
}

/// Derivatives by the lags of all cameras except the first, whose time defines that of the sets.
MoreColumns lags_of(const JointModel& model) {
  return lags_from(model, 1, static_cast<Index>(model.cameras.size()) - 1, kReach);
}

/// The single camera whose lag best explains all estimated lags (generalised least squares).
std::optional<TimeSkew> find_time_skew(const JointModel& model, const MoreParameters& lags,
                                       const Causes& causes) {
  if (lags.estimate.size() == 0 || lags.p > kFalseAlarms) return std::nullopt;
  std::optional<TimeSkew> best;
  double best_explained = 0;
  for (std::size_t c = model.cameras.size() > 2 ? 0 : 1; c < model.cameras.size(); ++c) {
    // If the first camera is late, all others appear early relative to it.
    VectorXd shape = VectorXd::Constant(lags.estimate.size(), c == 0 ? -1 : 0);
    if (c > 0) shape[static_cast<Index>(c) - 1] = 1;
    const VectorXd weighed = solve_symmetric(lags.covariance, shape);
    const double information = shape.dot(weighed);
    const double sets = lags.estimate.dot(weighed) / information;
    const double explained = sets * sets * information;
    const double effect = std::abs(sets) * motion_px(model, c);
    if (explained <= best_explained || effect < causes.alone_px[c] / 2 || std::abs(sets) > 1)
      continue;
    best = TimeSkew{c, sets, 1 / std::sqrt(information), explained, effect};
    best_explained = explained;
  }
  return best;
}

/// The camera whose lag explains most of the residuals.
TimeSkew late_camera(const JointModel& model, const JointFit& fit) {
  TimeSkew late;
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const MoreParameters lag = lag_of(model, fit, c);
    if (!(lag.explained > late.explained)) continue;
    late = {c, lag.estimate[0], std::sqrt(lag.covariance(0, 0)), lag.explained, 0};
  }
  late.effect_px = std::abs(late.sets) * motion_px(model, late.camera);
  return late;
}

/// Change of the estimated lag if motion is interpolated from adjacent sets only: an estimate of
/// the error caused by unknown motion between sets.
double error_of_path(const JointModel& model, const JointFit& fit, const TimeSkew& skew) {
  const MoreParameters coarse = lag_of(model, fit, skew.camera, 1);
  return coarse.estimate.size() > 0 ? coarse.estimate[0] - skew.sets : 0;
}

/// True for one of several z stages, whose heights come from rig.toml and are tested by the check
/// of the stages.
bool is_stage(const JointModel& model, std::size_t placement) {
  return model.placements[placement].known &&
         std::count_if(model.placements.begin(), model.placements.end(),
                       [](const Placement& p) { return p.known; }) > 1;
}

/// Residuals of the cameras with a separate target pose for each view, to first order.
void alone_and_together(const JointModel& model, Causes& causes) {
  const std::size_t cameras = model.cameras.size();
  std::vector<double> alone(cameras, 0), together(cameras, 0), points(cameras, 0);
  for (const JointFrame& frame : model.frames) {
    if (is_stage(model, frame.placement)) continue;
    const MatrixXd d = by_placement(model, frame);
    const VectorXd residuals = residuals_px(model, frame);
    together[frame.camera] += residuals.squaredNorm();
    const VectorXd taken =
        d * solve_symmetric(d.transpose() * d, VectorXd(d.transpose() * residuals));
    alone[frame.camera] += (residuals - taken).squaredNorm();
    points[frame.camera] += static_cast<double>(frame.points.size());
  }
  for (std::size_t c = 0; c < cameras; ++c) {
    causes.alone_px.push_back(std::sqrt(alone[c] / std::max(points[c], 1.0)));
    causes.together_px.push_back(std::sqrt(together[c] / std::max(points[c], 1.0)));
  }
}

/// A change of a camera's pose between the views before `first` and those from it on.
struct Change {
  double f = 0;          ///< variance between over variance within the two groups
  double explained = 0;  ///< share of the weighted sum of squares
  std::size_t camera = 0, first = 0;
  Vector6d step = Vector6d::Zero();  ///< rotation (rad), shift (mm)
};

/// Information of each view on one camera's pose, with all else fixed.
struct PoseVotes {
  std::vector<std::size_t> placements;
  std::vector<Vector6d> scores;
  std::vector<Matrix6d> informations;
};

constexpr std::size_t kLeastViews = 2;  ///< on each side: a single view may just be a bad view

Change strongest_change(const PoseVotes& votes, std::size_t camera,
                        const std::vector<std::size_t>& order) {
  const std::size_t views = order.size();
  Change best;
  best.camera = camera;
  if (views < 2 * kLeastViews + 1) return best;
  Vector6d score = Vector6d::Zero(), score_before = score;
  Matrix6d information = Matrix6d::Zero(), information_before = information;
  double total = 0;
  for (const std::size_t v : order) {
    score += votes.scores[v];
    information += votes.informations[v];
    total += votes.scores[v].dot(votes.informations[v].ldlt().solve(votes.scores[v]));
  }
  for (std::size_t i = 0; i + kLeastViews < views; ++i) {
    score_before += votes.scores[order[i]];
    information_before += votes.informations[order[i]];
    if (i + 1 < kLeastViews) continue;
    const Matrix6d information_after = information - information_before;
    const Vector6d score_after = score - score_before;
    const Vector6d before = information_before.ldlt().solve(score_before);
    const Vector6d after = information_after.ldlt().solve(score_after);
    const double inside = total - score_before.dot(before) - score_after.dot(after);
    const Matrix6d both = information_before.inverse() + information_after.inverse();
    const Vector6d step = before - after;
    const double between = step.dot(both.ldlt().solve(step));
    const double f = between / std::max(inside, 1e-30) * static_cast<double>(views - 2);
    if (f > best.f) best = {f, between, camera, i + 1, step};
  }
  return best;
}

/// `step` is a first-order change of all parameters at which scores are evaluated.
std::vector<PoseVotes> votes_of(const JointModel& model, const JointFit& fit,
                                const ViewsInformation& views, const VectorXd& step) {
  const auto width = static_cast<Index>(moved_camera_parameters(fit).size());
  std::vector<PoseVotes> votes(model.cameras.size());
  for (std::size_t c = 0; c < votes.size(); ++c) {
    const Index at = width * static_cast<Index>(c + 1) - 6;
    for (const ViewInformation& view : views.views) {
      if (is_stage(model, view.placement)) continue;
      const Matrix6d information = view.information.block<6, 6>(at, at);
      // Not seen by this camera, or by no other.
      if (inverse_of_information(information + 1e-30 * Matrix6d::Identity(), 1e-10).size() == 0)
        continue;
      votes[c].placements.push_back(view.placement);
      votes[c].scores.emplace_back(view.score.segment<6>(at) +
                                   view.information.middleRows<6>(at) * step);
      votes[c].informations.push_back(information);
    }
  }
  return votes;
}

/// RMS displacement of a camera's points by a step of rotation and shift, in the image and at the
/// target.
struct Effect {
  double px = 0, m = 0;
};

Effect effect_of(const JointModel& model, std::size_t camera, const Vector6d& step) {
  const Camera& moved = model.cameras[camera].camera;
  const double focal_px = std::get<BrownLens>(moved.model.lens).fx_px;
  Effect sum;
  int points = 0;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    const CamFromTarget pose =
        moved.cam_from_world * model.placements[frame.placement].world_from_target;
    for (const TargetPoint& point : frame.points) {
      const auto image = image_of(model, frame, point);
      if (!image) continue;
      const double squares = (image->by_camera.rightCols<6>() * step).squaredNorm();
      sum.px += squares;
      sum.m += squares * std::pow((pose * point.point_in_target).z() / focal_px, 2);
      ++points;
    }
  }
  if (points == 0) return {};
  return {std::sqrt(sum.px / points), std::sqrt(sum.m / points)};
}

/// Finds a camera that moved between two views. The change must exceed that between other divisions
/// of the views, such as a single bad view would cause; tested by Fisher's F and by permutation.
std::optional<Change> find_change(const JointModel& model, const JointFit& fit,
                                  const ViewsInformation& views, const VectorXd& step,
                                  const Causes& causes, std::size_t& last) {
  constexpr int kOrders = 300;
  const std::vector<PoseVotes> votes = votes_of(model, fit, views, step);
  std::optional<Change> best;
  for (std::size_t c = 0; c < votes.size(); ++c) {
    std::vector<std::size_t> order(votes[c].scores.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const Change change = strongest_change(votes[c], c, order);
    if (!(change.f > 0)) continue;  // too few views
    const auto n = static_cast<double>(order.size());
    const double p = n * static_cast<double>(votes.size()) * f_tail(change.f, 6, 6 * (n - 2));
    if (!(p < kFalseAlarms) || (best && change.explained <= best->explained)) continue;
    best = change;
  }
  if (!best) return std::nullopt;
  const Effect effect = effect_of(model, best->camera, best->step);
  if (effect.px < causes.alone_px[best->camera] || effect.m < harmless_m) return std::nullopt;
  const PoseVotes& own = votes[best->camera];
  std::vector<std::size_t> order(own.scores.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937 random(1);
  for (int i = 0; i < kOrders; ++i) {
    for (std::size_t k = order.size() - 1; k > 0; --k)
      std::swap(order[k], order[random() % (k + 1)]);
    if (strongest_change(own, best->camera, order).f > best->f * (1 + 1e-9)) return std::nullopt;
  }
  last = own.placements[best->first - 1];
  return best;
}

/// Confirms a camera motion after the placement `last` with all other parameters fitted too; the
/// votes hold these fixed and may blame a neighbour for a small motion. nullopt for too few views.
std::optional<Change> moved_camera(const JointModel& model, const JointFit& fit, Change change,
                                   std::size_t last) {
  double most = 0;
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const MoreColumns pose{
        6, [&](const JointFrame& frame) {
          MatrixXd d = MatrixXd::Zero(2 * static_cast<Index>(frame.points.size()), 6);
          if (frame.camera != c || frame.placement <= last) return d;
          for (std::size_t i = 0; i < frame.points.size(); ++i) {
            const auto image = image_of(model, frame, frame.points[i]);
            if (image) d.middleRows<2>(2 * static_cast<Index>(i)) = image->by_camera.rightCols<6>();
          }
          return d;
        }};
    const MoreParameters moved = fit_more(information_by_view(model, fit, pose), pose.count);
    if (!(moved.explained > most)) continue;
    most = change.explained = moved.explained;
    change.camera = c;
    change.step = moved.estimate;
  }
  return most > 0 ? std::optional(change) : std::nullopt;
}

/// Distinguishes a camera that moved from one that is not synchronised: it moved if its change
/// remains after the lags are removed and explains more than any single lag.
void find_moved_or_late(const JointModel& model, const JointFit& fit, Causes& causes) {
  const MoreColumns columns = lags_of(model);
  const ViewsInformation views = information_by_view(model, fit, columns);
  if (views.views.empty()) return;
  const MoreParameters lags = fit_more(views, columns.count);
  auto skew = find_time_skew(model, lags, causes);
  std::size_t last = 0, after_lags = 0;
  auto change = find_change(model, fit, views, VectorXd::Zero(views.stated.rows()), causes, last);
  if (change && skew && !find_change(model, fit, views, lags.step(), causes, after_lags))
    change = std::nullopt;
  if (const auto moved = change ? moved_camera(model, fit, *change, last) : std::nullopt) {
    change = moved;
    const TimeSkew late = late_camera(model, fit);
    if (late.explained > change->explained) {
      change = std::nullopt;
      skew = late;
    }
  }
  if (change) {
    causes.fatal = fmt::format(
        "{} moved after {}: by {:.3f} deg and {:.2f} mm against the other views, {:.2f} px in its "
        "images; take the sets before or after it out of the rig file, or record again with the "
        "camera clamped",
        model.cameras[change->camera].camera.name, model.placements[last].set,
        change->step.head<3>().norm() / units::deg, change->step.tail<3>().norm(),
        effect_of(model, change->camera, change->step).px);
  } else if (skew) {
    causes.warnings.push_back(fmt::format(
        "{} sees the target {:.4f} +- {:.4f} of the time between two sets {} than the other "
        "cameras ({:.2f} px RMS on the moving target): expose all cameras by one trigger, or hold "
        "the target still",
        model.cameras[skew->camera].camera.name, std::abs(skew->sets),
        std::hypot(skew->sd_sets, error_of_path(model, fit, *skew)),
        skew->sets < 0 ? "earlier" : "later", skew->effect_px));
  }
}

/// Information of one camera on the target's pose at one placement, to first order.
struct PoseSums {
  Matrix6d information = Matrix6d::Zero();
  Vector6d score = Vector6d::Zero();
};

/// Sum of squares of the contradictions between cameras, except `left_out`, on the target's pose.
double contradiction(const std::vector<std::vector<PoseSums>>& by_placement, std::size_t left_out) {
  double squares = 0;
  for (const std::vector<PoseSums>& cameras : by_placement) {
    PoseSums all;
    int seen = 0;
    double alone = 0;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      if (c == left_out || !(cameras[c].information.trace() > 0)) continue;
      all.information += cameras[c].information;
      all.score += cameras[c].score;
      alone += cameras[c].score.dot(cameras[c].information.ldlt().solve(cameras[c].score));
      ++seen;
    }
    if (seen > 1) squares += alone - all.score.dot(all.information.ldlt().solve(all.score));
  }
  return squares;
}

/// The camera whose removal eliminates most of the contradiction, more than twice as much as that
/// of any other. nullopt for fewer than three cameras.
std::optional<std::size_t> odd_camera(const JointModel& model) {
  const std::size_t cameras = model.cameras.size();
  if (cameras < 3) return std::nullopt;
  std::vector<std::vector<PoseSums>> sums(model.placements.size(), std::vector<PoseSums>(cameras));
  for (const JointFrame& frame : model.frames) {
    if (is_stage(model, frame.placement)) continue;
    const MatrixXd d = by_placement(model, frame);
    PoseSums& own = sums[frame.placement][frame.camera];
    own.information = d.transpose() * d;
    own.score = d.transpose() * residuals_px(model, frame);
  }
  const double all = contradiction(sums, cameras);
  std::vector<double> left;
  for (std::size_t c = 0; c < cameras; ++c) left.push_back(contradiction(sums, c));
  std::vector<double> sorted = left;
  std::sort(sorted.begin(), sorted.end());
  if (!(sorted[0] < all / 4) || !(sorted[0] < sorted[1] / 2)) return std::nullopt;
  return static_cast<std::size_t>(std::min_element(left.begin(), left.end()) - left.begin());
}

/// Tests for cameras that are consistent alone but not with each other.
void compare_alone_with_together(const JointModel& model, const JointFit& fit, Causes& causes) {
  if (model.cameras.size() < 2 || !causes.fatal.empty() || !causes.warnings.empty()) return;
  double alone = 0, together = 0;
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    alone += std::pow(causes.alone_px[c], 2);
    together += std::pow(causes.together_px[c], 2);
  }
  const double apart_px = std::sqrt((together - alone) / static_cast<double>(model.cameras.size()));
  const double alone_px = std::sqrt(alone / static_cast<double>(model.cameras.size()));
  // With free board points, fits of single cameras absorb errors that repeat from view to view, and
  // their residuals are too small.
  const double most = fit.board == BoardKind::free ? std::sqrt(2.0) : 1;
  if (!(apart_px > most * alone_px)) return;
  const auto odd = odd_camera(model);
  causes.warnings.push_back(fmt::format(
      "{} on where the target is by {:.3f} px RMS, more than the {:.3f} px that each leaves alone: "
      "they are not exposed at the same time, the target or a camera moved during a set, or the "
      "sides of the target differ; use one trigger or hold the target still",
      odd ? model.cameras[*odd].camera.name + " disagrees with the others"
          : std::string("the cameras disagree"),
      apart_px, alone_px));
}

}  // namespace

Causes causes_of(const JointModel& model, const JointFit& fit) {
  Causes causes;
  alone_and_together(model, causes);
  // Tested first, since a lens error at distant points can look like a camera that moved.
  if (!fit.lens_known) causes.fatal = wide_lens(model, fit);
  if (causes.fatal.empty() && model.cameras.size() > 1) {
    find_moved_or_late(model, fit, causes);
    compare_alone_with_together(model, fit, causes);
  }
  return causes;
}

}  // namespace drape::calib
