// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/fit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <tuple>

#include "core/camera_model.hpp"
#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {

using Eigen::Index, Eigen::Matrix2d, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d,
    Eigen::Vector3d, Eigen::VectorXd;
using units::mm;

namespace {

const BrownLens& lens_of(const JointCamera& camera) {
  return std::get<BrownLens>(camera.camera.model.lens);
}

/// Shear du/dv of the skew: u gains skew * (v - cy) / fy.
double shear(const JointCamera& camera) {
  return camera.skew_px / lens_of(camera).fy_px;
}

/// Initial damping: for a start from homographies, and for one near the solution.
constexpr double kFarDamping = 1e-4, kNearDamping = 1e-12, kMostDamping = 1e8;

void move(JointModel& model, const JointLayout& layout, const VectorXd& step,
          const VectorXd& points_mm) {
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const auto& l = std::get<BrownLens>(model.cameras[c].camera.model.lens);
    const Vector3d t = model.cameras[c].camera.cam_from_world.translation_m / mm;
    double p[camera_parameters] = {
        l.fx_px, l.fy_px, l.cx_px, l.cy_px, l.k1,  l.k2, l.p1, l.p2, l.k3, model.cameras[c].skew_px,
        0,       0,       0,       t.x(),   t.y(), t.z()};
    for (std::size_t i = 0; i < layout.cameras.size(); ++i)
      p[layout.cameras[i]] += step[layout.camera(c) + static_cast<Index>(i)];
    if (!layout.cameras.empty()) model.cameras[c] = moved(model.cameras[c], p);
  }
  for (std::size_t i = 0; i < model.placements.size(); ++i) {
    if (layout.placements[i] < 0) continue;
    Eigen::Matrix<double, placement_parameters, 1> p =
        step.segment<placement_parameters>(layout.placements[i]);
    p.tail<3>() += model.placements[i].world_from_target.translation_m / mm;
    model.placements[i] = moved(model.placements[i], p.data());
  }
  auto board = model.board.parameters();
  for (std::size_t i = 0; i < layout.board.size(); ++i)
    board[layout.board[i]] += step[layout.board_at + static_cast<Index>(i)];
  model.board.edge_rise_mm = board.head<2>();
  model.board.stretch = board.tail<3>();
  for (Index i = 0; i < layout.points; ++i)
    model.board.shift_mm[static_cast<std::size_t>(i)] += points_mm.segment<3>(3 * i);
}

/// Whitened derivatives of a frame's points by camera, board and placement side by side, and by
/// each point's own position; whitened residuals.
struct FrameRows {
  MatrixXd d, by_point;
  VectorXd residuals;
};

FrameRows rows_of(const JointModel& model, const JointLayout& layout, const JointFrame& frame) {
  const auto cameras = static_cast<Index>(layout.cameras.size()),
             board = static_cast<Index>(layout.board.size());
  const auto rows = 2 * static_cast<Index>(frame.points.size());
  FrameRows out{MatrixXd::Zero(rows, cameras + board + placement_parameters),
                MatrixXd::Zero(rows, 3), VectorXd::Zero(rows)};
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const TargetPoint& point = frame.points[i];
    const auto image = image_of(model, frame, point);
    if (!image) continue;
    const Eigen::Matrix2d w = std::sqrt(point.weight) * whitener(point.covariance_px2);
    const auto row = 2 * static_cast<Index>(i);
    const Eigen::Matrix<double, 2, camera_parameters> by_camera = w * image->by_camera;
    for (Index k = 0; k < cameras; ++k)
      out.d.block<2, 1>(row, k) = by_camera.col(layout.cameras[static_cast<std::size_t>(k)]);
    const Eigen::Matrix<double, 2, board_parameters> by_board = w * image->by_board;
    for (Index k = 0; k < board; ++k)
      out.d.block<2, 1>(row, cameras + k) = by_board.col(layout.board[static_cast<std::size_t>(k)]);
    out.d.block<2, placement_parameters>(row, cameras + board) = w * image->by_placement;
    out.by_point.middleRows<2>(row) = w * image->by_point;
    out.residuals.segment<2>(row) = w * (image->px - point.px());
  }
  return out;
}

/// Columns of a frame's derivative and their position among all parameters.
struct Piece {
  Index from, to, size;
};

