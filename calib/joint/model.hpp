// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/tsai/correspondence.hpp"
#include "core/camera_model.hpp"
#include "core/fields/fields.hpp"
#include "core/marks.hpp"

namespace drape::calib {

/// Set of Brown's coefficients that a fit estimates; the others stay 0.
enum class LensTerms { k1, k1_k2, k1_k2_p1_p2, k1_k2_p1_p2_k3 };
inline constexpr LensTerms all_lens_terms[] = {LensTerms::k1, LensTerms::k1_k2,
                                               LensTerms::k1_k2_p1_p2, LensTerms::k1_k2_p1_p2_k3};

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::LensTerms>[] = {
    "k1", "k1 k2", "k1 k2 p1 p2", "k1 k2 p1 p2 k3"};

namespace drape::calib {

/// Parameters of a camera: fx fy cx cy k1 k2 p1 p2 k3 (px and 1), skew (px), incremental rotation
/// (rad), translation (mm). Of a placement: rotation (rad), translation (mm). Of the board: two
/// bows (mm), then stretch of x against y, shear and scale of the print (1).
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

/// Deviations of the target from its drawing. The bow consists of two parabolas, like those of
/// Kojima and mrcal, minus their mean over the target, so that the world's plane z = 0 remains the
/// mean plane of the plate.
struct Board {
  Eigen::Vector2d half_m = Eigen::Vector2d::Ones();  ///< half width and height
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();    ///< means of the squared relative x and y
  Eigen::Vector2d edge_rise_mm = Eigen::Vector2d::Zero();  ///< edge minus centre, along x and y
  Eigen::Vector3d stretch = Eigen::Vector3d::Zero();  ///< x against y, shear, scale of the print
  std::vector<Eigen::Vector3d> shift_mm;              ///< further shift of each point

  // Stated standard deviations of the print's errors; they constrain what views leave open.
  Eigen::Matrix<double, board_parameters, board_parameters> information =
      Eigen::Matrix<double, board_parameters, board_parameters>::Zero();
  std::vector<Eigen::Vector3d> point_sd_mm;  ///< by point
  std::vector<Eigen::Vector3d> drawn;        ///< nominal points in the target frame, metres
  bool error_stated = false;  ///< false: the size of the points' errors is estimated from the views
  bool measured = false;      ///< the positions were measured by views

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

}  // namespace drape::calib
