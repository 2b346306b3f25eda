// SPDX-License-Identifier: Apache-2.0
#include "simulate/objects/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/body.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kThinnest = 1e-4;  // m; of a body that is always found on a path
constexpr double kShortest = 1e-3;  // relative to the path, to the next place looked at
constexpr int kBisections = 40;     // halvings of the path into a body
constexpr double kRound_m = 2e-3;   // radius from which an edge is not sharp

template <class Body>
double gap_of(const Body& body, const Vector3d& p) {
  return distance_to(body, p);
}

double gap_of(const Table& table, const Vector3d& p) {
  return p.z() - table.z_m;
}

/// Point in the box frame.
Vector3d in_box(const Box& box, const Vector3d& p) {
  return box.world_from_box.rotation.transpose() * (p - box.world_from_box.translation_m);
}

Vector3d in_cylinder(const Cylinder& body, const Vector3d& p) {
  const WorldFromObject& frame = body.world_from_cylinder;
  return frame.rotation.transpose() * (p - frame.translation_m);
}

double gap_of(const PlacedMesh& body, const Vector3d& p) {
  const WorldFromObject& frame = body.world_from_mesh;
  return body.mesh->distance(frame.rotation.transpose() * (p - frame.translation_m)).gap_m;
}

Vector3d normal_of(const Plane& plane, const Vector3d&) {
  return plane.normal_in_world;
}

Vector3d normal_of(const Cylinder& body, const Vector3d& p) {
  const Vector3d q = in_cylinder(body, p);
  Eigen::Vector2d out = beyond(body, q).cwiseMax(0.0);
  if (out.isZero(0)) {
    const Eigen::Vector2d d = beyond(body, q);
    (d.x() > d.y() ? out.x() : out.y()) = 1;
  }
  const double across = q.head<2>().norm();
  const Eigen::Vector2d away =
      across > 0 ? Eigen::Vector2d(q.head<2>() / across) : Eigen::Vector2d::UnitX();
  const Vector3d local(out.x() * away.x(), out.x() * away.y(), std::copysign(out.y(), q.z()));
  return body.world_from_cylinder.rotation * local.normalized();
}

Vector3d normal_of(const PlacedMesh& body, const Vector3d& p) {
  const WorldFromObject& frame = body.world_from_mesh;
  return frame.rotation *
         body.mesh->distance(frame.rotation.transpose() * (p - frame.translation_m)).normal;
}

Vector3d normal_of(const Sphere& sphere, const Vector3d& p) {
  const Vector3d out = p - sphere.centre_in_world;
  const double distance = out.norm();
  return distance > 0 ? Vector3d(out / distance) : Vector3d::UnitZ();
}

Vector3d normal_of(const Table&, const Vector3d&) {
  return Vector3d::UnitZ();
}

Vector3d normal_of(const Box& box, const Vector3d& p) {
  const Vector3d q = in_box(box, p);
  const Vector3d d = beyond(box, q);
  Vector3d out = d.cwiseMax(0.0);
  if (out.isZero(0)) {
    Eigen::Index axis = 0;
    d.maxCoeff(&axis);
    out[axis] = 1;
  }
  for (int i = 0; i < 3; ++i) out[i] = std::copysign(out[i], q[i]);
  return box.world_from_box.rotation * out.normalized();
}

double top_of(const Sphere& sphere) {
  return sphere.centre_in_world.z() + sphere.radius_m;
}

double top_of(const Box& box) {
  const Vector3d reach = 0.5 * box.size_m - Vector3d::Constant(box.edge_radius_m);
  return box.world_from_box.translation_m.z() + box.edge_radius_m +
         box.world_from_box.rotation.row(2).cwiseAbs().dot(reach);
}

double top_of(const Cylinder& body) {
  const Vector3d up = body.world_from_cylinder.rotation.row(2);
  return body.world_from_cylinder.translation_m.z() + body.edge_radius_m +
         (0.5 * body.height_m - body.edge_radius_m) * std::abs(up.z()) +
         (body.radius_m - body.edge_radius_m) * std::hypot(up.x(), up.y());
}

double top_of(const Plane&) {
  return -std::numeric_limits<double>::infinity();
}

double top_of(const PlacedMesh& body) {
  double top = -std::numeric_limits<double>::infinity();
  for (const Vector3d& corner : body.mesh->corners()) {
    top = std::max(top, (body.world_from_mesh * corner).z());
  }
  return top;
}

double top_of(const Table& table) {
  return table.z_m;
}

}  // namespace

Surroundings::Surroundings(const Scene& scene) {
  for (const Obstacle& obstacle : scene.obstacles) {
    std::visit([this](const auto& shape) { add(shape); }, obstacle);
  }
  add(Table{scene.table_z_m});
}

void Surroundings::add(const MeshObject& object) {
  add(PlacedMesh{std::make_shared<const ClosedMesh>(ClosedMesh::read(object.file)),
                 object.world_from_mesh});
}

bool Surroundings::is_sharp(int shape) const {
  const Box* const box = this->box(shape);
  const Cylinder* const cylinder = this->cylinder(shape);
  return mesh(shape) != nullptr || (box != nullptr && box->edge_radius_m < kRound_m) ||
         (cylinder != nullptr && cylinder->edge_radius_m < kRound_m);
}

double Surroundings::gap_m(int shape, const Vector3d& p) const {
  return std::visit([&p](const auto& s) { return gap_of(s, p); }, shapes_[shape]);
}

Vector3d Surroundings::normal(int shape, const Vector3d& p) const {
  return std::visit([&p](const auto& s) { return normal_of(s, p); }, shapes_[shape]);
}

std::optional<double> Surroundings::first_entry(int shape, const Vector3d& from, const Vector3d& to,
                                                double deep_m) const {
  const Vector3d displacement = to - from;
  const double length = displacement.norm();
  const auto gap_at = [&](double fraction) { return gap_m(shape, from + fraction * displacement); };
  double outside = 0, inside = 0;
  for (double gap = gap_at(0); !(gap < -deep_m); gap = gap_at(inside)) {
    if (!(inside < 1)) return std::nullopt;
    outside = inside;
    const double step = std::max({gap, kThinnest, kShortest * length});
    inside = std::min(1.0, outside + step / length);
  }
  for (int k = 0; k < kBisections && inside > outside; ++k) {
    const double middle = 0.5 * (outside + inside);
    (gap_at(middle) < -deep_m ? inside : outside) = middle;
  }
  return inside;
}

double Surroundings::top_z_m() const {
  double top = -std::numeric_limits<double>::infinity();
  double table = top;
  for (int i = 0; i < count(); ++i) {
    const double z = std::visit([](const auto& s) { return top_of(s); }, shapes_[i]);
    (is_table(i) ? table : top) = std::max(is_table(i) ? table : top, z);
  }
  return std::isfinite(top) ? top : table;
}

}  // namespace drape::simulate
