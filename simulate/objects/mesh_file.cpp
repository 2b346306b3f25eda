// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

#include "core/error.hpp"
#include "core/files/mesh_file.hpp"
#include "core/units.hpp"
#include "simulate/objects/triangle_mesh.hpp"

namespace drape::simulate {

using Eigen::Vector3d;

namespace {

// Of the longest side: cloth does not see less, and no bench carries more.
constexpr double kLeast_mm = 5, kMost_mm = 3000;

void check_unit(const MeshFile& mesh, const std::filesystem::path& file) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& point : mesh.points) box.extend(point);
  const Vector3d sides = box.sizes();
  if (sides.maxCoeff() >= kLeast_mm && sides.maxCoeff() <= kMost_mm) return;
  std::string likely = "its numbers are mm: check its size";
  for (const auto& [unit, unit_mm] :
       {std::pair{"m, as of Blender", 1000.0}, {"inches", 25.4}, {"cm", 10.0}, {"um", 0.001}}) {
    const double side_mm = sides.maxCoeff() * unit_mm;
    if (side_mm < 10 * kLeast_mm || side_mm > kMost_mm) continue;
    likely = fmt::format("its numbers are mm: are these {}? Then export it {:g} times as large",
                         unit, unit_mm);
    break;
  }
  throw bad_input(fmt::format("the mesh is {:.3g} x {:.3g} x {:.3g} mm; what cloth drapes over "
                              "measures {:g} mm to {:g} m",
                              sides.x(), sides.y(), sides.z(), kLeast_mm, kMost_mm / 1000),
                  {.file = file.string()}, likely);
}

}  // namespace

TriangleMesh TriangleMesh::read(const std::filesystem::path& file) {
  const MeshFile mesh = read_mesh_file(file);
  check_unit(mesh, file);
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
