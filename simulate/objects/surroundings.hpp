// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "core/geometry/closed_mesh.hpp"
#include "core/scene.hpp"

namespace drape::simulate {

/// Horizontal plane on which the cloth may lie.
struct Table {
  double z_m = 0;
};

/// A closed mesh placed in the world.
struct PlacedMesh {
  std::shared_ptr<const ClosedMesh> mesh;
  WorldFromObject world_from_mesh;
};

/// Gaps between two bodies, or a body and the table, that are thinner than this are closed to
/// cloth.
constexpr double kClosed_m = 0.5e-3;

/// All rigid bodies around the cloth. Signed distances are exact outside and near the surface. All
/// shapes but meshes are convex, so the distance along a straight line has a single minimum.
///
/// Cloth without thickness would slip under a ball that stands on a table, which touches it at a
/// point only. Cloth of thickness t between two surfaces has distances g + h >= t from them, so
/// gaps below `closed_m` are closed:
/// - Between a body and the table or a plane, the body reaches down to and below the flat surface
///   with the cross-section that it has `closed_m` above it, if it is wider there.
/// - Between two other bodies, the later one has the gap min(g, s), with s = g + h - closed_m and g
///   and h the distances from both; s counts half if it is positive, so that no gap above zero
///   changes faster than a point moves.
class Surroundings {
 public:
  Surroundings() = default;
  explicit Surroundings(const Scene& scene, double closed_m = 0);

  template <class Shape>
  void add(const Shape& shape) {
    shapes_.emplace_back(shape);
  }
  /// Reads the mesh; throws Error naming the file if it is not a closed triangle mesh.
  void add(const MeshObject& object);

  [[nodiscard]] int count() const { return static_cast<int>(shapes_.size()); }
  [[nodiscard]] bool is_table(int shape) const {
    return std::holds_alternative<Table>(shapes_[shape]);
  }
  /// True for flat shapes: if no particle penetrates them, nothing between particles does.
  [[nodiscard]] bool is_flat(int shape) const {
    return is_table(shape) || std::holds_alternative<Plane>(shapes_[shape]);
  }
  /// Radius of the tightest convex edge: 0 for meshes, infinite for shapes without edges.
  [[nodiscard]] double edge_radius_m(int shape) const;
  /// The shape if it is a mesh, else null.
  [[nodiscard]] const PlacedMesh* mesh(int shape) const {
    return std::get_if<PlacedMesh>(&shapes_[shape]);
  }
  /// Signed distance of a world point from the surface (m), negative inside.
  [[nodiscard]] double gap_m(int shape, const Eigen::Vector3d& point_in_world) const;
  struct Nearest {
    double gap_m = 0;        ///< signed distance, as in gap_m()
    Eigen::Vector3d normal;  ///< outward unit normal at the nearest surface point, world frame
    /// Index of the flat face nearest to the point; -1 for none, as at edges and on round bodies.
    /// Between points of one face the gap is linear.
    int face = -1;
    double slope = 1;  ///< size of the gap's gradient; below 1 in a closed gap
  };
  [[nodiscard]] Nearest nearest(int shape, const Eigen::Vector3d& point_in_world) const;
  /// Second derivative of the gap, relative to its slope (1/m); zero for radii below 2 um and for
  /// meshes.
  [[nodiscard]] Eigen::Matrix3d curvature(int shape, const Eigen::Vector3d& point_in_world) const;
  [[nodiscard]] Eigen::Vector3d normal(int shape, const Eigen::Vector3d& point_in_world) const {
    return nearest(shape, point_in_world).normal;
  }
  /// First point on a segment that is deeper than `deep_m` in the shape, as a fraction of the
  /// segment; nullopt if there is none. Advances by the free distance around each point (sphere
  /// tracing, Hart 1996); bodies thinner than 0.1 mm or a thousandth of the segment may be
  /// missed.
  [[nodiscard]] std::optional<double> first_entry(int shape, const Eigen::Vector3d& from_in_world,
                                                  const Eigen::Vector3d& to_in_world,
                                                  double deep_m) const;
  /// Highest point of the table and of all objects except planes (m).
  [[nodiscard]] double top_z_m() const;

 private:
  /// The point whose distance from a shape decides, and the normal of the flat shape above which it
  /// is raised; zero if it is the point itself.
  struct Raised {
    Eigen::Vector3d at, floor;
  };
  [[nodiscard]] double own_gap_m(int shape, const Eigen::Vector3d& p) const;
  [[nodiscard]] Raised raised(int shape, const Eigen::Vector3d& p) const;
  [[nodiscard]] double gap_over_floors_m(int shape, const Eigen::Vector3d& p) const {
    return own_gap_m(shape, raised(shape, p).at);
  }
  [[nodiscard]] Nearest nearest_over_floors(int shape, const Eigen::Vector3d& p) const;
  [[nodiscard]] Eigen::Matrix3d curvature_over_floors(int shape, const Eigen::Vector3d& p) const;
  /// The earlier body whose gap with a shape is closed at a point, and the gap there.
  struct Closed {
    int with = -1;
    double gap_m = 0;
  };
  [[nodiscard]] Closed closed(int shape, const Eigen::Vector3d& p) const;

  std::vector<std::variant<Sphere, Box, Table, Cylinder, Plane, PlacedMesh>> shapes_;
  double closed_m_ = 0;               ///< thickness below which gaps are closed
  std::vector<int> floors_, bodies_;  ///< flat shapes and others, if gaps are closed
};

}  // namespace drape::simulate
