// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

#include "core/dot_image.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr int kRounds = 8;
constexpr double kSettledPx = 1e-6;
constexpr double kSettledWeight = 1e-4, kSettledNoise = 0.01, kSettledPrint = 0.05;

/// Point distance in units of the point's standard deviation.
double distance_sigmas(const JointModel& model, const JointFrame& frame, const TargetPoint& point) {
  const auto px = pixel_of(model, frame, point);
  if (!px) return std::numeric_limits<double>::infinity();
  return (whitener(point.covariance_px2) * (*px - point.px())).norm();
}

/// Robust standard deviation of distance_sigmas per coordinate.
double robust_scale(const JointModel& model) {
  std::vector<double> distances;
  for (const JointFrame& frame : model.frames) {
    for (const TargetPoint& point : frame.points)
      distances.push_back(distance_sigmas(model, frame, point));
  }
  if (distances.empty()) return 0;
  return median(std::move(distances)) / kRayleighMedian;
}

/// Updates each dot's eccentricity; returns the largest change in px.
double update_eccentricity(JointModel& model, double diameter_m) {
  double largest = 0;
  for (JointFrame& frame : model.frames) {
    const Camera& camera = model.cameras[frame.camera].camera;
    const CamFromTarget pose =
        camera.cam_from_world * model.placements[frame.placement].world_from_target;
    for (TargetPoint& point : frame.points) {
      const Vector2d shift =
          eccentricity_px(camera.model,
                          {pose * model.board.bent(point.point_in_target, point.place),
                           pose.rotation.col(0), pose.rotation.col(1), diameter_m / 2})
              .value_or(Vector2d::Zero());
      largest = std::max(largest, (shift - point.eccentricity_px).norm());
      point.eccentricity_px = shift;
    }
  }
  return largest;
}

/// Updates the robust weights; returns the largest change.
double update_weights(JointModel& model, double robust_sigmas) {
  const double limit = robust_sigmas * robust_scale(model);
  if (!(limit > 0)) return 0;
  double largest = 0;
  for (JointFrame& frame : model.frames) {
    for (TargetPoint& point : frame.points) {
      const double distance = distance_sigmas(model, frame, point);
      const double weight = distance <= limit ? 1 : limit / distance;
      largest = std::max(largest, std::abs(weight - point.weight));
      point.weight = weight;
    }
  }
  return largest;
}

/// Sets the points' noise, against which the print's error is weighted, to that of the residuals;
/// returns the relative change.
double update_noise(JointSolution& solution, const JointFit& fit) {
  const JointLayout layout(solution.model, fit);
  double values = 0;
  for (const JointFrame& frame : solution.model.frames)
    values += 2 * static_cast<double>(frame.points.size());
  const double left = values - static_cast<double>(layout.lengths_at + 3 * layout.points);
  if (!(left > 0)) return 0;
  const double noise = solution.chi2 / left;
  return std::abs(std::exchange(solution.model.noise, noise) / noise - 1);
}

/// Estimates the print's error, in the plane and out of it, from the fitted shifts, unless it is
/// stated; returns the relative change.
double update_print(JointModel& model, const JointFit& fit) {
  Board& board = model.board;
  if (fit.board != BoardKind::free || board.error_stated) return 0;
  NormalEquations normal(model, fit);
  normal.eliminate_points();
  Vector3d squares = Vector3d::Zero();
  for (std::size_t i = 0; i < board.shift_mm.size(); ++i)
    squares +=
        board.shift_mm[i].cwiseAbs2() +
        model.noise * normal.points.middleCols<3>(3 * static_cast<Eigen::Index>(i)).diagonal();
  squares /= static_cast<double>(board.shift_mm.size());
  squares.head<2>().setConstant(squares.head<2>().mean());
  const Vector3d before = board.point_sd_mm.front();
  board.point_sd_mm.assign(board.point_sd_mm.size(), squares.cwiseSqrt());
  return (before.cwiseQuotient(board.point_sd_mm.front()).array() - 1).abs().maxCoeff();
}

/// Frames whose placements are inside (or outside) the group.
JointModel part_of(const JointModel& model, const std::vector<bool>& in_group, bool inside) {
  JointModel part = model;
  part.frames.clear();
  for (const JointFrame& frame : model.frames) {
    if (in_group[frame.placement] == inside) part.frames.push_back(frame);
  }
  return part;
}