/// `placement_at` is -1 if the placement is known.
std::vector<Piece> pieces_of(const JointLayout& layout, std::size_t camera, Index placement_at) {
  const auto cameras = static_cast<Index>(layout.cameras.size()),
             board = static_cast<Index>(layout.board.size());
  std::vector<Piece> pieces;
  if (cameras > 0) pieces.push_back({0, layout.camera(camera), cameras});
  if (board > 0) pieces.push_back({cameras, layout.board_at, board});
  if (placement_at >= 0) pieces.push_back({cameras + board, placement_at, placement_parameters});
  return pieces;
}

void add_pieces(MatrixXd& information, const std::vector<Piece>& pieces, const MatrixXd& part) {
  for (const Piece& a : pieces) {
    for (const Piece& b : pieces)
      information.block(a.to, b.to, a.size, b.size) += part.block(a.from, b.from, a.size, b.size);
  }
}

MatrixXd squared(const MatrixXd& rows) {
  MatrixXd product = MatrixXd::Zero(rows.cols(), rows.cols());
  product.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
  return product.selfadjointView<Eigen::Lower>();
}

/// Scales pixels by each point's standard deviation and robust weight.
VectorXd whitened(const JointFrame& frame, const VectorXd& px) {
  VectorXd result(px.size());
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const TargetPoint& point = frame.points[i];
    const auto row = 2 * static_cast<Index>(i);
    result.segment<2>(row) =
        std::sqrt(point.weight) * whitener(point.covariance_px2) * px.segment<2>(row);
  }
  return result;
}

/// Equation of a measured length: residual and derivatives (mm), scaled by its uncertainty.
struct LengthRow {
  double left = 0;
  Vector3d by_to;  ///< by_from is the negative of this
  Eigen::Matrix<double, 1, board_parameters> by_board;
};

LengthRow row_of(const JointModel& model, const MeasuredLength& length) {
  const double weight = std::sqrt(model.noise) / length.sd_mm;
  const Vector3d apart_mm = (model.board.bent(length.to_in_target, length.to) -
                             model.board.bent(length.from_in_target, length.from)) /
                            units::mm;
  LengthRow row;
  row.left = weight * (apart_mm.norm() - length.length_mm);
  row.by_to = weight * apart_mm.normalized();
  row.by_board = row.by_to.transpose() * (model.board.shapes(length.to_in_target) -
                                          model.board.shapes(length.from_in_target));
  return row;
}

/// True if square pixels are a constraint: only a board of free points can adapt to it.
bool has_square_pixels(const JointCamera& camera, const JointFit& fit) {
  return camera.square_sd > 0 && fit.board == BoardKind::free && fit.cameras && !fit.lens_known;
}

/// Deviation of fy/fx from 1, its derivatives by fx and fy, over the uncertainty in the rig.
Vector3d square_row(const JointModel& model, const JointCamera& camera) {
  const auto& lens = std::get<BrownLens>(camera.camera.model.lens);
  const double weight = std::sqrt(model.noise) / camera.square_sd, ratio = lens.fy_px / lens.fx_px;
  return weight * Vector3d(ratio - 1, -ratio / lens.fx_px, 1 / lens.fx_px);
}

Vector3d point_information(const JointModel& model, std::size_t point) {
  return model.noise * model.board.point_sd_mm[point].cwiseAbs2().cwiseInverse();
}

/// Weighted squares of views (`chi2`) plus those of the stated errors; infinite if a point does not
/// project.
double cost_of(const JointModel& model, const JointFit& fit, double& chi2) {
  chi2 = 0;
  for (const JointFrame& frame : model.frames) {
    for (const TargetPoint& point : frame.points) {
      const auto px = pixel_of(model, frame, point);
      if (!px) return std::numeric_limits<double>::infinity();
      chi2 += point.weight * (whitener(point.covariance_px2) * (*px - point.px())).squaredNorm();
    }
  }
  const JointLayout layout(model, fit);
  double cost = chi2;
  if (!layout.board.empty()) {
    const auto board = model.board.parameters();
    cost += model.noise * board.dot(model.board.information * board);
    for (const MeasuredLength& length : model.lengths)
      cost += std::pow(row_of(model, length).left, 2);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(layout.points); ++i)
    cost += model.board.shift_mm[i].cwiseAbs2().dot(point_information(model, i));
  for (const JointCamera& camera : model.cameras)
    if (has_square_pixels(camera, fit)) cost += std::pow(square_row(model, camera)[0], 2);
  return cost;
}

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
  const double left = 2 * static_cast<double>(count_points(solution.model)) -
                      static_cast<double>(layout.lengths_at + 3 * layout.points);
  if (!(left > 0)) return 0;
  const double noise = solution.chi2 / left;
  return std::abs(std::exchange(solution.model.noise, noise) / noise - 1);
}

