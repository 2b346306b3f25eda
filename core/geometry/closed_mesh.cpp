// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/closed_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/error.hpp"
#include "core/files/mesh_file.hpp"
#include "core/units.hpp"

namespace drape {
namespace {

using Eigen::Vector3d;

constexpr double kOnFeature = 1e-12;  // m; nearer to an edge or corner no direction can be computed

// Range of the longest edge: smaller objects do not shape a cloth, larger ones fit no bench.
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

ClosedMesh::ClosedMesh(std::vector<Vector3d> corners, std::vector<Triangle> triangles,
                       const std::filesystem::path& name)
    : corners_(std::move(corners)), triangles_(std::move(triangles)) {
  for (const Vector3d& corner : corners_) {
    if (!corner.allFinite()) throw bad_input("a corner is not finite", {.file = name.string()}, "");
  }
  std::erase_if(triangles_,
                [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  check_closed(name);
  std::vector<TriangleTree::Corners> in_space;
  for (const auto& [a, b, c] : triangles_)
    in_space.push_back({corners_[a], corners_[b], corners_[c]});
  tree_ = TriangleTree(in_space);
}

ClosedMesh ClosedMesh::read(const std::filesystem::path& file) {
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

void ClosedMesh::check_closed(const std::filesystem::path& name) {
  const Where where{.file = name.string()};
  const char* const to_do = "export a closed solid whose faces run counter-clockwise from outside";
  std::map<std::pair<int, int>, int> edges;  // triangle of each directed edge
  double volume = 0;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    for (int k = 0; k < 3; ++k) {
      const std::pair<int, int> edge(triangles_[t][k], triangles_[t][(k + 1) % 3]);
      if (!edges.emplace(edge, static_cast<int>(t)).second) {
        throw bad_input("two faces run along an edge in the same sense", where, to_do);
      }
    }
    volume += corners_[a].dot(corners_[b].cross(corners_[c])) / 6;
    const Vector3d cross = (corners_[b] - corners_[a]).cross(corners_[c] - corners_[a]);
    if (!(cross.norm() > 0)) throw bad_input("a face has no area", where, "remove it");
    face_normal_.push_back(cross.normalized());
  }
  if (triangles_.size() < 4) throw bad_input("the mesh has fewer than four faces", where, to_do);
  corner_normal_.assign(corners_.size(), Vector3d::Zero());
  edge_normal_.resize(triangles_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
      const int c = triangles_[t][(k + 2) % 3];
      const auto twin = edges.find({b, a});
      if (twin == edges.end()) throw bad_input("the mesh has an open edge", where, to_do);
      edge_normal_[t][k] = face_normal_[t] + face_normal_[twin->second];
      const Vector3d u = (corners_[b] - corners_[a]).normalized();
      const Vector3d v = (corners_[c] - corners_[a]).normalized();
      corner_normal_[a] += std::acos(std::clamp(u.dot(v), -1.0, 1.0)) * face_normal_[t];
    }
  }
  if (!(volume > 0)) throw bad_input("the mesh is inside out or encloses nothing", where, to_do);
}

ClosedMesh::Distance ClosedMesh::distance(const Vector3d& point) const {
  const TriangleTree::Nearest nearest = tree_.nearest(point);
  const Triangle& triangle = triangles_[nearest.triangle];
  const Vector3d& face = face_normal_[nearest.triangle];
  // Distance to the plane: near the surface the difference of both points has no direction.
  if (nearest.feature == 0)
    return {face.dot(point - corners_[triangle[0]]), face, nearest.triangle};
  const Vector3d& pseudo = nearest.feature >= 4
                               ? corner_normal_[triangle[nearest.feature - 4]]
                               : edge_normal_[nearest.triangle][nearest.feature - 1];
  const Vector3d away = point - nearest.point;
  const double size = std::sqrt(nearest.squared);
  if (size < kOnFeature) return {away.dot(pseudo.normalized()), pseudo.normalized()};
  const double sign = away.dot(pseudo) < 0 ? -1.0 : 1.0;
  return {sign * size, sign / size * away};
}

}  // namespace drape