/// Order of placements that depends only on their content, not on names or numbering of views.
std::vector<std::size_t> order_of(const JointModel& model) {
  std::vector<double> keys(model.placements.size(), 0);
  for (const JointFrame& frame : model.frames)
    for (const TargetPoint& point : frame.points) keys[frame.placement] += point.measured_px.sum();
  std::vector<std::size_t> order(keys.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
  return order;
}

void add_errors(HeldOut& sum, const JointModel& model, const std::vector<std::size_t>& rank) {
  sum.views.resize(model.placements.size());
  for (const JointFrame& frame : model.frames) {
    const Camera& camera = model.cameras[frame.camera].camera;
    const double focal = std::get<BrownLens>(camera.model.lens).fx_px;
    for (const TargetPoint& point : frame.points) {
      const double px = distance_px(model, frame, point);
      const Vector3d in_camera =
          camera.cam_from_world *
          (model.placements[frame.placement].world_from_target * point.point_in_target);
      sum.rms_px += px * px;
      sum.views[rank[frame.placement]].squares_px2 += px * px;
      ++sum.views[rank[frame.placement]].points;
      sum.object_mm += std::pow(px * in_camera.z() / (focal * mm), 2);
      ++sum.points;
    }
  }
}

}  // namespace

void clear_unused(JointModel& model, const JointFit& fit) {
  const LensTerms terms = fit.lens;
  if (fit.board != BoardKind::free) model.board.shift_mm.clear();
  const std::vector<int> moves = moved_board_parameters(model, fit);
  if (std::find(moves.begin(), moves.end(), 2) == moves.end()) model.board.stretch.setZero();
  if (fit.board == BoardKind::drawn) model.board.edge_rise_mm.setZero();
  if (fit.lens_known) return;
  for (JointCamera& camera : model.cameras) {
    auto& lens = std::get<BrownLens>(camera.camera.model.lens);
    if (terms < LensTerms::k1_k2_p1_p2_k3) lens.k3 = 0;
    if (terms < LensTerms::k1_k2_p1_p2) lens.p1 = lens.p2 = 0;
    if (terms < LensTerms::k1_k2) lens.k2 = 0;
  }
}

double distance_px(const JointModel& model, const JointFrame& frame, const TargetPoint& point) {
  const auto px = pixel_of(model, frame, point);
  return px ? (*px - point.px()).norm() : std::numeric_limits<double>::infinity();
}

JointSolution fit_joint(const JointModel& start, const JointFit& fit,
                        const JointCleaning& cleaning) {
  JointSolution solution;
  solution.model = start;
  int iterations = 0;
  const bool stated = fit.board == BoardKind::free || !start.lengths.empty();
  for (int round = 0; round < kRounds; ++round) {
    solution = solve_joint(std::move(solution.model), fit, round > 0);
    iterations += solution.iterations;
    if (!solution.converged) break;
    const double shift = cleaning.dot_diameter_m > 0
                             ? update_eccentricity(solution.model, cleaning.dot_diameter_m)
                             : 0;
    const double change = update_weights(solution.model, cleaning.robust_sigmas);
    const double noisier = stated ? update_noise(solution, fit) : 0;
    const double print = update_print(solution.model, fit);
    if (shift < kSettledPx && change < kSettledWeight && noisier < kSettledNoise &&
        print < kSettledPrint)
      break;
  }
  solution.iterations = iterations;
  return solution;
}

namespace {

/// Distance (m) of a point from its image, at its own distance from the camera.
double off_m(const JointModel& model, const JointFrame& frame, const TargetPoint& point) {
  const Camera& camera = model.cameras[frame.camera].camera;
  const Vector3d at = camera.cam_from_world *
                      (model.placements[frame.placement].world_from_target * point.point_in_target);
  return distance_px(model, frame, point) * at.z() / std::get<BrownLens>(camera.model.lens).fx_px;
}

/// True if a point is beyond `limit` sigmas and its error at the target is not negligible, however
/// good the other points are.
bool is_off(const JointModel& model, const JointFrame& frame, const TargetPoint& point,
            double limit) {
  return distance_sigmas(model, frame, point) > limit && off_m(model, frame, point) > harmless_m;
}

}  // namespace

std::vector<std::size_t> frames_off(const JointModel& model, const JointCleaning& cleaning) {
  const double limit = cleaning.outlier_sigmas * robust_scale(model);
  std::vector<std::size_t> off;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    const JointFrame& frame = model.frames[f];
    const auto far =
        std::count_if(frame.points.begin(), frame.points.end(),
                      [&](const TargetPoint& point) { return is_off(model, frame, point, limit); });
    if (2 * static_cast<std::size_t>(far) > frame.points.size()) off.push_back(f);
  }
  return off;
}

std::size_t points_farther(const JointModel& model, double limit_m) {
  std::size_t points = 0;
  for (const JointFrame& frame : model.frames)
    for (const TargetPoint& point : frame.points) points += off_m(model, frame, point) > limit_m;
  return points;
}

