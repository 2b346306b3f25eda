// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "core/camera_model.hpp"
#include "core/scene.hpp"
#include "synth/render/grid_surface.hpp"

namespace drape::synth {

/// A triangle of a surface; corner k has normals[k] and lies at face[k] of the printed face.
struct Triangle {
  std::array<Eigen::Vector3d, 3> corners_in_world;
  std::array<Eigen::Vector3d, 3> normals_in_world;
  std::array<FacePoint, 3> face = {FacePoint::Zero(), FacePoint::Zero(), FacePoint::Zero()};
  double reflectance = 1;
  bool printed = false;  ///< true if part of the printed face
};

[[nodiscard]] std::vector<Triangle> triangles_of(const GridSurface& surface);

/// Triangles of a scene's objects and of its table, half a metre around the origin. Throws
/// Error(bad_input) for a mesh object, which this stage cannot read. Edges are drawn sharp.
[[nodiscard]] std::vector<Triangle> triangles_of(const Scene& scene);
[[nodiscard]] std::vector<Triangle> table_triangles(double z_m);

/// The scene with every object and the table shrunk by `by_m`, and by more where a sharp edge would
/// protrude from the rounded one, so that a sheet drawn as triangles between marks never intersects
/// its support.
[[nodiscard]] Scene drawn_in(Scene scene, double by_m);

/// First intersection of a ray with the scene.
struct Hit {
  int triangle = -1;  ///< -1 for none
  double b1 = 0, b2 = 0;
  double depth_m = 0;  ///< z in the camera frame
  bool front = false;  ///< true if seen from the printed side

  [[nodiscard]] bool is_hit() const { return triangle >= 0; }
};

/// Rays of a camera's pixels: one per pixel corner, computed once for many pictures.
class PixelRays {
 public:
  explicit PixelRays(const CameraModel& model);
  /// Undistorted (X/Z, Y/Z) at a pixel position; exact at pixel corners, bilinear in between.
  [[nodiscard]] Eigen::Vector2d direction(double u, double v) const;
  /// Direction at a position inside a pixel, (x, y) from 0 to 1 along its sides.
  [[nodiscard]] Eigen::Vector2d within(int column, int row, double x, double y) const;
  [[nodiscard]] const Eigen::Vector2d& corner(int column, int row) const {
    return corners_[static_cast<std::size_t>(row) * (width_ + 1) + column];
  }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] double focal_px() const { return focal_px_; }  ///< at the centre of the image

 private:
  int width_, height_;
  double focal_px_ = 1;
  std::vector<Eigen::Vector2d> corners_;  ///< NaN where no ray exists
};

/// Casts rays of one camera at triangles, accelerated by tiles of 8 x 8 pixels.
class Caster {
 public:
  Caster(const Camera& camera, const std::vector<Triangle>& triangles);

  /// First hit of a ray in this direction, which must lie in the pixel (column, row).
  [[nodiscard]] Hit cast(int column, int row, const Eigen::Vector2d& direction) const;
  [[nodiscard]] FacePoint face(const Hit& hit) const;
  [[nodiscard]] Eigen::Vector3d normal_in_world(const Hit& hit) const;
  [[nodiscard]] const Triangle& triangle(const Hit& hit) const { return triangles_[hit.triangle]; }

 private:
  struct Packed {
    Eigen::Vector3d n0, n1, n2;
    double determinant;
  };
  static constexpr int tile = 8;
  void bin(const CameraModel& model, const std::vector<std::array<Eigen::Vector3d, 3>>& in_camera);

  const std::vector<Triangle>& triangles_;
  std::vector<Packed> packed_;
  int tiles_across_, tiles_down_;
  std::vector<int> first_, members_;  ///< members_[first_[t]] .. of tile t
};

}  // namespace drape::synth
