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
  /// Spring of friction, as it was settled last.
  struct Grip {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d stretch = Eigen::Vector3d::Zero();  ///< tangential (m)
    double limit = 0;  ///< coefficient times push: Pa on an object, N of a pair of layers
  };
  /// Place of the cloth on an object.
  struct OnObject {
    int site = 0, shape = 0;  ///< number of the place on its mesh; of the object
    Eigen::Vector2d material_m;
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
  std::vector<OnObject> objects;        ///< by site
  std::vector<OnLayer> layers;
};

}  // namespace drape::simulate
