// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
constexpr double kSettledWeight = 1e-4;

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

/// Returns the largest change in px.
double update_eccentricity(JointModel& model, double diameter_m) {
  double largest = 0;
  for (JointFrame& frame : model.frames) {
    const Camera& camera = model.cameras[frame.camera].camera;
    const CamFromTarget pose =
        camera.cam_from_world * model.placements[frame.placement].world_from_target;
    for (TargetPoint& point : frame.points) {
      const Vector2d shift =
          eccentricity_px(camera.model,
                          {pose * model.bow.bent(point.point_in_target), pose.rotation.col(0),
                           pose.rotation.col(1), diameter_m / 2})
              .value_or(Vector2d::Zero());
      largest = std::max(largest, (shift - point.eccentricity_px).norm());
      point.eccentricity_px = shift;
    }
  }
  return largest;
}

/// Returns the largest change.
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

/// Frames of the placements that are (not) in the group.
JointModel part_of(const JointModel& model, const std::vector<bool>& in_group, bool inside) {
  JointModel part = model;
  part.frames.clear();
  for (const JointFrame& frame : model.frames) {
    if (in_group[frame.placement] == inside) part.frames.push_back(frame);
  }
  return part;
}

void add_errors(HeldOut& sum, const JointModel& model) {
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
      sum.views[frame.placement].squares_px2 += px * px;
      ++sum.views[frame.placement].points;
      sum.object_mm += std::pow(px * in_camera.z() / (focal * mm), 2);
      ++sum.points;
    }
  }
}

}  // namespace

void clear_unused(JointModel& model, LensTerms terms) {
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
  for (int round = 0; round < kRounds; ++round) {
    solution = solve_joint(std::move(solution.model), fit, round > 0);
    iterations += solution.iterations;
    if (!solution.converged) break;
    const double shift = cleaning.dot_diameter_m > 0
                             ? update_eccentricity(solution.model, cleaning.dot_diameter_m)
                             : 0;
    const double change = update_weights(solution.model, cleaning.robust_sigmas);
    if (shift < kSettledPx && change < kSettledWeight) break;
  }
  solution.iterations = iterations;
  return solution;
}

namespace {

// A hundredth of a pixel is never an outlier, however good the other points are.
constexpr double kNeverOutlier_px = 0.01;

/// Beyond `limit` sigmas, and farther off than a hundredth of a pixel or a stage's harmless error:
/// all points of a stage miss alike, and check_stages() judges them together.
bool is_off(const JointModel& model, const JointFrame& frame, const TargetPoint& point,
            double limit) {
  if (distance_sigmas(model, frame, point) <= limit) return false;
  const double px = distance_px(model, frame, point);
  const Placement& placement = model.placements[frame.placement];
  if (px <= kNeverOutlier_px || !placement.known) return px > kNeverOutlier_px;
  const Camera& camera = model.cameras[frame.camera].camera;
  const double away_m =
      (camera.cam_from_world * (placement.world_from_target * point.point_in_target)).z();
  return px * away_m > harmless_stage_m * std::get<BrownLens>(camera.model.lens).fx_px;
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
  HeldOut sum;
  sum.lens = fit.lens;
  JointModel all = solved;
  clear_unused(all, fit.lens);
  std::vector<std::size_t> candidates;
  bool world_kept = false;
  for (std::size_t p = 0; p < all.placements.size(); ++p) {
    if (all.placements[p].known && !world_kept) {
      world_kept = true;
    } else {
      candidates.push_back(p);
    }
  }
  groups = std::min<int>(groups, static_cast<int>(candidates.size()));
  for (int group = 0; group < groups; ++group) {
    std::vector<bool> in_group(all.placements.size(), false);
    for (std::size_t i = 0; i < candidates.size(); ++i)
      in_group[candidates[i]] = static_cast<int>(i) % groups == group;
    JointSolution trained = solve_joint(part_of(all, in_group, false), fit, true);
    JointModel unseen = part_of(all, in_group, true);
    unseen.cameras = trained.model.cameras;
    unseen.bow = trained.model.bow;
    for (Placement& placement : unseen.placements) placement.known = false;
    JointFit place_only = fit;
    place_only.cameras = false;
    place_only.bow = false;
    add_errors(sum, solve_joint(std::move(unseen), place_only).model);
  }
  if (sum.points > 0) {
    sum.rms_px = std::sqrt(sum.rms_px / sum.points);
    sum.object_mm = std::sqrt(sum.object_mm / sum.points);
  }
  return sum;
}

namespace {

constexpr int kDraws = 400;

/// Mean square error per point of each lens (columns) in draws of the placements with replacement.
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

/// Takes the next larger lens where its error is lower by more than the standard error of that.
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

std::vector<double> lens_probabilities(const std::vector<HeldOut>& table) {
  std::vector<double> probabilities(table.size(), 0);
  for (const std::vector<double>& errors : drawn_errors(table)) {
    const auto least = std::min_element(errors.begin(), errors.end());
    probabilities[static_cast<std::size_t>(least - errors.begin())] += 1.0 / kDraws;
  }
  return probabilities;
}

LensTerms choose_lens(const std::vector<HeldOut>& table) {
  std::vector<double> errors;
  errors.reserve(table.size());
  for (const HeldOut& lens : table) errors.push_back(lens.rms_px * lens.rms_px);
  return table[choice(errors, drawn_errors(table))].lens;
}

}  // namespace drape::calib
