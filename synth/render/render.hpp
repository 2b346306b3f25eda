// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "core/camera_model.hpp"
#include "core/fields/fields.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/prints/face.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::synth {

/// Mixes 64 bits. Random numbers are computed from an index, so that a pixel's noise does not
/// depend on the order of threads.
[[nodiscard]] inline std::uint64_t mixed(std::uint64_t bits) {
  return SplitMix64(bits).next();
}

/// Number `index` of the stream `seed`, uniform in [0, 1).
[[nodiscard]] inline double uniform(std::uint64_t seed, std::uint64_t index) {
  return static_cast<double>(mixed(mixed(seed) ^ index) >> 11U) * 0x1p-53;
}

/// Number `index` of the stream `seed`, standard normal (Box, Muller 1958).
[[nodiscard]] inline double normal(std::uint64_t seed, std::uint64_t index) {
  const double radius = std::sqrt(-2 * std::log(1 - uniform(seed, 2 * index)));
  return radius * std::cos(2 * std::numbers::pi * uniform(seed, 2 * index + 1));
}

/// Quadrilateral cell of the face; corners in either orientation.
using FaceCell = std::array<FacePoint, 4>;

/// Print on a face, with exact areas. Boxes must not overlap each other or any disc.
class FacePattern {
 public:
  FacePattern() = default;
  explicit FacePattern(const Face& face);

  /// Printed fraction of a cell's area, 0..1, in closed form.
  [[nodiscard]] double coverage(const FaceCell& cell) const;
  [[nodiscard]] bool is_printed(const FacePoint& point) const;
  /// False if the cell is certainly all printed or all bare.
  [[nodiscard]] bool has_edge_in(const FaceCell& cell) const;

 private:
  struct Bucket {
    std::vector<int> discs, boxes;
  };
  [[nodiscard]] Eigen::Vector2i bucket_of(const FacePoint& point) const;
  void add(const FacePoint& least, const FacePoint& most, int index, bool is_disc);
  /// Calls `visit(bucket)` for the buckets that a box overlaps; shapes may be repeated.
  template <class Visit>
  void visit(const FacePoint& least, const FacePoint& most, const Visit& visit) const;

  std::vector<FaceDisc> discs_;
  std::vector<FaceBox> boxes_;
  FacePoint first_ = FacePoint::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  std::vector<Bucket> buckets_;
};

/// A printed face in space: points on a regular grid of face coordinates, row-major. Each cell is
/// two triangles, split from its upper right to its lower left corner. The triangles are the exact
/// surface, for rendering and ground truth alike.
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

/// Shrinks every object and the table of a scene by `by_m`, and by more where a sharp edge would
/// protrude from the rounded one. A sheet drawn as triangles between marks then never intersects
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
  /// Direction at a position inside a pixel, (x, y) from 0 to 1 along its edges.
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

/// Illumination, lens and sensor of a picture.
struct RenderOptions {
  double white_grey = 190;      ///< grey level of the unprinted surface in full light
  double ink_ratio = 0.2;       ///< brightness of the print relative to the bare surface
  double background_grey = 25;  ///< grey level where there is no surface
  double ambient = 0.45;        ///< fraction of ambient light
  Eigen::Vector3d towards_light_in_world = {0.25, -0.35, 1};
  double gradient_per_px = 0;   ///< relative gradient of the light along u, as a triangular wave
  double weave_rms = 0;         ///< relative contrast of the weave's texture
  double weave_pitch_m = 3e-4;  ///< distance between threads
  double blur_px = 0.55;        ///< standard deviation of lens blur, without the pixel's own extent
  double noise_grey = 1.6;  ///< standard deviation at level 128; half its variance is shot noise
  std::uint64_t seed = 1;   ///< seed of the noise and the weave
  int threads = 1;          ///< number of threads; never changes a byte
};
void fields(Fields& f, RenderOptions& options);

/// Scene to render: one printed face and unprinted objects.
struct SyntheticScene {
  GridSurface surface;
  FacePattern pattern;
  std::vector<Triangle> scenery;
};

struct GreyPicture {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> bytes;  ///< row-major, 0..255
};

/// One camera's view of a scene, for queries and rendering.
class SceneView {
 public:
  SceneView(const SyntheticScene& scene, const Camera& camera, const PixelRays& rays);

  /// Brightness of each pixel before blur and noise, in grey levels. The printed fraction of a
  /// pixel is an exact closed-form area, not a count of samples.
  [[nodiscard]] std::vector<double> light(const RenderOptions& options) const;
  /// First surface seen at a pixel position.
  [[nodiscard]] Hit cast(const Eigen::Vector2d& px) const;
  [[nodiscard]] const Camera& camera() const { return camera_; }

 private:
  friend class Painter;
  const SyntheticScene& scene_;
  Camera camera_;
  const PixelRays& rays_;
  std::vector<Triangle> triangles_;
  Caster caster_;
};

/// Adds lens blur and noise and rounds to 8 bits. `frame` distinguishes pictures of one seed.
[[nodiscard]] GreyPicture expose(const std::vector<double>& light, int width_px, int height_px,
                                 std::uint64_t frame, const RenderOptions& options);

}  // namespace drape::synth