/// Estimates the print's error, in the plane and out of it, from the fitted shifts of the points in
/// view, unless it is stated; returns the relative change.
double update_print(JointModel& model, const JointFit& fit) {
  Board& board = model.board;
  if (fit.board != BoardKind::free || board.error_stated) return 0;
  NormalEquations normal(model, fit);
  normal.eliminate_points();
  const std::set<int> seen = points_in_view(model);
  if (seen.empty()) return 0;
  Vector3d squares = Vector3d::Zero();
  for (const int i : seen)
    squares += board.shift_mm[static_cast<std::size_t>(i)].cwiseAbs2() +
               model.noise * normal.points.middleCols<3>(3 * static_cast<Index>(i)).diagonal();
  squares /= static_cast<double>(seen.size());
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

/// Distance (m) of a point from its image, at its own distance from the camera.
double off_m(const JointModel& model, const JointFrame& frame, const TargetPoint& point) {
  const Camera& camera = model.cameras[frame.camera].camera;
  const Vector3d at = camera.cam_from_world *
                      (model.placements[frame.placement].world_from_target * point.point_in_target);
  return distance_px(model, frame, point) * at.z() / std::get<BrownLens>(camera.model.lens).fx_px;
}

/// True if a point is beyond `limit` sigmas and its error at the target is not negligible, however
/// small the errors of other points.
bool is_off(const JointModel& model, const JointFrame& frame, const TargetPoint& point,
            double limit) {
  return distance_sigmas(model, frame, point) > limit && off_m(model, frame, point) > harmless_m;
}

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
    if (!std::isfinite(errors[best])) best = lens;  // it does not reach all points
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

Vector2d Board::shape(const Vector3d& point_in_target) const {
  return point_in_target.head<2>().cwiseQuotient(half_m).cwiseAbs2() - mean;
}

Eigen::Matrix<double, 3, board_parameters> Board::shapes(const Vector3d& point) const {
  Eigen::Matrix<double, 3, board_parameters> shapes;
  const Vector2d bow = shape(point);
  const Vector2d at = point.head<2>() / mm;
  shapes << 0, 0, at.x() / 2, at.y() / 2, at.x(),  //
      0, 0, -at.y() / 2, at.x() / 2, at.y(),       //
      bow.x(), bow.y(), 0, 0, 0;
  return shapes;
}

Eigen::Matrix<double, board_parameters, 1> Board::parameters() const {
  return {edge_rise_mm.x(), edge_rise_mm.y(), stretch.x(), stretch.y(), stretch.z()};
}

Vector3d Board::bent(const Vector3d& point, int place) const {
  const Vector3d moved_mm = shapes(point) * parameters();
  const auto at = static_cast<std::size_t>(place);
  return point + mm * (place >= 0 && at < shift_mm.size() ? moved_mm + shift_mm[at] : moved_mm);
}

std::optional<Vector2d> pixel_of(const JointCamera& camera, const Placement& placement,
                                 const Board& board, const Vector3d& point_in_target, int place) {
  const Vector3d in_world = placement.world_from_target * board.bent(point_in_target, place);
  const auto image = project(camera.camera.model, camera.camera.cam_from_world * in_world);
  if (!image) return std::nullopt;
  return Vector2d(image->px.x() + shear(camera) * (image->px.y() - lens_of(camera).cy_px),
                  image->px.y());
}

std::optional<Vector2d> pixel_of(const JointModel& model, const JointFrame& frame,
                                 const TargetPoint& point) {
  return pixel_of(model.cameras[frame.camera], model.placements[frame.placement], model.board,
                  point.point_in_target, point.place);
}

std::optional<TargetImage> image_of(const JointCamera& camera, const Placement& placement,
                                    const Board& board, const Vector3d& point_in_target,
                                    int place) {
  const CamFromWorld& cam_from_world = camera.camera.cam_from_world;
  const WorldFromTarget& world_from_target = placement.world_from_target;
  const Vector3d turned = world_from_target.rotation * board.bent(point_in_target, place);
  const Vector3d rotated = cam_from_world.rotation * (turned + world_from_target.translation_m);
  const Vector3d in_camera = rotated + cam_from_world.translation_m;
  const auto image = project(camera.camera.model, in_camera);
  if (!image) return std::nullopt;
  const BrownLens& lens = lens_of(camera);
  Matrix2d sheared = Matrix2d::Identity();
  sheared(0, 1) = shear(camera);
  TargetImage out;
  out.px = image->px + Vector2d(sheared(0, 1) * (image->px.y() - lens.cy_px), 0);
  const Eigen::Matrix<double, 2, 3> by_point = sheared * image->d_px_d_point;
  out.by_camera.leftCols<9>() = sheared * *d_px_d_lens(camera.camera.model, in_camera);
  // The skew multiplies the distorted y itself, which does not depend on fy or cy.
  out.by_camera(0, 1) = 0;
  out.by_camera(0, 3) = 0;
  out.by_camera.col(9) = Vector2d((image->px.y() - lens.cy_px) / lens.fy_px, 0);
  out.by_camera.middleCols<3>(lens_parameters) = -by_point * cross_matrix(rotated);
  out.by_camera.rightCols<3>() = by_point * mm;
  const Eigen::Matrix<double, 2, 3> by_world = by_point * cam_from_world.rotation;
  out.by_placement.leftCols<3>() = -by_world * cross_matrix(turned);
  out.by_placement.rightCols<3>() = by_world * mm;
  out.by_point = by_world * world_from_target.rotation * mm;
  out.by_board = out.by_point * board.shapes(point_in_target);
  return out;
}

std::optional<TargetImage> image_of(const JointModel& model, const JointFrame& frame,
                                    const TargetPoint& point) {
  return image_of(model.cameras[frame.camera], model.placements[frame.placement], model.board,
                  point.point_in_target, point.place);
}

JointCamera moved(const JointCamera& camera, const double* p) {
  JointCamera out = camera;
  out.camera.model.lens = BrownLens{p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8]};
  out.skew_px = p[9];
  CamFromWorld& pose = out.camera.cam_from_world;
  pose.rotation = rotation_about(Eigen::Map<const Vector3d>(p + 10)) * pose.rotation;
  pose.translation_m = Eigen::Map<const Vector3d>(p + 13) * mm;
  return out;
}

