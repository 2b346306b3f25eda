// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/solid_features.hpp"

#include <Eigen/Geometry>
#include <array>
#include <map>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Triangles = std::vector<std::array<int, 3>>;

constexpr double kFlat = 1e-4;   // rad; faces that meet at less than this are one face
constexpr int kCornerEdges = 3;  // convex edges that make a corner

struct Polyhedron {
  std::vector<Vector3d> corners;  ///< world
  Triangles triangles;            ///< counter-clockwise from outside
};

Polyhedron polyhedron_of(const Box& box) {
  Polyhedron solid;
  for (int k = 0; k < 8; ++k) {
    const Vector3d sign((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
    solid.corners.push_back(box.world_from_box * (0.5 * sign.cwiseProduct(box.size_m)));
  }
  const int faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : faces) {
    solid.triangles.push_back({f[0], f[1], f[2]});
    solid.triangles.push_back({f[0], f[2], f[3]});
  }
  return solid;
}

Polyhedron polyhedron_of(const PlacedMesh& mesh) {
  Polyhedron solid;
  for (const Vector3d& corner : mesh.mesh->corners())
    solid.corners.push_back(mesh.world_from_mesh * corner);
  solid.triangles = mesh.mesh->triangles();
  return solid;
}

class Extractor {
 public:
  Extractor(const Polyhedron& solid, SolidFeatures& features)
      : solid_(solid), features_(features), at_corner_(solid.corners.size()) {
    for (std::size_t t = 0; t < solid.triangles.size(); ++t) {
      const auto& [a, b, c] = solid.triangles[t];
      normal_.push_back((p(b) - p(a)).cross(p(c) - p(a)).normalized());
      for (int k = 0; k < 3; ++k) {
        beside_[{solid.triangles[t][k], solid.triangles[t][(k + 1) % 3]}] = static_cast<int>(t);
        at_corner_[solid.triangles[t][k]].out += normal_.back();
      }
    }
  }

  void run() {
    for (const auto& [edge, triangle] : beside_) {
      if (edge.first < edge.second) add_edge(edge.first, edge.second, triangle);
    }
    for (std::size_t k = 0; k < at_corner_.size(); ++k) {
      if (at_corner_[k].convex < kCornerEdges || !(at_corner_[k].out.norm() > 0)) continue;
      features_.corners.push_back(
          {solid_.corners[k], at_corner_[k].out.normalized(), at_corner_[k].along});
    }
  }

 private:
  struct AtCorner {
    Vector3d out = Vector3d::Zero();
    std::vector<Vector3d> along;
    int convex = 0;
  };

  [[nodiscard]] const Vector3d& p(int corner) const { return solid_.corners[corner]; }
  [[nodiscard]] int third(int triangle, int a, int b) const {
    const auto& t = solid_.triangles[triangle];
    return t[0] + t[1] + t[2] - a - b;
  }

  void add_edge(int a, int b, int triangle) {
    const auto twin = beside_.find({b, a});
    if (twin == beside_.end()) return;
    const Vector3d along = (p(b) - p(a)).normalized();
    at_corner_[a].along.push_back(along);
    at_corner_[b].along.push_back(-along);
    SolidEdge edge;
    edge.a = p(a);
    edge.b = p(b);
    const int faces[2] = {triangle, twin->second};
    for (int k = 0; k < 2; ++k) {
      const Vector3d into = p(third(faces[k], a, b)) - p(a);
      edge.face[k] = (into - into.dot(along) * along).normalized();
    }
    // Convex: the other face falls away below the plane of this one.
    if (edge.face[1].dot(normal_[triangle]) > -kFlat) return;
    edge.out = (normal_[triangle] + normal_[twin->second]).normalized();
    features_.edges.push_back(edge);
    ++at_corner_[a].convex;
    ++at_corner_[b].convex;
  }

  const Polyhedron& solid_;
  SolidFeatures& features_;
  std::vector<Vector3d> normal_;
  std::vector<AtCorner> at_corner_;
  std::map<std::pair<int, int>, int> beside_;  ///< directed edge to its triangle
};

}  // namespace

bool is_sharp(const Surroundings& surroundings, int shape) {
  const Box* const box = surroundings.box(shape);
  return surroundings.mesh(shape) != nullptr || (box != nullptr && box->edge_radius_m == 0);
}

SolidFeatures features_of(const Surroundings& surroundings) {
  SolidFeatures features;
  for (int shape = 0; shape < surroundings.count(); ++shape) {
    if (!is_sharp(surroundings, shape)) continue;
    const Box* const box = surroundings.box(shape);
    const Polyhedron solid =
        box != nullptr ? polyhedron_of(*box) : polyhedron_of(*surroundings.mesh(shape));
    Extractor(solid, features).run();
  }
  return features;
}

}  // namespace drape::simulate
