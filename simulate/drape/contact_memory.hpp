// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace drape::simulate {

/// State of contact: friction springs by material place. The same mesh continues from it exactly;
/// another mesh of the same cloth takes the stretch of the nearest places' springs, as a force per
/// area.
struct ContactMemory {
  /// Elastic-plastic friction spring between a place of the cloth and what it touches, as of the
  /// last settling. Values are per area (N/m^3, Pa) or absolute (N/m, N).
  struct Grip {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d stretch = Eigen::Vector3d::Zero();  ///< tangential (m)
    double limit = 0;  ///< coefficient times normal force: Pa on an object, N for a pair of layers

    /// Tangential stretch if the place is at `now`.
    [[nodiscard]] Eigen::Vector3d stretch_at(const Eigen::Vector3d& now) const {
      const Eigen::Vector3d moved = stretch + now - place;
      return moved - moved.dot(normal) * normal;
    }
    /// Secant stiffness at a stretch.
    [[nodiscard]] double stiffness_at(const Eigen::Vector3d& stretched, double stiffness) const {
      const double size = stiffness * stretched.norm();
      return stiffness * (size > limit ? limit / size : 1);
    }
    [[nodiscard]] double energy_at(const Eigen::Vector3d& stretched, double stiffness) const {
      const double size = stretched.norm(), most = limit / stiffness;
      return size <= most ? stiffness / 2 * size * size : limit * (size - most / 2);
    }
    /// Second derivative of the energy times a displacement: a sliding spring resists only
    /// perpendicular to its stretch.
    [[nodiscard]] Eigen::Vector3d product_at(const Eigen::Vector3d& stretched, double stiffness,
                                             const Eigen::Vector3d& displacement) const {
      constexpr double kSliding = 1 - 1e-6;  // relative to the limit
      Eigen::Vector3d along = displacement - displacement.dot(normal) * normal;
      if (stiffness * stretched.norm() >= kSliding * limit && !stretched.isZero(0))
        along -= along.dot(stretched) / stretched.squaredNorm() * stretched;
      return stiffness_at(stretched, stiffness) * along;
    }
    /// Rotates the stretch into the tangent plane and lets it yield at the limit.
    void settle(double stiffness) {
      stretch -= stretch.dot(normal) * normal;
      stretch *= stiffness_at(stretch, stiffness) / stiffness;
    }
  };
  /// Transfer radius, in distances of remembered places.
  static constexpr double kReach = 2;

  /// A place of the cloth on an object.
  struct OnObject {
    int site = 0, shape = 0;  ///< index of the place on its mesh, and of the object
    Eigen::Vector2d material_m;
    double reach_m = 0;  ///< radius within which another mesh takes it over
    Grip grip;
  };
  /// Two places of the cloth in contact with each other, given by nodes of the surface.
  struct OnLayer {
    bool edges = false;
    std::array<int, 4> node{};
    std::array<double, 4> weight{};
    Eigen::Vector2d first_m, second_m;  ///< material coordinates
    Grip grip;
  };
  std::vector<Eigen::Vector2d> mesh_m;  ///< points of the mesh
  double places_m = 0;                  ///< distance between places on objects
  int firmness = 0;                     ///< firmness of places on objects
  std::vector<bool> by_nodes;           ///< facets that touch flat faces only; by facet and shape
  std::vector<OnObject> objects;        ///< in order of site
  std::vector<OnLayer> layers;
};

}  // namespace drape::simulate
