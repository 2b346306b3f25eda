// SPDX-License-Identifier: Apache-2.0
#include "simulate/objects/triangle_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/error.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr int kLeaf = 4;
constexpr double kOnFeature = 1e-12;  // m; nearer to an edge or corner no direction is left

/// Nearest point of a triangle and which feature it lies on: 0 face, 1-3 edge, 4-6 corner.
struct OnTriangle {
  Vector3d point;
  int feature = 0;
};

OnTriangle nearest_on(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, bc = c - b;
  const Vector3d ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {a, 4};
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {b, 5};
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {c, 6};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {a + d1 / (d1 - d3) * ab, 1};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return {b + (d4 - d3) / (d4 - d3 + d5 - d6) * bc, 2};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {a + d2 / (d2 - d6) * ac, 3};
  const double all = va + vb + vc;
  return {a + (vb * ab + vc * ac) / all, 0};
}

}  // namespace

struct TriangleMesh::Nearest {
  double squared = std::numeric_limits<double>::infinity();
  Vector3d point = Vector3d::Zero();
  int triangle = 0, feature = 0;
};

TriangleMesh::TriangleMesh(std::vector<Vector3d> corners, std::vector<Triangle> triangles,
                           const std::filesystem::path& name)
    : corners_(std::move(corners)), triangles_(std::move(triangles)) {
  for (const Vector3d& corner : corners_) {
    if (!corner.allFinite()) throw bad_input("a corner is not finite", {.file = name.string()}, "");
  }
  std::erase_if(triangles_,
                [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  check_closed(name);
  order_.resize(triangles_.size());
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.emplace_back();
  build(0, 0, static_cast<int>(order_.size()));
}

void TriangleMesh::check_closed(const std::filesystem::path& name) {
  const Where where{.file = name.string()};
  const char* const to_do = "export a closed solid whose faces run counter-clockwise from outside";
  std::map<std::pair<int, int>, int> edges;  // directed edge to its triangle
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

void TriangleMesh::build(int node, int first, int count) {
  Eigen::AlignedBox3d box;
  Eigen::AlignedBox3d centres;
  const auto centre = [this](int t) {
    const auto& [a, b, c] = triangles_[t];
    return Vector3d((corners_[a] + corners_[b] + corners_[c]) / 3);
  };
  for (int k = first; k < first + count; ++k) {
    for (const int corner : triangles_[order_[k]]) box.extend(corners_[corner]);
    centres.extend(centre(order_[k]));
  }
  nodes_[node].box = box;
  if (count <= kLeaf) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const int half = count / 2;
  std::nth_element(order_.begin() + first, order_.begin() + first + half,
                   order_.begin() + first + count, [&](int s, int t) {
                     const double a = centre(s)[axis], b = centre(t)[axis];
                     return a < b || (a == b && s < t);
                   });
  const int left = static_cast<int>(nodes_.size());
  nodes_[node].left = left;
  nodes_.emplace_back();
  nodes_.emplace_back();
  build(left, first, half);
  build(left + 1, first + half, count - half);
}

void TriangleMesh::search(int node, const Vector3d& point, Nearest& nearest) const {
  const Node& here = nodes_[node];
  if (here.box.squaredExteriorDistance(point) >= nearest.squared) return;
  if (here.count == 0) {
    const bool swapped = nodes_[here.left + 1].box.squaredExteriorDistance(point) <
                         nodes_[here.left].box.squaredExteriorDistance(point);
    search(here.left + (swapped ? 1 : 0), point, nearest);
    search(here.left + (swapped ? 0 : 1), point, nearest);
    return;
  }
  for (int k = here.first; k < here.first + here.count; ++k) {
    const auto& [a, b, c] = triangles_[order_[k]];
    const OnTriangle on = nearest_on(point, corners_[a], corners_[b], corners_[c]);
    const double squared = (on.point - point).squaredNorm();
    if (squared < nearest.squared) nearest = {squared, on.point, order_[k], on.feature};
  }
}

TriangleMesh::Distance TriangleMesh::distance(const Vector3d& point) const {
  Nearest nearest;
  search(0, point, nearest);
  const Triangle& triangle = triangles_[nearest.triangle];
  const Vector3d& face = face_normal_[nearest.triangle];
  // Linear in the point: near the surface the difference of two places has no direction.
  if (nearest.feature == 0) return {face.dot(point - corners_[triangle[0]]), face};
  const Vector3d& pseudo = nearest.feature >= 4
                               ? corner_normal_[triangle[nearest.feature - 4]]
                               : edge_normal_[nearest.triangle][nearest.feature - 1];
  const Vector3d away = point - nearest.point;
  const double size = std::sqrt(nearest.squared);
  if (size < kOnFeature) return {away.dot(pseudo.normalized()), pseudo.normalized()};
  const double sign = away.dot(pseudo) < 0 ? -1.0 : 1.0;
  return {sign * size, sign / size * away};
}

}  // namespace drape::simulate
