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

/// Brown's coefficients that a fit may move; the others stay 0.
enum class LensTerms { k1, k1_k2, k1_k2_p1_p2, k1_k2_p1_p2_k3 };
inline constexpr LensTerms all_lens_terms[] = {LensTerms::k1, LensTerms::k1_k2,
                                               LensTerms::k1_k2_p1_p2, LensTerms::k1_k2_p1_p2_k3};

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::LensTerms>[] = {
    "k1", "k1 k2", "k1 k2 p1 p2", "k1 k2 p1 p2 k3"};

namespace drape::calib {

/// Order of a camera's parameters: fx fy cx cy k1 k2 p1 p2 k3 (px and 1), skew (px), a turn on top
/// of the rotation (rad), the translation (mm). Of a placement: turn (rad), translation (mm). Of
/// the board: its two bows (mm), then stretch of x against y, shear and scale of the print (1).
inline constexpr int lens_parameters = 10;
inline constexpr int camera_parameters = 16;
inline constexpr int placement_parameters = 6;
inline constexpr int board_parameters = 5;
/// Standard deviation (1) of a print's stretch, shear and scale where none is stated: printers feed
/// paper to some tenths of a percent.
inline constexpr double print_sd = 5e-3;

/// A point of the target as one camera saw it.
struct TargetPoint {
  MarkId dot;
  Eigen::Vector3d point_in_target;  ///< place on the flat target, metres
  Eigen::Vector2d measured_px;
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  Eigen::Vector2d eccentricity_px = Eigen::Vector2d::Zero();  ///< centroid minus image of centre
  double weight = 1;                                          ///< weight of the robust loss, 0 to 1
  int place = -1;  ///< index among the board's shifts; -1: the point has none

  /// Image of the point itself.
  [[nodiscard]] Eigen::Vector2d px() const { return measured_px - eccentricity_px; }
};

/// A camera with Brown's lens; `skew_px` moves u by skew times the distorted y (Zhang 1998).
struct JointCamera {
  Camera camera;
  double skew_px = 0;
  double square_sd = 0;  ///< standard uncertainty of fy/fx = 1 that the rig promises; 0: none
};

/// The target as it lay for one frame set.
struct Placement {
  std::string set;
  WorldFromTarget world_from_target;
  bool known = false;  ///< a z stage, or the one that defines the world
};

struct JointFrame {
  std::size_t camera = 0, placement = 0;
  std::vector<TargetPoint> points;
};

/// The target as it is against its drawing. The two parabolas of its bow are Kojima's and mrcal's
/// with their mean over the target taken out, so that the world's plane z = 0 stays the plate's
/// mean plane.
struct Board {
  Eigen::Vector2d half_m = Eigen::Vector2d::Ones();        ///< half width and height
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();          ///< mean of the squared relative x and y
  Eigen::Vector2d edge_rise_mm = Eigen::Vector2d::Zero();  ///< edge above middle, along x and y
  Eigen::Vector3d stretch = Eigen::Vector3d::Zero();  ///< of x against y, shear, scale of the print
  std::vector<Eigen::Vector3d> shift_mm;              ///< of each point beyond that

  // Stated errors of the print, as standard deviations; they hold what the views leave open.
  Eigen::Matrix<double, board_parameters, board_parameters> information =
      Eigen::Matrix<double, board_parameters, board_parameters>::Zero();
  std::vector<Eigen::Vector3d> point_sd_mm;  ///< by point
  std::vector<Eigen::Vector3d> drawn;        ///< the points in the target, metres
  bool error_stated = false;                 ///< else the views find how large the points' error is
  bool measured = false;                     ///< the places are those that views measured

  /// Height (1) above the plane for one unit of each edge rise.
  [[nodiscard]] Eigen::Vector2d shape(const Eigen::Vector3d& point_in_target) const;
  /// Displacement (mm) of a point by one unit of each of the board's parameters.
  [[nodiscard]] Eigen::Matrix<double, 3, board_parameters> shapes(
      const Eigen::Vector3d& point_in_target) const;
  /// Place of a point of the drawn target, metres; `place` is its index or -1.
  [[nodiscard]] Eigen::Vector3d bent(const Eigen::Vector3d& point_in_target, int place = -1) const;
  [[nodiscard]] Eigen::Matrix<double, board_parameters, 1> parameters() const;
};

/// A distance on the target that was measured.
struct MeasuredLength {
  int from = 0, to = 0;  ///< places of the board
  Eigen::Vector3d from_in_target, to_in_target;
  double length_mm = 0, sd_mm = 0;
};

struct JointModel {
  std::vector<JointCamera> cameras;
  std::vector<Placement> placements;
  std::vector<JointFrame> frames;  ///< by placement, then camera
  Board board;
  std::vector<MeasuredLength> lengths;  ///< that the fit takes for the print's scale
  double noise = 1;                     ///< variance of the points over that of their covariances
  bool world_by_first_view = false;     ///< no stage: the first view that is used holds the world
};

/// Image of a target point with its derivatives; turns are about the present rotations.
struct TargetImage {
  Eigen::Vector2d px;
  Eigen::Matrix<double, 2, camera_parameters> by_camera;
  Eigen::Matrix<double, 2, placement_parameters> by_placement;
  Eigen::Matrix<double, 2, 3> by_point;  ///< by the point's own place in the target, mm
  Eigen::Matrix<double, 2, board_parameters> by_board;
};

/// Pixel of a target point; nothing where it does not project.
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

/// Moves a camera (placement) by parameters as listed above; `p` holds all of them, turns are
/// relative to the argument's rotation.
[[nodiscard]] JointCamera moved(const JointCamera& camera, const double* p);
[[nodiscard]] Placement moved(const Placement& placement, const double* p);

}  // namespace drape::calib
