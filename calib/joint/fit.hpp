// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/tsai/tsai.hpp"
#include "core/camera_model.hpp"
#include "core/fields/fields.hpp"
#include "core/marks.hpp"

namespace drape::calib {

/// Set of Brown's coefficients that a fit estimates; the others stay 0.
enum class LensTerms { k1, k1_k2, k1_k2_p1_p2, k1_k2_p1_p2_k3 };

inline constexpr LensTerms all_lens_terms[] = {LensTerms::k1, LensTerms::k1_k2,
                                               LensTerms::k1_k2_p1_p2, LensTerms::k1_k2_p1_p2_k3};

/// Parameters of a camera: fx fy cx cy k1 k2 p1 p2 k3 (px and 1), skew (px), incremental rotation
/// (rad), translation (mm). A placement has rotation (rad) and translation (mm); the board two bows
/// (mm), then stretch of x against y, shear and scale of the print (1).
inline constexpr int lens_parameters = 10;

inline constexpr int camera_parameters = 16;

inline constexpr int placement_parameters = 6;

inline constexpr int board_parameters = 5;

/// Default standard deviation (1) of a print's stretch, shear and scale: paper feed of printers
/// varies by some tenths of a percent.
inline constexpr double print_sd = 5e-3;

/// A point of the target as seen by one camera.
struct TargetPoint {
  MarkId dot;
  Eigen::Vector3d point_in_target;  ///< position on the flat target, metres
  Eigen::Vector2d measured_px;
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  Eigen::Vector2d eccentricity_px = Eigen::Vector2d::Zero();  ///< centroid minus centre's image
  double weight = 1;                                          ///< weight of the robust loss, 0 to 1
  int place = -1;  ///< index among the board's shifts; -1 if the point has none

  /// Image of the point's centre.
  [[nodiscard]] Eigen::Vector2d px() const { return measured_px - eccentricity_px; }
};

/// A camera with a Brown lens; `skew_px` shifts u by skew times the distorted y (Zhang 1998).
struct JointCamera {
  Camera camera;
  double skew_px = 0;
  double square_sd = 0;  ///< standard uncertainty of fy/fx = 1 stated in the rig; 0 if none
};

/// Pose of the target in one frame set.
struct Placement {
  std::string set;
  WorldFromTarget world_from_target;
  bool known = false;  ///< true for a z stage or the placement that defines the world
};

struct JointFrame {
  std::size_t camera = 0, placement = 0;
  std::vector<TargetPoint> points;
};

/// Deviations of the target from its drawing. The bow is two parabolas, like those of Kojima and
/// mrcal, minus their mean over the target, so that the world's plane z = 0 remains the mean plane
/// of the plate.
struct Board {
  Eigen::Vector2d half_m = Eigen::Vector2d::Ones();  ///< half width and height
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();    ///< means of the squared relative x and y
  Eigen::Vector2d edge_rise_mm = Eigen::Vector2d::Zero();  ///< edge minus centre, along x and y
  Eigen::Vector3d stretch = Eigen::Vector3d::Zero();  ///< x against y, shear, scale of the print
  std::vector<Eigen::Vector3d> shift_mm;              ///< further shift of each point

  // Stated information on the print's errors; it constrains what the views do not determine.
  Eigen::Matrix<double, board_parameters, board_parameters> information =
      Eigen::Matrix<double, board_parameters, board_parameters>::Zero();
  std::vector<Eigen::Vector3d> point_sd_mm;  ///< by point
  std::vector<Eigen::Vector3d> drawn;        ///< nominal points in the target frame, metres
  bool error_stated = false;  ///< false: the size of the points' errors is estimated from the views
  bool measured = false;      ///< true if views measured the positions

