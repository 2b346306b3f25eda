// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "calib/joint/model.hpp"

namespace drape::calib {

/// Models of the target in a fit.
enum class BoardKind {
  drawn,  ///< points at their nominal positions
  bow,    ///< nominal positions on a plate bent to two parabolas
  free,   ///< point positions estimated within the stated error of the print
};

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::BoardKind>[] = {"drawn", "bow",
                                                                                "free"};

namespace drape::calib {

/// Free parameters of a joint fit, and its limit of iterations.
struct JointFit {
  LensTerms lens = LensTerms::k1_k2_p1_p2;
  bool skew = false;
  BoardKind board = BoardKind::bow;
  bool lens_known = false;  ///< keep the cameras' lenses fixed
  bool cameras = true;      ///< false: fit placements only, to test a calibration on new poses
  int max_iterations = 100;
  /// Expected relative decrease at which the fit stops, far below the statistical uncertainty, so
  /// that the result does not depend on the start.
  double settled = 1e-10;
};

struct JointSolution {
  JointModel model;
  bool converged = false;
  int iterations = 0;
  double chi2 = 0;  ///< weighted sum of squares at the end
};

/// Least squares over all cameras, unknown placements and the board together (Levenberg-Marquardt).
/// Signed residuals are weighted by the points' covariances; free points of the board are
/// eliminated first (Schur complement), the stated error of their print in units of the points'
/// noise. `near`: the start solves a nearly identical problem, so full Gauss-Newton steps are tried
/// immediately.
[[nodiscard]] JointSolution solve_joint(JointModel start, const JointFit& fit, bool near = false);

/// Effective number of parameters from the views; one held by a stated error counts in part.
[[nodiscard]] double free_parameters(const JointModel& model, const JointFit& fit);

/// Indices of a camera's free parameters.
[[nodiscard]] std::vector<int> moved_camera_parameters(const JointFit& fit);

/// Indices of the board's free parameters.
[[nodiscard]] std::vector<int> moved_board_parameters(const JointModel& model, const JointFit& fit);

/// Layout of the parameters of a fit: cameras, board, unknown placements, then one multiplier per
/// measured length.
struct JointLayout {
  std::vector<int> cameras, board;  ///< free parameters of one camera, and of the board
  Eigen::Index board_at = 0, common = 0, lengths_at = 0, size = 0;
  std::vector<Eigen::Index> placements;  ///< offsets, -1 if known
  Eigen::Index points = 0;               ///< number of free points of the board

  JointLayout(const JointModel& model, const JointFit& fit);
  [[nodiscard]] Eigen::Index camera(std::size_t i) const {
    return static_cast<Eigen::Index>(cameras.size() * i);
  }
};

/// Normal equations of a fit, linearised at its model. A measured length is a row and a column
/// with -1 on the diagonal, which keeps the points' blocks separate: its elimination adds its
/// square.
struct NormalEquations {
  JointLayout layout;
  Eigen::MatrixXd matrix;     ///< for all parameters except the free points
  Eigen::VectorXd pull;       ///< negative gradient
  Eigen::MatrixXd by_points;  ///< coupling to the points, three columns (mm) each
  Eigen::MatrixXd points;     ///< 3 x 3 blocks of the points, side by side
  Eigen::VectorXd points_pull;

  NormalEquations(const JointModel& model, const JointFit& fit);
  /// Eliminates the points from matrix and pull; damps by that fraction of the diagonal.
  void eliminate_points(double damping = 0);
  /// Steps (mm) of the points for given steps of the others, after eliminate_points().
  [[nodiscard]] Eigen::MatrixXd points_after(const Eigen::MatrixXd& steps, bool with_pull) const;
  /// Step of all parameters except the points. Placements are eliminated first unless free points
  /// couple them; empty if the equations are singular.
  [[nodiscard]] Eigen::VectorXd step() const;
};

/// Weighted squares of views (`chi2`) plus those of the stated errors; infinite if a point does not
/// project.
[[nodiscard]] double cost_of(const JointModel& model, const JointFit& fit, double& chi2);

/// Information matrix (inverse covariance) of all free parameters after elimination of the free
/// points: cameras, then the board, then the unknown placements, in the order of model.hpp.
[[nodiscard]] Eigen::MatrixXd information_of(const JointModel& model, const JointFit& fit);

/// Projected minus measured position of a frame's points (px, two rows per point), 0 for a point
/// that does not project.
[[nodiscard]] Eigen::VectorXd residuals_px(const JointModel& model, const JointFrame& frame);

/// Information of one placement on cameras and board, after elimination of its pose; free points of
/// the board depend on the parameters as determined by all views.
struct ViewInformation {
  std::size_t placement = 0;
  Eigen::MatrixXd information;  ///< inverse covariance from the points' covariances
  Eigen::VectorXd score;        ///< gradient J'Wr of the residuals; the sum is zero at the optimum
  Eigen::MatrixXd with_world;   ///< the information if this placement alone defines the world
};

/// Information of the visible placements and of the stated errors.
struct ViewsInformation {
  std::vector<ViewInformation> views;
  Eigen::MatrixXd stated;

  [[nodiscard]] Eigen::MatrixXd sum() const;  ///< sum of `with_world` and stated errors
};

/// Additional parameters that the fit lacks: derivatives of a frame (px, two rows per point).
struct MoreColumns {
  Eigen::Index count = 0;
  std::function<Eigen::MatrixXd(const JointFrame&)> of = {};
};

/// The parameters of `more` come last, after the board.
[[nodiscard]] ViewsInformation information_by_view(const JointModel& model, const JointFit& fit,
                                                   const MoreColumns& more = {});

}  // namespace drape::calib
