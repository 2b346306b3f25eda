// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/joint/solve.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Whitened derivatives of a frame's points by camera, board and placement side by side, and by
/// each point's own position; whitened residuals.
struct FrameRows {
  MatrixXd d, by_point;
  VectorXd residuals;
  bool projects = true;
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
    if (!image) {
      out.projects = false;
      continue;
    }
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

}  // namespace

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
    if (!(left(i, i) > 0)) left(i, i) = 1;  // not seen in any view
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

}  // namespace drape::calib
