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

/// Which of Brown's coefficients a fit may move; the others stay 0.
enum class LensTerms { k1, k1_k2, k1_k2_p1_p2, k1_k2_p1_p2_k3 };
inline constexpr LensTerms all_lens_terms[] = {LensTerms::k1, LensTerms::k1_k2,
                                               LensTerms::k1_k2_p1_p2, LensTerms::k1_k2_p1_p2_k3};

}  // namespace drape::calib

template <>
inline constexpr std::string_view drape::names_of<drape::calib::LensTerms>[] = {
    "k1", "k1 k2", "k1 k2 p1 p2", "k1 k2 p1 p2 k3"};

namespace drape::calib {

/// Order of a camera's parameters: fx fy cx cy k1 k2 p1 p2 k3 (px and 1), skew (px), a turn on top
/// of the rotation (rad), the translation (mm). Of a placement: turn (rad), translation (mm).
inline constexpr int lens_parameters = 10;
inline constexpr int camera_parameters = 16;
inline constexpr int placement_parameters = 6;
inline constexpr int bow_parameters = 2;

/// A point of the target as one camera saw it.
struct TargetPoint {
  MarkId dot;
  Eigen::Vector3d point_in_target;  ///< place on the flat target, metres
  Eigen::Vector2d measured_px;
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();
  Eigen::Vector2d eccentricity_px = Eigen::Vector2d::Zero();  ///< centroid minus image of centre
  double weight = 1;                                          ///< weight of the robust loss, 0 to 1

  /// Where the camera saw the point itself.
  [[nodiscard]] Eigen::Vector2d px() const { return measured_px - eccentricity_px; }
};

/// A camera with Brown's lens; `skew_px` moves u by skew times the distorted y (Zhang 1998).
struct JointCamera {
  Camera camera;
  double skew_px = 0;
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

/// The plate's bending, the two parabolas of Kojima's and mrcal's form with their mean over the
/// target taken out, so that the world's plane z = 0 stays the plate's mean plane.
struct BoardBow {
  Eigen::Vector2d half_m = Eigen::Vector2d::Ones();        ///< half width and height
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();          ///< mean of the squared relative x and y
  Eigen::Vector2d edge_rise_mm = Eigen::Vector2d::Zero();  ///< edge above middle, along x and y

  /// Height (1) above the plane for one unit of each edge rise.
  [[nodiscard]] Eigen::Vector2d shape(const Eigen::Vector3d& point_in_target) const;
  [[nodiscard]] Eigen::Vector3d bent(const Eigen::Vector3d& point_in_target) const;
};

struct JointModel {
  std::vector<JointCamera> cameras;
  std::vector<Placement> placements;
  std::vector<JointFrame> frames;  ///< by placement, then camera
  BoardBow bow;
  bool world_by_first_view = false;  ///< no stage: the first view that is used holds the world
};

/// Image of a target point with its derivatives; turns are about the present rotations.
struct TargetImage {
  Eigen::Vector2d px;
  Eigen::Matrix<double, 2, camera_parameters> by_camera;
  Eigen::Matrix<double, 2, placement_parameters> by_placement;
  Eigen::Matrix<double, 2, bow_parameters> by_bow;
};

/// Pixel of a target point; nothing where it does not project.
[[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(const JointCamera& camera,
                                                      const Placement& placement,
                                                      const BoardBow& bow,
                                                      const Eigen::Vector3d& point_in_target);
[[nodiscard]] std::optional<Eigen::Vector2d> pixel_of(const JointModel& model,
                                                      const JointFrame& frame,
                                                      const TargetPoint& point);
[[nodiscard]] std::optional<TargetImage> image_of(const JointCamera& camera,
                                                  const Placement& placement, const BoardBow& bow,
                                                  const Eigen::Vector3d& point_in_target);

/// Moves a camera (placement) by parameters as listed above; `p` holds all of them, turns are
/// relative to the argument's rotation.
[[nodiscard]] JointCamera moved(const JointCamera& camera, const double* p);
[[nodiscard]] Placement moved(const Placement& placement, const double* p);

}  // namespace drape::calib
