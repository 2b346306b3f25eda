// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/late_camera.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include "core/geometry/dense.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr int kReach = 2;  ///< sets to each side that say how the target moves

/// Motion of the target from set to set at a placement (rad and mm per set): slope of the
/// polynomial through it and up to `reach` neighbours on each side. A placement known from rig.toml
/// has none and is no neighbour: the target was put there.
std::optional<Vector6d> velocity(const JointModel& model, std::size_t placement,
                                 int reach = kReach) {
  const Placement& here = model.placements[placement];
  if (here.known) return std::nullopt;
  std::vector<std::pair<double, Vector6d>> neighbours;  // sets from here, change of the pose
  for (int sets = -reach; sets <= reach; ++sets) {
    if (sets == 0) continue;
    const std::size_t at = placement + static_cast<std::size_t>(sets);  // wraps to beyond the end
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

/// RMS displacement (px) of a camera's points on the moving target from set to set.
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

}  // namespace

MatrixXd by_placement(const JointModel& model, const JointFrame& frame) {
  MatrixXd d = MatrixXd::Zero(2 * static_cast<Index>(frame.points.size()), placement_parameters);
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const auto image = image_of(model.cameras[frame.camera], model.placements[frame.placement],
                                model.bow, frame.points[i].point_in_target);
    if (image) d.middleRows<2>(2 * static_cast<Index>(i)) = image->by_placement;
  }
  return d;
}

namespace {

/// Derivative by the lags of `count` cameras from `first` on.
MoreColumns lags_from(const JointModel& model, std::size_t first, Index count, int reach) {
  return {count, [&model, first, count, reach](const JointFrame& frame) {
            MatrixXd d = MatrixXd::Zero(2 * static_cast<Index>(frame.points.size()), count);
            const auto v = velocity(model, frame.placement, reach);
            const Index at = static_cast<Index>(frame.camera) - static_cast<Index>(first);
            if (at >= 0 && at < count && v) d.col(at) = by_placement(model, frame) * *v;
            return d;
          }};
}

/// The lag of one camera alone, all else fitted along.
MoreParameters lag_of(const JointModel& model, const JointFit& fit, std::size_t camera,
                      int reach = kReach) {
  return fit_more(information_by_view(model, fit, lags_from(model, camera, 1, reach)), 1);
}

}  // namespace

MoreColumns lags_of(const JointModel& model) {
  return lags_from(model, 1, static_cast<Index>(model.cameras.size()) - 1, kReach);
}

std::optional<TimeSkew> find_time_skew(const JointModel& model, const MoreParameters& lags,
                                       const Causes& causes) {
  if (lags.estimate.size() == 0 || lags.p > kFalseAlarms) return std::nullopt;
  std::optional<TimeSkew> best;
  double best_explained = 0;
  for (std::size_t c = model.cameras.size() > 2 ? 0 : 1; c < model.cameras.size(); ++c) {
    // Where the first camera is late, all others are early against it.
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

double error_of_path(const JointModel& model, const JointFit& fit, const TimeSkew& skew) {
  const MoreParameters coarse = lag_of(model, fit, skew.camera, 1);
  return coarse.estimate.size() > 0 ? coarse.estimate[0] - skew.sets : 0;
}

}  // namespace drape::calib
