// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

#include "core/scene.hpp"

namespace drape::sim {

/// Horizontal plane that the cloth may lie on.
struct Table {
  double z_m = 0;
};

/// Everything rigid around the cloth. Shapes are convex and their signed distance is exact
/// outside and near the surface, so the distance along a straight line has one minimum.
class Surroundings {
 public:
  Surroundings() = default;
  explicit Surroundings(const Scene& scene);

  void add(const Sphere& sphere) { shapes_.emplace_back(sphere); }
  void add(const Box& box) { shapes_.emplace_back(box); }
  void add(const Table& table) { shapes_.emplace_back(table); }

  [[nodiscard]] int count() const { return static_cast<int>(shapes_.size()); }
  [[nodiscard]] bool is_table(int shape) const {
    return std::holds_alternative<Table>(shapes_[shape]);
  }
  /// Signed distance of a world point from the surface (m), negative inside.
  [[nodiscard]] double gap_m(int shape, const Eigen::Vector3d& point_in_world) const;
  /// Outward unit normal at the nearest surface point, world frame.
  [[nodiscard]] Eigen::Vector3d normal(int shape, const Eigen::Vector3d& point_in_world) const;
  /// Highest point of all objects but the table (m), or the table when there is no object.
  [[nodiscard]] double top_z_m() const;

 private:
  std::vector<std::variant<Sphere, Box, Table>> shapes_;
};

}  // namespace drape::sim
