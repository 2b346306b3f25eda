// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace drape::simulate {

/// Memory of contact: springs of friction, by material place. The mesh that
/// it is of goes on from it exactly; another mesh of the same cloth takes over the stretch of the
/// nearest places' springs, which stands for a force per area.
struct ContactMemory {
  /// Elastic and plastic spring of friction between a place of the cloth and what it touches, as
  /// it was settled last. Per area (N/m^3, Pa) or not (N/m, N).
  struct Grip {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d stretch = Eigen::Vector3d::Zero();  ///< tangential (m)
    double limit = 0;  ///< coefficient times push: Pa on an object, N of a pair of layers

    /// Tangential stretch with the place elsewhere.
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
    /// Second derivative of the energy times a displacement: a sliding spring resists across its
    /// stretch alone.
    [[nodiscard]] Eigen::Vector3d product_at(const Eigen::Vector3d& stretched, double stiffness,
                                             const Eigen::Vector3d& displacement) const {
      constexpr double kSliding = 1 - 1e-6;  // relative to the limit
      Eigen::Vector3d along = displacement - displacement.dot(normal) * normal;
      if (stiffness * stretched.norm() >= kSliding * limit && !stretched.isZero(0))
        along -= along.dot(stretched) / stretched.squaredNorm() * stretched;
      return stiffness_at(stretched, stiffness) * along;
    }
    /// Turns the stretch into the tangent plane and yields at the limit.
    void settle(double stiffness) {
      stretch -= stretch.dot(normal) * normal;
      stretch *= stiffness_at(stretch, stiffness) / stiffness;
    }
  };
  /// Distances of remembered places within which others take over from them.
  static constexpr double kReach = 2;

  /// Place of the cloth on an object.
  struct OnObject {
    int site = 0, shape = 0;  ///< number of the place on its mesh; of the object
    Eigen::Vector2d material_m;
    double reach_m = 0;  ///< how far from it another mesh takes over
    Grip grip;
  };
  /// Two places of the cloth that hold each other, by nodes of the surface.
  struct OnLayer {
    bool edges = false;
    std::array<int, 4> node{};
    std::array<double, 4> weight{};
    Eigen::Vector2d first_m, second_m;  ///< material places
    Grip grip;
  };
  std::vector<Eigen::Vector2d> mesh_m;  ///< points of the mesh
  double places_m = 0;                  ///< distance of places on objects
  int firmness = 0;                     ///< of places on objects
  std::vector<bool> by_nodes;           ///< facets that touch flat faces alone; by facet and shape
  std::vector<OnObject> objects;        ///< by site
  std::vector<OnLayer> layers;
};

}  // namespace drape::simulate
