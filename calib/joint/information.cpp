// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>

#include "calib/joint/solve.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Where the parameters of cameras, bow and placements begin.
struct Layout {
  std::vector<int> moved;  ///< parameters of one camera
  Index bow = 0;           ///< offset
  Index bow_size = 0;
  std::vector<Index> placements;  ///< offsets, -1 when known
  Index size = 0;

  Layout(const JointModel& model, const JointFit& fit) : moved(moved_camera_parameters(fit)) {
    bow = static_cast<Index>(moved.size() * model.cameras.size());
    bow_size = fit.bow ? bow_parameters : 0;
    size = bow + bow_size;
    for (const Placement& placement : model.placements) {
      placements.push_back(placement.known ? -1 : size);
      if (!placement.known) size += placement_parameters;
    }
  }

  [[nodiscard]] Index camera(std::size_t i) const { return static_cast<Index>(moved.size() * i); }
};

/// Whitened derivative of a frame's points by its camera, the bow and its placement, side by side.
MatrixXd derivative(const JointModel& model, const Layout& layout, const JointFrame& frame,
                    const Placement& placement) {
  const auto cameras = static_cast<Index>(layout.moved.size());
  MatrixXd d = MatrixXd::Zero(2 * static_cast<Index>(frame.points.size()),
                              cameras + layout.bow_size + placement_parameters);
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const TargetPoint& point = frame.points[i];
    const auto image =
        image_of(model.cameras[frame.camera], placement, model.bow, point.point_in_target);
    if (!image) continue;
    const Eigen::Matrix2d w = std::sqrt(point.weight) * whitener(point.covariance_px2);
    auto rows = d.middleRows<2>(2 * static_cast<Index>(i));
    rows.leftCols(cameras) = w * image->by_camera(Eigen::all, layout.moved);
    if (layout.bow_size > 0) rows.middleCols(cameras, layout.bow_size) = w * image->by_bow;
    rows.rightCols<placement_parameters>() = w * image->by_placement;
  }
  return d;
}

/// Rows (columns) of a frame's derivative and where they stand among all parameters.
struct Piece {
  Index from, to, size;
};

/// `placement_at` is -1 when the placement is known.
std::vector<Piece> pieces_of(const Layout& layout, std::size_t camera, Index placement_at) {
  const auto cameras = static_cast<Index>(layout.moved.size());
  std::vector<Piece> pieces;
  if (cameras > 0) pieces.push_back({0, layout.camera(camera), cameras});
  if (layout.bow_size > 0) pieces.push_back({cameras, layout.bow, layout.bow_size});
  if (placement_at >= 0)
    pieces.push_back({cameras + layout.bow_size, placement_at, placement_parameters});
  return pieces;
}

void add_pieces(MatrixXd& information, const std::vector<Piece>& pieces,
                const MatrixXd& derivative) {
  const MatrixXd part = derivative.transpose() * derivative;
  for (const Piece& a : pieces) {
    for (const Piece& b : pieces)
      information.block(a.to, b.to, a.size, b.size) += part.block(a.from, b.from, a.size, b.size);
  }
}

/// In units of each point's standard deviation, robust weight included.
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

}  // namespace

VectorXd residuals_px(const JointModel& model, const JointFrame& frame) {
  VectorXd residuals = VectorXd::Zero(2 * static_cast<Index>(frame.points.size()));
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const TargetPoint& point = frame.points[i];
    const auto px = pixel_of(model, frame, point);
    if (px) residuals.segment<2>(2 * static_cast<Index>(i)) = *px - point.px();
  }
  return residuals;
}

int free_parameters(const JointModel& model, const JointFit& fit) {
  return static_cast<int>(Layout(model, fit).size);
}

MatrixXd information_of(const JointModel& model, const JointFit& fit) {
  const Layout layout(model, fit);
  MatrixXd information = MatrixXd::Zero(layout.size, layout.size);
  for (const JointFrame& frame : model.frames) {
    const Placement& placement = model.placements[frame.placement];
    add_pieces(information, pieces_of(layout, frame.camera, layout.placements[frame.placement]),
               derivative(model, layout, frame, placement));
  }
  return information;
}

std::vector<ViewInformation> information_by_view(const JointModel& model, const JointFit& fit,
                                                 const MoreColumns& more) {
  const Layout layout(model, fit);
  const Index own = layout.bow + layout.bow_size, common = own + more.count,
              size = common + placement_parameters;
  const auto known = std::count_if(model.placements.begin(), model.placements.end(),
                                   [](const Placement& p) { return p.known; });
  std::vector<MatrixXd> informations(model.placements.size(), MatrixXd::Zero(size, size));
  std::vector<VectorXd> scores(model.placements.size(), VectorXd::Zero(size));
  for (const JointFrame& frame : model.frames) {
    const std::size_t p = frame.placement;
    MatrixXd d = derivative(model, layout, frame, model.placements[p]);
    std::vector<Piece> pieces = pieces_of(layout, frame.camera, common);
    if (more.count > 0) {
      pieces.push_back({d.cols(), own, more.count});
      d.conservativeResize(Eigen::NoChange, d.cols() + more.count);
      const MatrixXd by_more = more.of(frame);
      for (Index k = 0; k < more.count; ++k)
        d.col(d.cols() - more.count + k) = whitened(frame, by_more.col(k));
    }
    add_pieces(informations[p], pieces, d);
    const VectorXd pull = d.transpose() * whitened(frame, residuals_px(model, frame));
    for (const Piece& piece : pieces)
      scores[p].segment(piece.to, piece.size) += pull.segment(piece.from, piece.size);
  }
  std::vector<ViewInformation> views;
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
    views.push_back(std::move(view));
  }
  return views;
}

}  // namespace drape::calib
