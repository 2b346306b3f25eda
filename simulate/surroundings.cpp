// SPDX-License-Identifier: Apache-2.0
#include "simulate/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace drape::sim {
namespace {

using Eigen::Vector3d;

double gap_of(const Sphere& sphere, const Vector3d& p) {
  return (p - sphere.centre_in_world).norm() - sphere.radius_m;
}

double gap_of(const Table& table, const Vector3d& p) {
  return p.z() - table.z_m;
}

/// Point in the box frame.
Vector3d in_box(const Box& box, const Vector3d& p) {
  return box.world_from_box.rotation.transpose() * (p - box.world_from_box.translation_m);
}

/// Beyond the box shrunk by its edge radius, per axis.
Vector3d beyond(const Box& box, const Vector3d& q) {
  return q.cwiseAbs() - 0.5 * box.size_m + Vector3d::Constant(box.edge_radius_m);
}

double gap_of(const Box& box, const Vector3d& p) {
  const Vector3d d = beyond(box, in_box(box, p));
  return d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff()) - box.edge_radius_m;
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

double Surroundings::gap_m(int shape, const Vector3d& p) const {
  return std::visit([&p](const auto& s) { return gap_of(s, p); }, shapes_[shape]);
}

Vector3d Surroundings::normal(int shape, const Vector3d& p) const {
  return std::visit([&p](const auto& s) { return normal_of(s, p); }, shapes_[shape]);
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

}  // namespace drape::sim
