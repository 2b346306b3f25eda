// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/fields/records.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/scene.hpp"
#include "triangulate/point.hpp"

namespace drape::triangulate {

/// Pose of a plate of dots with tags. Its frame is that of a calibration target: origin at the
/// centre of the dots, x along the columns, y along the rows, z out of the printed face.
struct PlatePose {
  WorldFromObject world_from_plate;
  /// Covariance of the origin (m) and of a small rotation about the world's axes (rad), from the
  /// dots' noise, scaled to the residuals, and from the cameras' covariance.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int dots = 0;
  int views = 0;            ///< number of dot views over all cameras
  double rms_px = 0;        ///< root mean square of the residuals
  double chi2_per_dof = 0;  ///< relative to the dots' covariance; should be about 1
};

/// Rigid pose that fits all dots of a set: Gauss-Newton on pixels over all cameras, with each dot
/// as the centroid of its image. The cameras' covariance, including their correlation, is
/// propagated. Throws Error(bad_input) if the set does not exist, the detections are not of a
/// target, fewer than four dots are seen by two cameras, or the fit does not converge.
[[nodiscard]] PlatePose plate_pose(const Detections& detections, const Calibration& calibration,
                                   const std::string& set, double floor_px);

/// Same, from existing views; `marks` outside the lattice are ignored.
[[nodiscard]] PlatePose plate_pose(const std::vector<MarkViews>& marks, const MarkLattice& lattice);

/// Placement of the plate on the object.
struct PlateOnObject {
  double thickness_mm =
      0.1;             ///< thickness of a box's sheet: height of the printed face above the top
  double hole_mm = 0;  ///< diameter of the hole that carries a sphere
  double placing_mm = 0.2;  ///< standard uncertainty of the plate's placement along x, y and z
};

void fields(Fields& f, PlateOnObject& lies);

/// One value of an object, as measured and as stated in the scene.
struct ObjectValue {
  std::string key;  ///< "x_mm", "y_mm", "z_bottom_mm", "yaw_deg"
  double measured = 0;
  double uncertainty = 0;  ///< standard uncertainty of the measured value, including placing
  double stated = 0;
  double stated_uncertainty = 0;  ///< standard uncertainty

  /// True beyond three standard uncertainties of the difference.
  [[nodiscard]] bool contradicts() const;
};

void fields(Fields& f, ObjectValue& value);

/// object.json: position of an object measured by its plate of tags, compared with the scene.
struct MeasuredObject {
  std::vector<ObjectValue> values;
  std::vector<std::string> contradictions;  ///< NO-GO inputs, and values that contradict
  int dots = 0;
  double rms_px = 0, chi2_per_dof = 0;
};

void fields(Fields& f, MeasuredObject& object);

/// Position and rotation of a box (the plate lies on its top, edges aligned) or a sphere (it rests
/// in the plate's hole). The size, and the choice among a box's equivalent sides for the yaw, are
/// the scene's. Throws Error(bad_input) for another kind of object, a hole wider than the sphere,
/// or a placing uncertainty above a quarter of the object's width, which would prove nothing.
[[nodiscard]] std::vector<ObjectValue> object_values(const PlatePose& plate,
                                                     const PlateOnObject& lies,
                                                     const Obstacle& object,
                                                     const ObjectUncertainty& stated);

/// Standard uncertainty of the position for a scene file (mm): the larger of x and y. The bottom's
/// height also has the uncertainty of the size, which the scene states separately.
[[nodiscard]] double place_uncertainty_mm(const std::vector<ObjectValue>& values);

/// Explains why the plate of this lattice cannot lie on a box with edges aligned: its sheet, one
/// pitch per dot (`drape print object-tags`), differs from an edge of the top by more than three
/// standard deviations of two placed edges and of the stated size.
[[nodiscard]] std::optional<std::string> why_not_edge_on_edge(const MarkLattice& lattice,
                                                              const PlateOnObject& lies,
                                                              const Obstacle& object,
                                                              const ObjectUncertainty& stated);

/// Angle between the plate's normal and the vertical (rad), with its standard uncertainty.
struct Tilt {
  double rad = 0, uncertainty_rad = 0;
};

[[nodiscard]] Tilt tilt_of(const PlatePose& plate);

/// Text of a scene file in which object number `object` (from 1) has the position measured by its
/// plate, with place_uncertainty_mm and without its `tags_` keys. File names are relative to
/// `folder`. Everything else stays as written. Throws Error(bad_input) if a value of the object is
/// not on a line of its own.
[[nodiscard]] std::string measured_scene(const std::filesystem::path& scene, std::size_t object,
                                         const std::vector<ObjectValue>& values,
                                         const std::filesystem::path& folder);

/// Throws Error(usage) if `file` exists and is not a measured scene, since it may be hand-written.
void require_own_scene(const std::filesystem::path& file);

}  // namespace drape::triangulate

template <>
inline constexpr drape::Format drape::format_of<drape::triangulate::MeasuredObject>{
    "object", drape::Syntax::json, 1,
    "object.json: position of an object measured by its plate of tags, compared with the scene"};
