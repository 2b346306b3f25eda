// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "simulate/mesh/material_mesh.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;

long double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (static_cast<long double>(b.x()) - a.x()) * (static_cast<long double>(c.y()) - a.y()) -
         (static_cast<long double>(b.y()) - a.y()) * (static_cast<long double>(c.x()) - a.x());
}

/// Above 0: `d` lies inside the circle through a, b, c (counter-clockwise).
long double in_circle(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto row = [&](const Vector2d& p) {
    const long double x = static_cast<long double>(p.x()) - d.x();
    const long double y = static_cast<long double>(p.y()) - d.y();
    return std::array<long double, 3>{x, y, x * x + y * y};
  };
  const auto u = row(a), v = row(b), w = row(c);
  return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
         u[2] * (v[0] * w[1] - v[1] * w[0]);
}

/// Triangles with their neighbours; neighbour k lies across the edge opposite corner k.
struct Face {
  std::array<int, 3> corner;
  std::array<int, 3> beside;
  bool alive = true;
};

class Triangulation {
 public:
  explicit Triangulation(std::vector<Vector2d> points) : points_(std::move(points)) {
    const std::size_t n = points_.size();
    Vector2d low = points_.front(), high = low;
    for (const Vector2d& p : points_) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const Vector2d middle = (low + high) / 2;
    const double size = 100 * ((high - low).maxCoeff() + 1e-9);
    points_.push_back(middle + size * Vector2d(-1, -1));
    points_.push_back(middle + size * Vector2d(1, -1));
    points_.push_back(middle + size * Vector2d(0, 1.5));
    const int first = static_cast<int>(n);
    faces_.push_back({{first, first + 1, first + 2}, {-1, -1, -1}});
    for (int i = 0; i < first; ++i) insert(i);
  }

  [[nodiscard]] std::vector<std::array<int, 3>> triangles() const {
    const int n = static_cast<int>(points_.size()) - 3;
    std::vector<std::array<int, 3>> result;
    for (const Face& face : faces_) {
      if (face.alive && std::all_of(face.corner.begin(), face.corner.end(),
                                    [n](int corner) { return corner < n; }))
        result.push_back(face.corner);
    }
    return result;
  }

 private:
  [[nodiscard]] const Vector2d& at(int corner) const { return points_[corner]; }

  /// Walks from the last face to the one that holds the point.
  [[nodiscard]] int holder(const Vector2d& p) const {
    int face = last_;
    for (std::size_t steps = 0; steps < faces_.size() + 10; ++steps) {
      int next = -1;
      for (int k = 0; k < 3 && next < 0; ++k) {
        const auto& corner = faces_[face].corner;
        if (turn(at(corner[(k + 1) % 3]), at(corner[(k + 2) % 3]), p) < 0)
          next = faces_[face].beside[k];
      }
      if (next < 0) return face;
      face = next;
    }
    return face;
  }

  void insert(int point) {
    const Vector2d& p = at(point);
    std::vector<int> cavity = {holder(p)};
    faces_[cavity[0]].alive = false;
    struct Rim {
      int from, to, outside;
    };
    std::vector<Rim> rim;
    for (std::size_t i = 0; i < cavity.size(); ++i) {
      const Face face = faces_[cavity[i]];
      for (int k = 0; k < 3; ++k) {
        const int other = face.beside[k];
        if (other >= 0 && !faces_[other].alive) continue;
        const auto inside = [&] {
          const auto& c = faces_[other].corner;
          return in_circle(at(c[0]), at(c[1]), at(c[2]), p) > 0;
        };
        if (other >= 0 && inside()) {
          faces_[other].alive = false;
          cavity.push_back(other);
        } else {
          rim.push_back({face.corner[(k + 1) % 3], face.corner[(k + 2) % 3], other});
        }
      }
    }
    std::map<int, int> starting;  // face whose edge towards `point` begins at this corner
    const int first = static_cast<int>(faces_.size());
    for (const Rim& edge : rim) {
      starting[edge.from] = static_cast<int>(faces_.size());
      faces_.push_back({{point, edge.from, edge.to}, {edge.outside, -1, -1}});
      if (edge.outside < 0) continue;
      Face& outside = faces_[edge.outside];
      for (int k = 0; k < 3; ++k)
        if (outside.corner[(k + 1) % 3] == edge.to && outside.corner[(k + 2) % 3] == edge.from)
          outside.beside[k] = starting[edge.from];
    }
    for (int face = first; face < static_cast<int>(faces_.size()); ++face) {
      const int next = starting.at(faces_[face].corner[2]);
      faces_[face].beside[1] = next;
      faces_[next].beside[2] = face;
    }
    last_ = first;
  }

  std::vector<Vector2d> points_;
  std::vector<Face> faces_;
  int last_ = 0;
};

}  // namespace

std::vector<std::array<int, 3>> delaunay(const std::vector<Vector2d>& points) {
  if (points.size() < 3) return {};
  return Triangulation(points).triangles();
}

}  // namespace drape::simulate