std::vector<std::string> reject_outliers(JointModel& model, const JointCleaning& cleaning) {
  const double limit = cleaning.outlier_sigmas * robust_scale(model);
  std::vector<std::string> rejected;
  for (JointFrame& frame : model.frames) {
    std::vector<TargetPoint> kept;
    for (const TargetPoint& point : frame.points) {
      if (!is_off(model, frame, point, limit)) {
        kept.push_back(point);
        continue;
      }
      rejected.push_back(fmt::format(
          "set {}, {}, dot ({}, {}): {:.3f} px off, {:.1f} times the limit of {:g} robust sigmas",
          model.placements[frame.placement].set, model.cameras[frame.camera].camera.name,
          point.dot.row, point.dot.col, distance_px(model, frame, point),
          distance_sigmas(model, frame, point) / limit, cleaning.outlier_sigmas));
    }
    frame.points = std::move(kept);
  }
  return rejected;
}

HeldOut held_out_error(const JointModel& solved, JointFit fit, int groups) {
  constexpr double kEnough = 1e-7;  // a thousandth of the variation between resamples
  HeldOut sum;
  sum.lens = fit.lens;
  fit.settled = kEnough;
  sum.board = fit.board;
  JointModel all = solved;
  clear_unused(all, fit);
  const std::vector<std::size_t> order = order_of(all);
  if (all.world_by_first_view)
    for (std::size_t p = 0; p < order.size(); ++p) all.placements[p].known = p == order.front();
  std::vector<std::size_t> candidates, rank(order.size());
  bool world_kept = false;
  for (std::size_t i = 0; i < order.size(); ++i) {
    rank[order[i]] = i;
    const bool holds_world = all.placements[order[i]].known && !world_kept;
    world_kept = world_kept || holds_world;
    if (!holds_world) candidates.push_back(order[i]);
  }
  groups = std::min(groups, static_cast<int>(candidates.size()));
  for (int group = 0; group < groups; ++group) {
    std::vector<bool> in_group(all.placements.size(), false);
    for (std::size_t i = 0; i < candidates.size(); ++i)
      in_group[candidates[i]] = static_cast<int>(i) % groups == group;
    JointModel seen = part_of(all, in_group, false);
    JointSolution trained = solve_joint(std::move(seen), fit, true);
    JointModel unseen = part_of(all, in_group, true);
    unseen.cameras = trained.model.cameras;
    unseen.board = trained.model.board;
    for (Placement& placement : unseen.placements) placement.known = false;
    JointFit place_only = fit;
    place_only.cameras = false;
    place_only.board = BoardKind::drawn;
    add_errors(sum, solve_joint(std::move(unseen), place_only).model, rank);
  }
  if (sum.points > 0) {
    sum.rms_px = std::sqrt(sum.rms_px / sum.points);
    sum.object_mm = std::sqrt(sum.object_mm / sum.points);
  }
  return sum;
}

namespace {

constexpr int kDraws = 400;

/// Mean square error per point of each lens (columns) in resamples of the placements (rows).
std::vector<std::vector<double>> drawn_errors(const std::vector<HeldOut>& table) {
  std::mt19937 random(1);
  const std::size_t views = table.front().views.size();
  std::vector<std::vector<double>> draws;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<double> errors(table.size(), 0);
    std::vector<int> points(table.size(), 0);
    for (std::size_t i = 0; i < views; ++i) {
      const std::size_t view = random() % views;
      for (std::size_t lens = 0; lens < table.size(); ++lens) {
        errors[lens] += table[lens].views[view].squares_px2;
        points[lens] += table[lens].views[view].points;
      }
    }
    for (std::size_t lens = 0; lens < table.size(); ++lens)
      errors[lens] /= std::max(points[lens], 1);
    draws.push_back(std::move(errors));
  }
  return draws;
}

/// Selects the next larger lens if it reduces the error by more than the standard error.
std::size_t choice(const std::vector<double>& errors,
                   const std::vector<std::vector<double>>& draws) {
  std::size_t best = 0;
  for (std::size_t lens = 1; lens < errors.size(); ++lens) {
    double sum = 0, squares = 0;
    for (const std::vector<double>& drawn : draws) {
      const double gain = drawn[best] - drawn[lens];
      sum += gain;
      squares += gain * gain;
    }
    const double variance = (squares - sum * sum / kDraws) / (kDraws - 1);
    if (errors[best] - errors[lens] > std::sqrt(std::max(variance, 0.0))) best = lens;
  }
  return best;
}

}  // namespace

std::vector<double> probabilities(const std::vector<HeldOut>& table) {
  std::vector<double> shares(table.size(), 0);
  for (const std::vector<double>& errors : drawn_errors(table)) {
    const auto least = std::min_element(errors.begin(), errors.end());
    shares[static_cast<std::size_t>(least - errors.begin())] += 1.0 / kDraws;
  }
  return shares;
}

std::size_t choose(const std::vector<HeldOut>& table) {
  std::vector<double> errors;
  errors.reserve(table.size());
  for (const HeldOut& lens : table) errors.push_back(lens.rms_px * lens.rms_px);
  return choice(errors, drawn_errors(table));
}

}  // namespace drape::calib
