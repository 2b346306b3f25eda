// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/pose.hpp"
#include "core/rig.hpp"
#include "core/sheet.hpp"
#include "core/units.hpp"
#include "synth/render/face_pattern.hpp"

namespace drape::synth {

/// A printed face in space: points on a regular grid of face coordinates, row-major; each cell is
/// two triangles divided from its upper right to its lower left corner. The triangles themselves
/// are the surface, so that rendering and ground truth use the same shape.
struct GridSurface {
  int rows = 0, cols = 0;  ///< number of points; rows follow the face's y, columns its x
  FacePoint first = FacePoint::Zero();
  FacePoint step = FacePoint::Zero();
  std::vector<Eigen::Vector3d> points_in_world;

  [[nodiscard]] const Eigen::Vector3d& at(int row, int col) const {
    return points_in_world[static_cast<std::size_t>(row) * cols + col];
  }
  /// Position of a face point; nullopt outside the surface.
  [[nodiscard]] std::optional<Eigen::Vector3d> point_in_world(const FacePoint& face) const;
  /// Unit normal on the printed side, of the smooth surface through the points.
  [[nodiscard]] Eigen::Vector3d vertex_normal(int row, int col) const;
  [[nodiscard]] Eigen::Vector3d normal_in_world(const FacePoint& face) const;
};

/// Makes any surface: `place` maps a face point to the world, metres.
[[nodiscard]] GridSurface surface_of(const FacePoint& least, const FacePoint& most, double step_m,
                                     const std::function<Eigen::Vector3d(const FacePoint&)>& place);

/// Folds z = A sin(2 pi x / wavelength + phase) of constant profile, without stretch: distances on
/// the face are arc lengths along the folds. Printed side up, face centred above `centre`.
struct Folds {
  double slope_rad = 30 * units::deg;  ///< steepest slope of the profile
  double wavelength_m = 0.1;
  double phase_rad = 0;
  double direction_rad = 0;  ///< angle on the face from its x axis to the direction of the profile
  double yaw_rad = 0;        ///< angle from the world's x axis to the face's x axis
  Eigen::Vector3d centre_in_world = Eigen::Vector3d::Zero();
};
void fields(Fields& f, Folds& folds);
[[nodiscard]] GridSurface folded(const Print& print, const Folds& folds, double step_m = 1.5e-3);

/// Surface of a measured or simulated sheet on a complete grid, refined by cubic interpolation
/// (Catmull, Rom 1974). Throws Error(bad_input) for a sheet with gaps.
[[nodiscard]] GridSurface surface_of(const Sheet& sheet, double step_m = 2e-3);

/// Face of a target in a given pose, with a border of one pitch.
[[nodiscard]] GridSurface surface_of(const Target& target, const WorldFromTarget& pose);

}  // namespace drape::synth
