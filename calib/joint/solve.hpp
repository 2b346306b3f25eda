// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "calib/joint/model.hpp"

namespace drape::calib {

/// The target as a fit takes it.
enum class BoardKind {
  drawn,  ///< each point where the target's file says
  bow,    ///< the same on a plate of two parabolas
  free,   ///< each point by the views, within the stated error of the print
};

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::BoardKind>[] = {"drawn", "bow",
                                                                                "free"};

namespace drape::calib {

/// Parameters that a joint fit may move, and its limit of iterations.
struct JointFit {
  LensTerms lens = LensTerms::k1_k2_p1_p2;
  bool skew = false;
  BoardKind board = BoardKind::bow;
  bool lens_known = false;  ///< the cameras' lenses stay as they are
  bool cameras = true;      ///< false: placements only, to test a calibration on poses it never saw
  int max_iterations = 100;
  /// Expected relative decrease that ends the fit, far below what a covariance can tell, so that
  /// the end does not depend on the start.
  double settled = 1e-10;
};

struct JointSolution {
  JointModel model;
  bool converged = false;
  int iterations = 0;
  double chi2 = 0;  ///< weighted sum of squares at the end
};

/// Least squares over all cameras, unknown placements and the board together (Levenberg-Marquardt),
/// signed residuals weighted by the points' covariances; a board's free points are eliminated first
/// (Schur complement), their print's stated error in units of the points' noise.
/// `near`: the start is a solution of nearly the same problem, so that full Gauss-Newton steps are
/// tried from the first on.
[[nodiscard]] JointSolution solve_joint(JointModel start, const JointFit& fit, bool near = false);

/// Number of parameters that the views determine; one that a stated error holds counts in part.
[[nodiscard]] double free_parameters(const JointModel& model, const JointFit& fit);

/// Indices of a camera's parameters that the fit moves.
[[nodiscard]] std::vector<int> moved_camera_parameters(const JointFit& fit);

/// Indices of the board's parameters that the fit moves.
[[nodiscard]] std::vector<int> moved_board_parameters(const JointModel& model, const JointFit& fit);

/// Places of the parameters of a fit: cameras, board, unknown placements, then one multiplier for
/// each measured length.
struct JointLayout {
  std::vector<int> cameras, board;  ///< moved parameters of one camera, and of the board
  Eigen::Index board_at = 0, common = 0, lengths_at = 0, size = 0;
  std::vector<Eigen::Index> placements;  ///< offsets, -1 when known
  Eigen::Index points = 0;               ///< free points of the board

  JointLayout(const JointModel& model, const JointFit& fit);
  [[nodiscard]] Eigen::Index camera(std::size_t i) const {
    return static_cast<Eigen::Index>(cameras.size() * i);
  }
};

/// Normal equations of a fit about its model. A measured length stands as a row and a column with
/// -1 on the diagonal, which keeps the points apart from each other: whoever eliminates it adds its
/// square.
struct NormalEquations {
  JointLayout layout;
  Eigen::MatrixXd matrix;     ///< all but the free points
  Eigen::VectorXd pull;       ///< minus the gradient
  Eigen::MatrixXd by_points;  ///< against the points, three columns (mm) each
  Eigen::MatrixXd points;     ///< 3 x 3 of each point, side by side
  Eigen::VectorXd points_pull;

  NormalEquations(const JointModel& model, const JointFit& fit);
  /// Takes the points out of matrix and pull; damps by that part of the diagonal.
  void eliminate_points(double damping = 0);
  /// Step (mm) of the points, after eliminate_points(), that goes with steps of the others.
  [[nodiscard]] Eigen::MatrixXd points_after(const Eigen::MatrixXd& steps, bool with_pull) const;
  /// Steps of all but the points, the placements eliminated first where no free point joins them;
  /// empty when they cannot be separated.
  [[nodiscard]] Eigen::VectorXd step() const;
};

/// Weighted squares of views (`chi2`) and of the stated errors together; infinite where a point
/// does not project.
[[nodiscard]] double cost_of(const JointModel& model, const JointFit& fit, double& chi2);

/// Information (inverse covariance) of all moved parameters but free points, which are eliminated:
/// cameras, then the board, then the unknown placements, in the order of joint_model.hpp.
[[nodiscard]] Eigen::MatrixXd information_of(const JointModel& model, const JointFit& fit);

/// Image minus measured place of a frame's points (px, two rows a point), 0 where one does not
/// project.
[[nodiscard]] Eigen::VectorXd residuals_px(const JointModel& model, const JointFrame& frame);

/// Information of one placement of the target on cameras and board, its own pose eliminated; free
/// points of the board follow the parameters as all views together say.
struct ViewInformation {
  std::size_t placement = 0;
  Eigen::MatrixXd information;  ///< inverse covariance, from the points' covariances
  Eigen::VectorXd score;        ///< pull of the residuals, J'Wr; their sum is zero at the optimum
  Eigen::MatrixXd with_world;   ///< the information where this placement alone holds the world
};

/// Information of the placements that are seen, and of the stated errors.
struct ViewsInformation {
  std::vector<ViewInformation> views;
  Eigen::MatrixXd stated;

  [[nodiscard]] Eigen::MatrixXd sum() const;  ///< of all `with_world` and the stated errors
};

/// Parameters that the fit does not have: derivative of a frame (px, two rows a point) by each.
struct MoreColumns {
  Eigen::Index count = 0;
  std::function<Eigen::MatrixXd(const JointFrame&)> of = {};
};

/// The parameters of `more` stand last, after the board.
[[nodiscard]] ViewsInformation information_by_view(const JointModel& model, const JointFit& fit,
                                                   const MoreColumns& more = {});

}  // namespace drape::calib