Placement moved(const Placement& placement, const double* p) {
  Placement out = placement;
  WorldFromTarget& pose = out.world_from_target;
  pose.rotation = rotation_about(Eigen::Map<const Vector3d>(p)) * pose.rotation;
  pose.translation_m = Eigen::Map<const Vector3d>(p + 3) * mm;
  return out;
}

std::vector<int> moved_camera_parameters(const JointFit& fit) {
  if (!fit.cameras) return {};
  if (fit.lens_known) return {10, 11, 12, 13, 14, 15};
  std::vector<int> moved = {0, 1, 2, 3, 4};
  if (fit.lens >= LensTerms::k1_k2) moved.push_back(5);
  if (fit.lens >= LensTerms::k1_k2_p1_p2) moved.insert(moved.end(), {6, 7});
  if (fit.lens >= LensTerms::k1_k2_p1_p2_k3) moved.push_back(8);
  if (fit.skew) moved.push_back(9);
  for (int i = lens_parameters; i < camera_parameters; ++i) moved.push_back(i);
  return moved;
}

std::vector<int> moved_board_parameters(const JointModel& model, const JointFit& fit) {
  if (fit.board == BoardKind::drawn) return {};
  std::vector<int> moved = {0, 1};
  if (fit.board == BoardKind::free || !model.lengths.empty()) {
    for (const int print : {2, 3, 4})
      if (model.board.information(print, print) > 0) moved.push_back(print);
  }
  return moved;
}

