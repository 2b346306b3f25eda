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

/// A printed face in space: points over an even grid of face coordinates, row-major, each cell two
/// triangles cut from its upper right to its lower left corner. The triangles ARE the surface: what
/// is rendered and what is true are the same shape.
struct GridSurface {
  int rows = 0, cols = 0;  ///< number of points; rows follow y of the face, columns x
  FacePoint first = FacePoint::Zero();
  FacePoint step = FacePoint::Zero();
  std::vector<Eigen::Vector3d> points_in_world;

  [[nodiscard]] const Eigen::Vector3d& at(int row, int col) const {
    return points_in_world[static_cast<std::size_t>(row) * cols + col];
  }
  /// Place of a point of the face; empty beyond the surface's border.
  [[nodiscard]] std::optional<Eigen::Vector3d> point_in_world(const FacePoint& face) const;
  /// Unit normal out of the printed side, of the smooth surface through the points.
  [[nodiscard]] Eigen::Vector3d vertex_normal(int row, int col) const;
  [[nodiscard]] Eigen::Vector3d normal_in_world(const FacePoint& face) const;
};

/// Any shape: `place` takes a face point to world, metres.
[[nodiscard]] GridSurface surface_of(const FacePoint& least, const FacePoint& most, double step_m,
                                     const std::function<Eigen::Vector3d(const FacePoint&)>& place);

/// Folds z = A sin(2 pi x / wavelength + phase) of constant profile, without stretch: distances on
/// the face are arc lengths on the folds. Printed side up, face centre above `centre`.
struct Folds {
  double slope_rad = 30 * units::deg;  ///< steepest slope of the profile
  double wavelength_m = 0.1;
  double phase_rad = 0;
  double direction_rad = 0;  ///< from the face's x to the direction of the profile, on the face
  double yaw_rad = 0;        ///< from the world's +x to the face's x
  Eigen::Vector3d centre_in_world = Eigen::Vector3d::Zero();
};
void fields(Fields& f, Folds& folds);
[[nodiscard]] GridSurface folded(const Print& print, const Folds& folds, double step_m = 1.5e-3);

/// A measured or virtual sheet on a full grid, made finer by cubic interpolation (Catmull, Rom
/// 1974). Throws Error(bad_input) for a sheet with gaps.
[[nodiscard]] GridSurface surface_of(const Sheet& sheet, double step_m = 2e-3);

/// The face of a target with a border of one pitch, in the pose.
[[nodiscard]] GridSurface surface_of(const Target& target, const WorldFromTarget& pose);

}  // namespace drape::synth
