// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/mesh_cloth.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "simulate/mesh/membrane.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Relative to the jump's energy over the adjacent triangles; see MeshCloth.
constexpr double kSeam = 2;

}  // namespace

MeshCloth::MeshCloth(MaterialMesh mesh, ClothLaws laws, double in_triangles)
    : mesh_(std::move(mesh)),
      laws_(std::move(laws)),
      in_triangles_(in_triangles),
      area_(mesh_.points_m.size(), 0.0) {
  for (int t = 0; t < static_cast<int>(mesh_.triangles.size()); ++t) {
    Triangle triangle;
    triangle.corner = mesh_.triangles[t];
    triangle.area = mesh_.area_m2(t);
    std::array<Vector2d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = mesh_.points_m[triangle.corner[k]];
    for (int k = 0; k < 3; ++k) {
      const Vector2d side = p[(k + 2) % 3] - p[(k + 1) % 3];
      triangle.d_u[k] = -side.y() / (2 * triangle.area);
      triangle.d_v[k] = side.x() / (2 * triangle.area);
      triangle.unknown[k] = triangle.corner[k];
      triangle.unknown[3 + k] = points() + mesh_.edges_of[t][k];
      area_[triangle.corner[k]] += triangle.area / 3;
    }
    // q = c0 + c1 u + c2 v + c3 u^2/2 + c4 u v + c5 v^2/2 about the centre, scaled by the size.
    const Vector2d middle = (p[0] + p[1] + p[2]) / 3;
    const double size = std::sqrt(triangle.area);
    Eigen::Matrix<double, 6, 6> rows;
    for (int k = 0; k < 3; ++k) {
      const Vector2d at = (p[k] - middle) / size;
      rows.row(k) << 1, at.x(), at.y(), at.x() * at.x() / 2, at.x() * at.y(), at.y() * at.y() / 2;
      const int edge = mesh_.edges_of[t][k];
      const Vector2d m = (middle_of(edge) - middle) / size, n = normal_of(edge);
      rows.row(3 + k) << 0, n.x(), n.y(), n.x() * m.x(), n.x() * m.y() + n.y() * m.x(),
          n.y() * m.y();
    }
    const Eigen::Matrix<double, 6, 6> inverse = rows.fullPivLu().inverse();
    for (int k = 0; k < 6; ++k) {
      // The derivative of a side is per metre: `size` of it is one unit.
      const double scale = (k < 3 ? 1 : size) / (size * size);
      triangle.d_uu[k] = scale * inverse(3, k);
      triangle.d_uv[k] = scale * inverse(4, k);
      triangle.d_vv[k] = scale * inverse(5, k);
    }
    triangles_.push_back(triangle);
  }
  for (int e = 0; e < static_cast<int>(mesh_.edges.size()); ++e)
    if (mesh_.edges[e].left >= 0 && mesh_.edges[e].right >= 0) seams_.push_back(seam_of(e));
  for (const double area : area_) mass_.push_back(laws_.density_kg_per_m2 * area);
  if (!laws_.friction) return;
  for (int d = 0; d < 2; ++d)
    memory_.bending[d].assign(laws_.friction->bending[d].elements.size() * triangles_.size(), 0.0);
  memory_.shear.assign(laws_.friction->shear.elements.size() * area_.size(), 0.0);
}

std::vector<Vector3d> MeshCloth::metrics(const State& state) const {
  std::vector<Vector3d> metric(area_.size(), Vector3d::Zero());
  for (const Triangle& t : triangles_) {
    const Vector3d part =
        t.area / 3 *
        metric_of(combined(t.d_u, t.unknown, state), combined(t.d_v, t.unknown, state));
    for (const int corner : t.corner) metric[corner] += part;
  }
  for (std::size_t i = 0; i < metric.size(); ++i) metric[i] /= area_[i];
  return metric;
}

MeshCloth::Seam MeshCloth::seam_of(int edge) const {
  const Vector2d n = normal_of(edge), along(n.y(), -n.x());
  const double uu = along.x() * along.x(), vv = along.y() * along.y();
  const double uv = along.x() * along.y();
  Seam seam;
  double area = 0;
  for (const bool right : {false, true}) {
    const Triangle& t = triangles_[right ? mesh_.edges[edge].right : mesh_.edges[edge].left];
    for (int k = 0; k < 6; ++k) {
      const int at = (right ? 6 : 0) + k;
      seam.unknown[at] = t.unknown[k];
      seam.weight[at] = (right ? -1 : 1) * (uu * t.d_uu[k] + 2 * uv * t.d_uv[k] + vv * t.d_vv[k]);
    }
    area += t.area / 3;
  }
  seam.stiffness = kSeam * area *
                   (laws_.bending[0].slope * uu * uu + laws_.bending[1].slope * vv * vv +
                    laws_.twist_n_m * uv * uv);
  return seam;
}

Vector2d MeshCloth::middle_of(int edge) const {
  return (mesh_.points_m[mesh_.edges[edge].from] + mesh_.points_m[mesh_.edges[edge].to]) / 2;
}

Vector2d MeshCloth::normal_of(int edge) const {
  const Vector2d along =
      (mesh_.points_m[mesh_.edges[edge].to] - mesh_.points_m[mesh_.edges[edge].from]).normalized();
  return {-along.y(), along.x()};
}

}  // namespace drape::simulate
