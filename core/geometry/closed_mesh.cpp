// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/closed_mesh.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "core/drape_mesh.hpp"
#include "core/error.hpp"
#include "core/units.hpp"

namespace drape {

using Eigen::Vector3d;

namespace {

constexpr int kLeaf = 4;
constexpr int kMostWaiting = 64;  // stack size: one node per level, each halves the triangles

}  // namespace

OnTriangle nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                               const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, 4};
  const Vector3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {b, 5};
  const Vector3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {c, 6};
  // A degenerate triangle has edges of zero length; either end represents such an edge.
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {d1 > d3 ? a + d1 / (d1 - d3) * ab : a, 1};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double along = d4 - d3 + d5 - d6;
    return {along > 0 ? b + (d4 - d3) / along * (c - b) : b, 2};
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {d2 > d6 ? a + d2 / (d2 - d6) * ac : a, 3};
  return {a + (vb * ab + vc * ac) / (va + vb + vc), 0};
}

TriangleTree::TriangleTree(const std::vector<Corners>& triangles) : order_(triangles.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.emplace_back();
  build(0, 0, static_cast<int>(order_.size()), triangles);
  triangles_.reserve(order_.size());
  for (const int t : order_) triangles_.push_back(triangles[t]);
}

// The recursion depth is the logarithm of the number of triangles.
void TriangleTree::build(int node, int first, int count,  // NOLINT(misc-no-recursion)
                         const std::vector<Corners>& triangles) {
  const auto middle = [&](int t) -> Vector3d {
    return (triangles[t][0] + triangles[t][1] + triangles[t][2]) / 3;
  };
  Eigen::AlignedBox3d box, middles;
  for (int k = first; k < first + count; ++k) {
    for (const Vector3d& corner : triangles[order_[k]]) box.extend(corner);
    middles.extend(middle(order_[k]));
  }
  nodes_[node].box = box;
  if (count <= kLeaf) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const int half = count / 2;
  std::nth_element(order_.begin() + first, order_.begin() + first + half,
                   order_.begin() + first + count, [&](int s, int t) {
                     const double a = middle(s)[axis], b = middle(t)[axis];
                     return a < b || (a == b && s < t);
                   });
  const int left = static_cast<int>(nodes_.size());
  nodes_[node].left = left;
  nodes_.resize(nodes_.size() + 2);
  build(left, first, half, triangles);
  build(left + 1, first + half, count - half, triangles);
}

TriangleTree::Nearest TriangleTree::nearest(const Vector3d& point) const {
  Nearest best;
  std::array<std::pair<double, int>, kMostWaiting> waiting;  // squared distance to a box, its node
  waiting[0] = {0, 0};
  for (int count = 1; count > 0;) {
    const auto [squared, index] = waiting[--count];
    if (squared >= best.squared) continue;
    const Node& node = nodes_[index];
    if (node.count == 0) {
      std::pair<double, int> near(nodes_[node.left].box.squaredExteriorDistance(point), node.left);
      std::pair<double, int> far(nodes_[node.left + 1].box.squaredExteriorDistance(point),
                                 node.left + 1);
      if (far.first < near.first) std::swap(near, far);
      waiting[count++] = far;
      waiting[count++] = near;
      continue;
    }
    for (int k = node.first; k < node.first + node.count; ++k) {
      const auto& [a, b, c] = triangles_[k];
      const OnTriangle on = nearest_on_triangle(point, a, b, c);
      const double to_it = (on.point - point).squaredNorm();
      if (to_it < best.squared) best = {to_it, on.point, order_[k], on.feature};
    }
  }
  return best;
}

namespace {

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
