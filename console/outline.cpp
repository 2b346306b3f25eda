// SPDX-License-Identifier: Apache-2.0
// Outlines of a drape's objects in the cameras, at the positions measured with tag plates or stated
// in the scene.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "console/bench.hpp"

namespace drape::console {
namespace {

using Eigen::Vector3d;
using Line = std::vector<Vector3d>;  ///< points in the world
constexpr int kAlong = 48;  ///< points on a circle; a lens bends edges, which get a quarter of it

Line circle(const Vector3d& centre, const Vector3d& a, const Vector3d& b) {
  Line line;
  for (int k = 0; k <= kAlong; ++k) {
    const double angle = 2 * std::numbers::pi * k / kAlong;
    line.push_back(centre + std::cos(angle) * a + std::sin(angle) * b);
  }
  return line;
}

Line edge(const Vector3d& from, const Vector3d& to) {
  Line line;
  for (int k = 0; k <= kAlong / 4; ++k) line.push_back(from + (to - from) * (4.0 * k / kAlong));
  return line;
}

struct LinesFrom {
  Vector3d eye;

  /// The circle in which rays from the eye touch the sphere.
  std::vector<Line> operator()(const Sphere& s) const {
    const Vector3d away = eye - s.centre_in_world;
    const double part = s.radius_m / away.norm();
    if (!(part < 1)) return {};
    const Vector3d a = away.unitOrthogonal(), b = away.normalized().cross(a);
    const double radius = s.radius_m * std::sqrt(1 - part * part);
    return {circle(s.centre_in_world + part * part * away, radius * a, radius * b)};
  }
  std::vector<Line> operator()(const Box& box) const {
    std::vector<Line> lines;
    const auto corner = [&](int k) {
      const Vector3d side(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
      return box.world_from_box * Vector3d(side.cwiseProduct(box.size_m));
    };
    for (int k = 0; k < 8; ++k)
      for (const int axis : {1, 2, 4})
        if ((k & axis) == 0) lines.push_back(edge(corner(k), corner(k | axis)));
    return lines;
  }
  std::vector<Line> operator()(const Cylinder& c) const {
    std::vector<Line> lines;
    const Eigen::Matrix3d turn = c.radius_m * c.world_from_cylinder.rotation;
    for (const double end : {-0.5, 0.5})
      lines.push_back(circle(c.world_from_cylinder * Vector3d(0, 0, end * c.height_m), turn.col(0),
                             turn.col(1)));
    return lines;
  }
  std::vector<Line> operator()(const Plane&) const { return {}; }
  std::vector<Line> operator()(const MeshObject&) const { return {}; }
};

}  // namespace

Json outlines(const Files& files, const Drape& drape) {
  Json json = {{"measured", false}, {"cameras", Json::object()}};
  const auto now = files.calibration();
  if (!now) return json;
  const Scene scene = files.measured_scene(drape);
  json["measured"] = scene.file != drape.scene.file;
  for (const CalibratedCamera& one : now->cameras) {
    const Camera& camera = one.camera;
    Json& lines = json["cameras"][camera.name] = Json::array();
    for (const Obstacle& object : scene.obstacles)
      for (const Line& line : std::visit(LinesFrom{centre_in_world(camera)}, object)) {
        Json points = Json::array();
        for (const Vector3d& point : line)
          if (const auto image = project(camera.model, camera.cam_from_world * point))
            points.push_back(
                {std::round(10 * image->px.x()) / 10, std::round(10 * image->px.y()) / 10});
        if (points.size() > 1) lines.push_back(std::move(points));
      }
  }
  return json;
}

}  // namespace drape::console