JointSolution solve_joint(JointModel start, const JointFit& fit, bool near) {
  JointSolution solution;
  solution.model = std::move(start);
  JointModel& model = solution.model;
  if (fit.board == BoardKind::free)
    model.board.shift_mm.resize(model.board.point_sd_mm.size(), Vector3d::Zero());
  double damping = near ? kNearDamping : kFarDamping, growth = 2;
  double cost = cost_of(model, fit, solution.chi2);
  if (!std::isfinite(cost)) return solution;
  while (solution.iterations < fit.max_iterations && damping < kMostDamping) {
    ++solution.iterations;
    NormalEquations normal(model, fit);
    const VectorXd pull = normal.pull.head(normal.layout.lengths_at);
    normal.eliminate_points(damping);
    const VectorXd step = normal.step();
    if (step.size() == 0) {
      damping = std::max(100 * damping, kFarDamping);
      continue;
    }
    const VectorXd points_mm = normal.points_after(step, true);
    std::tuple before(model.cameras, model.placements, model.board);
    move(model, normal.layout, step, points_mm);
    double chi2 = 0;
    const double next = cost_of(model, fit, chi2);
    const double expected = step.head(pull.size()).dot(pull) + points_mm.dot(normal.points_pull);
    if (next < cost) {
      solution.chi2 = chi2;
      // Updates the damping by the ratio of actual to predicted decrease (Nielsen 1999).
      const double gain =
          std::clamp((cost - next) / std::max(std::abs(expected), 1e-300), 0.0, 1.0);
      damping = std::max(damping * std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3)), kNearDamping);
      growth = 2;
      cost = next;
    } else {
      std::tie(model.cameras, model.placements, model.board) = std::move(before);
      damping = std::max(growth * damping, kFarDamping);
      growth *= 2;
    }
    solution.converged = std::abs(expected) <= fit.settled * cost;
    if (solution.converged) break;
  }
  return solution;
}

JointLayout::JointLayout(const JointModel& model, const JointFit& fit)
    : cameras(moved_camera_parameters(fit)), board(moved_board_parameters(model, fit)) {
  board_at = static_cast<Index>(cameras.size() * model.cameras.size());
  size = common = board_at + static_cast<Index>(board.size());
  for (const Placement& placement : model.placements) {
    placements.push_back(placement.known ? -1 : size);
    if (!placement.known) size += placement_parameters;
  }
  lengths_at = size;
  if (!board.empty()) size += static_cast<Index>(model.lengths.size());
  if (fit.board == BoardKind::free) points = static_cast<Index>(model.board.point_sd_mm.size());
}

NormalEquations::NormalEquations(const JointModel& model, const JointFit& fit)
    : layout(model, fit),
      matrix(MatrixXd::Zero(layout.size, layout.size)),
      pull(VectorXd::Zero(layout.size)),
      by_points(MatrixXd::Zero(layout.size, 3 * layout.points)),
      points(MatrixXd::Zero(3, 3 * layout.points)),
      points_pull(VectorXd::Zero(3 * layout.points)) {
  for (const JointFrame& frame : model.frames) {
    const FrameRows rows = rows_of(model, layout, frame);
    const std::vector<Piece> pieces =
        pieces_of(layout, frame.camera, layout.placements[frame.placement]);
    add_pieces(matrix, pieces, squared(rows.d));
    const VectorXd gradient = rows.d.transpose() * rows.residuals;
    for (const Piece& piece : pieces)
      pull.segment(piece.to, piece.size) -= gradient.segment(piece.from, piece.size);
    if (layout.points == 0) continue;
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      if (frame.points[i].place < 0) continue;
      const Index at = 3 * frame.points[i].place, row = 2 * static_cast<Index>(i);
      const Eigen::Matrix<double, 2, 3> own = rows.by_point.middleRows<2>(row);
      for (const Piece& piece : pieces)
        by_points.block(piece.to, at, piece.size, 3).noalias() +=
            rows.d.block(row, piece.from, 2, piece.size).transpose() * own;
      points.middleCols<3>(at) += own.transpose() * own;
      points_pull.segment<3>(at) -= own.transpose() * rows.residuals.segment<2>(row);
    }
  }
  const auto board_size = static_cast<Index>(layout.board.size());
  if (board_size > 0) {
    const Eigen::VectorXd board = model.board.parameters();
    matrix.block(layout.board_at, layout.board_at, board_size, board_size) +=
        model.noise * model.board.information(layout.board, layout.board);
    pull.segment(layout.board_at, board_size) -=
        model.noise * model.board.information(layout.board, Eigen::all) * board;
    for (std::size_t i = 0; i < model.lengths.size(); ++i) {
      const LengthRow row = row_of(model, model.lengths[i]);
      const Index at = layout.lengths_at + static_cast<Index>(i);
      matrix(at, at) = -1;
      pull[at] = -row.left;
      const VectorXd by_board = row.by_board(layout.board);
      matrix.block(at, layout.board_at, 1, board_size) = by_board.transpose();
      matrix.block(layout.board_at, at, board_size, 1) = by_board;
      if (layout.points == 0) continue;
      by_points.block<1, 3>(at, 3 * model.lengths[i].to) = row.by_to.transpose();
      by_points.block<1, 3>(at, 3 * model.lengths[i].from) = -row.by_to.transpose();
    }
  }
  for (Index i = 0; i < layout.points; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vector3d stated = point_information(model, at);
    points.middleCols<3>(3 * i).diagonal() += stated;
    points_pull.segment<3>(3 * i) -= stated.cwiseProduct(model.board.shift_mm[at]);
  }
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    if (!has_square_pixels(model.cameras[c], fit)) continue;
    const Vector3d row = square_row(model, model.cameras[c]);
    matrix.block<2, 2>(layout.camera(c), layout.camera(c)) +=
        row.tail<2>() * row.tail<2>().transpose();
    pull.segment<2>(layout.camera(c)) -= row[0] * row.tail<2>();
  }
}