  /// Height (1) above the plane per unit of each edge rise.
  [[nodiscard]] Eigen::Vector2d shape(const Eigen::Vector3d& point_in_target) const;
  /// Displacement (mm) of a point per unit of each of the board's parameters.
  [[nodiscard]] Eigen::Matrix<double, 3, board_parameters> shapes(
      const Eigen::Vector3d& point_in_target) const;
  /// Actual position of a nominal target point, metres; `place` is its index or -1.
  [[nodiscard]] Eigen::Vector3d bent(const Eigen::Vector3d& point_in_target, int place = -1) const;
  [[nodiscard]] Eigen::Matrix<double, board_parameters, 1> parameters() const;
};

/// A measured distance between two points of the target.
struct MeasuredLength {
  int from = 0, to = 0;  ///< indices of the points
  Eigen::Vector3d from_in_target, to_in_target;
  double length_mm = 0, sd_mm = 0;
};

struct JointModel {
  std::vector<JointCamera> cameras;
  std::vector<Placement> placements;
  std::vector<JointFrame> frames;  ///< ordered by placement, then camera
  Board board;
  std::vector<MeasuredLength> lengths;  ///< lengths that determine the scale of the print
  double noise = 1;                     ///< variance of the points over that of their covariances
  bool world_by_first_view = false;     ///< no stage: the first view in use defines the world
};

/// Image of a target point with derivatives; rotations are relative to the current ones.
struct TargetImage {
  Eigen::Vector2d px;
  Eigen::Matrix<double, 2, camera_parameters> by_camera;
  Eigen::Matrix<double, 2, placement_parameters> by_placement;
  Eigen::Matrix<double, 2, 3> by_point;  ///< by the point's own position in the target, px/mm
  Eigen::Matrix<double, 2, board_parameters> by_board;
};

/// Pixel of a target point; nullopt if it does not project.
[[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(const JointCamera& camera,
                                                      const Placement& placement,
                                                      const Board& board,
                                                      const Eigen::Vector3d& point_in_target,
                                                      int place = -1);

[[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(const JointModel& model,
                                                      const JointFrame& frame,
                                                      const TargetPoint& point);

[[nodiscard]] std::optional<TargetImage> image_of(const JointCamera& camera,
                                                  const Placement& placement, const Board& board,
                                                  const Eigen::Vector3d& point_in_target,
                                                  int place = -1);

[[nodiscard]] std::optional<TargetImage> image_of(const JointModel& model, const JointFrame& frame,
                                                  const TargetPoint& point);

/// Applies increments of the parameters listed above to a camera (placement); `p` holds all of
/// them, rotations are relative to the argument's.
[[nodiscard]] JointCamera moved(const JointCamera& camera, const double* p);

[[nodiscard]] Placement moved(const Placement& placement, const double* p);

/// Models of the target in a fit.
enum class BoardKind {
  drawn,  ///< points at their nominal positions
  bow,    ///< nominal positions on a plate bent to two parabolas
  free,   ///< point positions estimated within the stated error of the print
};

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

/// Solves for all cameras, unknown placements and the board together by least squares
/// (Levenberg-Marquardt). Signed residuals are weighted by the points' covariances. Free points of
/// the board are eliminated first (Schur complement); the stated error of their print is in units
/// of the points' noise. `near`: the start solves a nearly identical problem, so full Gauss-Newton
/// steps are tried immediately.
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
/// with -1 on the diagonal; this keeps the points' blocks separate, and its elimination adds its
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

/// Information matrix (inverse covariance) of all free parameters after elimination of the free
/// points: cameras, then the board, then the unknown placements, in the order above.
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

/// Limits for cleaning the measured points during the fit.
struct JointCleaning {
  double dot_diameter_m = 0;  ///< 0 for corners, which have no eccentricity
  double robust_sigmas = 3;   ///< above this a point's weight falls as 1/distance (Huber 1964)
  double outlier_sigmas = 6;  ///< above this it is rejected by name, unless the error is negligible
};

/// Alternates the fit with predicting each dot's eccentricity and each point's robust weight until
/// all converge. Distances are in units of the points' standard deviations, whose scale is
/// estimated from the median.
[[nodiscard]] JointSolution fit_joint(const JointModel& start, const JointFit& fit,
                                      const JointCleaning& cleaning);

/// Indices of the frames in which most points are outliers.
[[nodiscard]] std::vector<std::size_t> frames_off(const JointModel& model,
                                                  const JointCleaning& cleaning);

/// Number of points with an error above the limit at the target.
[[nodiscard]] std::size_t points_farther(const JointModel& model, double limit_m);

/// Removes outliers; describes each by set, camera and index.
[[nodiscard]] std::vector<std::string> reject_outliers(JointModel& model,
                                                       const JointCleaning& cleaning);

/// Error of a lens and a board on held-out views, with the placement of each view
/// fitted.
struct HeldOut {
  LensTerms lens = LensTerms::k1;
  BoardKind board = BoardKind::bow;
  double rms_px = 0;     ///< RMS point distance
  double object_mm = 0;  ///< same, at the point's distance from the camera
  int points = 0;
  struct View {
    double squares_px2 = 0;
    int points = 0;
  };
  std::vector<View> views;  ///< by placement, in an order independent of names and numbering
};

/// Sets parameters to 0 that the fit's lens and board do not have.
void clear_unused(JointModel& model, const JointFit& fit);

/// Leaves out one of `groups` groups of placements at a time; one placement always stays and
/// defines the world, chosen independently of the views' order.
[[nodiscard]] HeldOut held_out_error(const JointModel& solved, JointFit fit, int groups);

/// Selects the smallest lens (board) whose held-out error no larger one reduces by more than the
/// standard error of the difference (Breiman et al. 1984; bootstrap over placements, fixed seed);
/// returns its index. A real term is included however small it is against the noise of one point,
/// since its bias is common to thousands of points.
[[nodiscard]] std::size_t choose(const std::vector<HeldOut>& table);

/// Probability that each lens (board) has the least held-out error if placements are resampled from
/// the given ones; in the order of `table`, sum 1. It differs from how often choose() selects it:
/// intervals based on that have lower coverage on real boards (half_split_test).
[[nodiscard]] std::vector<double> probabilities(const std::vector<HeldOut>& table);

/// Names a view: "set pose_03, cam1".
[[nodiscard]] std::string name_of_view(const JointModel& model, const JointFrame& frame);

/// Number of points over all views.
[[nodiscard]] std::size_t count_points(const JointModel& model);

/// Indices of the board's points that a view shows.
[[nodiscard]] std::set<int> points_in_view(const JointModel& model);

/// Distance (px) of a point from its image; infinite if it does not project.
[[nodiscard]] double distance_px(const JointModel& model, const JointFrame& frame,
                                 const TargetPoint& point);

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::LensTerms>[] = {
    "k1", "k1 k2", "k1 k2 p1 p2", "k1 k2 p1 p2 k3"};

template <>
inline constexpr std::string_view drape::names_of<drape::calib::BoardKind>[] = {"drawn", "bow",
                                                                                "free"};
