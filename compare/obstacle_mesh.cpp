// SPDX-License-Identifier: Apache-2.0
#include "compare/obstacle_mesh.hpp"

#include <cmath>
#include <numbers>

namespace drape::compare {
namespace {

using Quad = std::array<Eigen::Vector3d, 4>;

void add_sphere(const Sphere& sphere, std::vector<Quad>& quads) {
  constexpr int kAround = 24, kUp = 12;
  const auto at = [&](int around, int up) -> Eigen::Vector3d {
    const double east = 2 * std::numbers::pi * around / kAround;
    const double north = std::numbers::pi * up / kUp - std::numbers::pi / 2;
    return sphere.centre_in_world +
           sphere.radius_m * Eigen::Vector3d(std::cos(north) * std::cos(east),
                                             std::cos(north) * std::sin(east), std::sin(north));
  };
  for (int up = 0; up < kUp; ++up)
    for (int around = 0; around < kAround; ++around)
      quads.push_back(
          {at(around, up), at(around + 1, up), at(around + 1, up + 1), at(around, up + 1)});
}

void add_box(const Box& box, std::vector<Quad>& quads) {
  constexpr int kPieces = 4;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {-0.5, 0.5}) {
      const auto at = [&](int i, int j) -> Eigen::Vector3d {
        Eigen::Vector3d part;
        part[axis] = side;
        part[u] = (static_cast<double>(i) / kPieces - 0.5) * (side < 0 ? -1 : 1);
        part[v] = static_cast<double>(j) / kPieces - 0.5;
        return box.world_from_box * part.cwiseProduct(box.size_m).eval();
      };
      for (int i = 0; i < kPieces; ++i)
        for (int j = 0; j < kPieces; ++j)
          quads.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
}

}  // namespace

std::vector<Quad> obstacle_quads(const Scene& scene) {
  std::vector<Quad> quads;
  for (const Obstacle& obstacle : scene.obstacles) {
    if (const auto* sphere = std::get_if<Sphere>(&obstacle)) {
      add_sphere(*sphere, quads);
    } else {
      add_box(std::get<Box>(obstacle), quads);
    }
  }
  return quads;
}

}  // namespace drape::compare
