// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "core/files/mesh_file.hpp"
#include "core/units.hpp"
#include "simulate/objects/triangle_mesh.hpp"

namespace drape::simulate {

using Eigen::Vector3d;

TriangleMesh TriangleMesh::read(const std::filesystem::path& file) {
  const MeshFile mesh = read_mesh_file(file);
  const auto earlier = [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::map<Vector3d, int, decltype(earlier)> known(earlier);
  std::vector<Vector3d> corners;
  std::vector<int> joined;
  for (const Vector3d& point : mesh.points) {
    const Vector3d corner = point * units::mm;
    const auto [at, fresh] = known.emplace(corner, static_cast<int>(corners.size()));
    if (fresh) corners.push_back(corner);
    joined.push_back(at->second);
  }
  std::vector<Triangle> triangles;
  for (const auto& [a, b, c] : mesh.triangles)
    triangles.push_back({joined[a.point], joined[b.point], joined[c.point]});
  return {std::move(corners), std::move(triangles), file};
}

}  // namespace drape::simulate