void NormalEquations::eliminate_points(double damping) {
  for (Index i = 0; i < layout.lengths_at; ++i) matrix(i, i) *= 1 + damping;
  if (layout.points == 0) return;
  MatrixXd solved(layout.size, 3 * layout.points);
  for (Index i = 0; i < layout.points; ++i) {
    Matrix3d own = points.middleCols<3>(3 * i);
    own.diagonal() *= 1 + damping;
    points.middleCols<3>(3 * i) = own.inverse();
    solved.middleCols<3>(3 * i).noalias() =
        by_points.middleCols<3>(3 * i) * points.middleCols<3>(3 * i);
  }
  matrix.triangularView<Eigen::Lower>() -= solved * by_points.transpose();
  matrix.triangularView<Eigen::StrictlyUpper>() = matrix.transpose();
  pull -= solved * points_pull;
}

MatrixXd NormalEquations::points_after(const MatrixXd& steps, bool with_pull) const {
  MatrixXd left = -by_points.transpose() * steps;
  if (with_pull) left.colwise() += points_pull;
  MatrixXd out(left.rows(), left.cols());
  for (Index i = 0; i < layout.points; ++i)
    out.middleRows<3>(3 * i) = points.middleCols<3>(3 * i) * left.middleRows<3>(3 * i);
  return out;
}

VectorXd NormalEquations::step() const {
  const Index all = layout.lengths_at, lengths = layout.size - all;
  MatrixXd left = matrix.topLeftCorner(all, all);
  VectorXd right = pull.head(all);
  const MatrixXd cross = matrix.topRightCorner(all, lengths);
  const auto own = (-matrix.bottomRightCorner(lengths, lengths)).eval().ldlt();
  if (lengths > 0) {
    left += cross * own.solve(cross.transpose());
    right += cross * own.solve(pull.tail(lengths));
  }
  // Placements are coupled through the free points only.
  for (Index i = 0; i < all; ++i)
    if (!(left(i, i) > 0)) left(i, i) = 1;  // not in any view
  const bool apart = layout.points == 0 && lengths == 0;
  const Index size = apart ? layout.common : all;
  const VectorXd unit = left.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  left = (unit.asDiagonal() * left * unit.asDiagonal()).eval();
  right = unit.cwiseProduct(right);
  std::vector<Eigen::LDLT<Eigen::Matrix<double, placement_parameters, placement_parameters>>> poses;
  for (Index at = size; at < all; at += placement_parameters) {
    poses.emplace_back(left.block<placement_parameters, placement_parameters>(at, at));
    const MatrixXd by = left.block(0, at, size, placement_parameters);
    left.topLeftCorner(size, size) -= by * poses.back().solve(by.transpose());
    right.head(size) -= by * poses.back().solve(right.segment<placement_parameters>(at));
  }
  VectorXd step = VectorXd::Zero(layout.size);
  if (size > 0) {
    const Eigen::LLT<MatrixXd> factor(left.topLeftCorner(size, size));
    if (factor.info() != Eigen::Success) return {};
    step.head(size) = factor.solve(right.head(size));
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Index at = size + placement_parameters * static_cast<Index>(i);
    const VectorXd rest = right.segment<placement_parameters>(at) -
                          left.block(at, 0, placement_parameters, size) * step.head(size);
    step.segment<placement_parameters>(at) = poses[i].solve(rest);
  }
  step.head(all) = unit.cwiseProduct(step.head(all));
  if (lengths > 0)
    step.tail(lengths) = own.solve(cross.transpose() * step.head(all) - pull.tail(lengths));
  return step.allFinite() ? step : VectorXd();
}

