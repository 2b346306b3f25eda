// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "core/drawing/svg.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// Cells of a sheet as pictures draw them, some 40 a side at most, corners in turn; without those
/// that lack a corner.
[[nodiscard]] std::vector<std::array<Eigen::Vector3d, 4>> drawn_cells(const Sheet& sheet);

/// Projection of the world into a picture, and its centre.
struct Viewer {
  std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector3d&)> place;
  Eigen::Vector3d eye_in_world;
};

/// Orthographic view along a direction.
struct Orthographic {
  Eigen::Vector3d right, up, toward;  ///< unit vectors in the world; `toward` the viewer
  double scale = 1;                   ///< picture units per metre
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< place of the world's origin

  [[nodiscard]] static Orthographic from(double azimuth_rad, double elevation_rad);
  /// Puts the points into a square of the picture with a margin around; returns the height taken.
  double fit(const std::vector<Eigen::Vector3d>& points, double left, double side, double margin);
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector3d& point) const;
  [[nodiscard]] Viewer viewer() const;
};

/// Faces of cloth and objects, and what else is drawn among them, painted from far to near.
class Painter {
 public:
  explicit Painter(Viewer viewer) : viewer_(std::move(viewer)) {}

  void add_cloth(const Sheet& cloth);
  /// The faces that the cloth does not cover and that look at the viewer.
  void add_objects(const Scene& scene, const Sheet& cloth);
  /// Drawn as if `nearer_m` nearer than `point`.
  void add(const Eigen::Vector3d& point, double nearer_m, std::function<void(Svg&)> draw);
  void paint(Svg& svg);

 private:
  struct Item {
    double distance_m;
    std::function<void(Svg&)> draw;
  };
  void add_face(const std::array<Eigen::Vector3d, 4>& corners, const Eigen::Vector3d& rgb,
                bool two_sided);
  Viewer viewer_;
  std::vector<Item> items_;
};

}  // namespace drape::compare