VectorXd residuals_px(const JointModel& model, const JointFrame& frame) {
  VectorXd residuals = VectorXd::Zero(2 * static_cast<Index>(frame.points.size()));
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const TargetPoint& point = frame.points[i];
    const auto px = pixel_of(model, frame, point);
    if (px) residuals.segment<2>(2 * static_cast<Index>(i)) = *px - point.px();
  }
  return residuals;
}

double free_parameters(const JointModel& model, const JointFit& fit) {
  const JointLayout layout(model, fit);
  auto count = static_cast<double>(layout.lengths_at);
  if (layout.points == 0) return count;
  NormalEquations normal(model, fit);
  normal.eliminate_points();
  for (Index i = 0; i < layout.points; ++i)
    count += 3 - normal.points.middleCols<3>(3 * i).diagonal().dot(
                     point_information(model, static_cast<std::size_t>(i)));
  return count;
}

MatrixXd information_of(const JointModel& model, const JointFit& fit) {
  NormalEquations normal(model, fit);
  normal.eliminate_points();
  const Index size = normal.layout.lengths_at, lengths = normal.layout.size - size;
  MatrixXd information = normal.matrix.topLeftCorner(size, size);
  if (lengths == 0) return information;
  const MatrixXd cross = normal.matrix.topRightCorner(size, lengths);
  const MatrixXd own = -normal.matrix.bottomRightCorner(lengths, lengths);
  return information + cross * own.ldlt().solve(cross.transpose());
}

MatrixXd ViewsInformation::sum() const {
  MatrixXd all = stated;
  for (const ViewInformation& view : views) all += view.with_world;
  return all;
}

ViewsInformation information_by_view(const JointModel& model, const JointFit& fit,
                                     const MoreColumns& more) {
  const JointLayout layout(model, fit);
  const Index common = layout.common + more.count, size = common + placement_parameters;
  ViewsInformation out{{}, MatrixXd::Zero(common, common)};
  MatrixXd follow;  // change of the free points per unit of each common parameter
  const auto board_size = static_cast<Index>(layout.board.size());
  if (board_size > 0)
    out.stated.block(layout.board_at, layout.board_at, board_size, board_size) =
        model.noise * model.board.information(layout.board, layout.board);
  if (layout.points > 0) {
    NormalEquations normal(model, fit);
    normal.eliminate_points();
    const Index rest = layout.size - layout.common;
    MatrixXd steps = MatrixXd::Identity(layout.size, layout.common);
    steps.bottomRows(rest) = -normal.matrix.bottomRightCorner(rest, rest)
                                  .ldlt()
                                  .solve(normal.matrix.bottomLeftCorner(rest, layout.common));
    follow = normal.points_after(steps, false);
    for (Index i = 0; i < layout.points; ++i)
      out.stated.topLeftCorner(layout.common, layout.common) +=
          follow.middleRows<3>(3 * i).transpose() *
          point_information(model, static_cast<std::size_t>(i)).asDiagonal() *
          follow.middleRows<3>(3 * i);
  }
  if (board_size > 0) {
    for (const MeasuredLength& length : model.lengths) {
      const LengthRow row = row_of(model, length);
      Eigen::RowVectorXd by = Eigen::RowVectorXd::Zero(common);
      by.segment(layout.board_at, board_size) = row.by_board(layout.board);
      if (follow.size() > 0)
        by.head(layout.common) += row.by_to.transpose() * (follow.middleRows<3>(3 * length.to) -
                                                           follow.middleRows<3>(3 * length.from));
      out.stated += by.transpose() * by;
    }
  }
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    if (!has_square_pixels(model.cameras[c], fit)) continue;
    const Eigen::Vector2d row = square_row(model, model.cameras[c]).tail<2>();
    out.stated.block<2, 2>(layout.camera(c), layout.camera(c)) += row * row.transpose();
  }
  const auto known = std::count_if(model.placements.begin(), model.placements.end(),
                                   [](const Placement& p) { return p.known; });
  std::vector<MatrixXd> informations(model.placements.size(), MatrixXd::Zero(size, size));
  std::vector<VectorXd> scores(model.placements.size(), VectorXd::Zero(size));
  for (const JointFrame& frame : model.frames) {
    const std::size_t p = frame.placement;
    FrameRows rows = rows_of(model, layout, frame);
    std::vector<Piece> pieces = pieces_of(layout, frame.camera, common);
    MatrixXd d = std::move(rows.d);
    if (follow.size() > 0) {
      MatrixXd all = MatrixXd::Zero(d.rows(), layout.common + placement_parameters);
      for (const Piece& piece : pieces)
        all.middleCols(piece.to == common ? layout.common : piece.to, piece.size) =
            d.middleCols(piece.from, piece.size);
      for (std::size_t i = 0; i < frame.points.size(); ++i) {
        if (frame.points[i].place < 0) continue;
        const auto row = 2 * static_cast<Index>(i);
        all.block(row, 0, 2, layout.common).noalias() +=
            rows.by_point.middleRows<2>(row) * follow.middleRows<3>(3 * frame.points[i].place);
      }
      pieces = {{0, 0, layout.common}, {layout.common, common, placement_parameters}};
      d = std::move(all);
    }
    if (more.count > 0) {
      pieces.push_back({d.cols(), layout.common, more.count});
      d.conservativeResize(Eigen::NoChange, d.cols() + more.count);
      const MatrixXd by_more = more.of(frame);
      for (Index k = 0; k < more.count; ++k)
        d.col(d.cols() - more.count + k) = whitened(frame, by_more.col(k));
    }
    add_pieces(informations[p], pieces, squared(d));
    const VectorXd pull = d.transpose() * rows.residuals;
    for (const Piece& piece : pieces)
      scores[p].segment(piece.to, piece.size) += pull.segment(piece.from, piece.size);
  }
  for (std::size_t p = 0; p < model.placements.size(); ++p) {
    if (informations[p].isZero(0)) continue;
    const MatrixXd all = informations[p].topLeftCorner(common, common);
    ViewInformation view{p, all, scores[p].head(common), all};
    if (!model.placements[p].known || known == 1) {
      const MatrixXd cross = informations[p].topRightCorner(common, placement_parameters);
      const auto pose =
          informations[p].bottomRightCorner<placement_parameters, placement_parameters>().ldlt();
      view.information -= cross * pose.solve(cross.transpose());
      view.score -= cross * pose.solve(scores[p].tail<placement_parameters>());
      if (!model.placements[p].known) view.with_world = view.information;
    }
    out.views.push_back(std::move(view));
  }
  return out;
}

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

std::string name_of_view(const JointModel& model, const JointFrame& frame) {
  return fmt::format("set {}, {}", model.placements[frame.placement].set,
                     model.cameras[frame.camera].camera.name);
}

std::size_t count_points(const JointModel& model) {
  std::size_t points = 0;
  for (const JointFrame& frame : model.frames) points += frame.points.size();
  return points;
}

std::set<int> points_in_view(const JointModel& model) {
  std::set<int> seen;
  for (const JointFrame& frame : model.frames)
    for (const TargetPoint& point : frame.points)
      if (point.place >= 0) seen.insert(point.place);
  return seen;
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
          "{}, dot ({}, {}): {:.3f} px off, {:.1f} times the limit of {:g} robust sigmas",
          name_of_view(model, frame), point.dot.row, point.dot.col,
          distance_px(model, frame, point), distance_sigmas(model, frame, point) / limit,
          cleaning.outlier_sigmas));
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
