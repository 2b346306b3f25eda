// SPDX-License-Identifier: Apache-2.0
#include "simulate/objects/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/body.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kThinnest = 1e-4;  // m; thickness of a body that is always found on a path
constexpr double kShortest = 1e-3;  // least advance to the next point, relative to the path
constexpr int kBisections = 40;     // bisections of the path into a body
constexpr double kSharp_m = 2e-6;   // smallest radius with a curvature

template <class Body>
double gap_of(const Body& body, const Vector3d& p) {
  return distance_to(body, p);
}

double gap_of(const Table& table, const Vector3d& p) {
  return p.z() - table.z_m;
}

/// Coordinates of a point in an object's frame.
Vector3d in_frame(const WorldFromObject& frame, const Vector3d& p) {
  return frame.rotation.transpose() * (p - frame.translation_m);
}

double gap_of(const PlacedMesh& body, const Vector3d& p) {
  return body.mesh->distance(in_frame(body.world_from_mesh, p)).gap_m;
}

using Nearest = Surroundings::Nearest;

Nearest nearest_of(const Plane& plane, const Vector3d& p) {
  return {distance_to(plane, p), plane.normal_in_world, 0};
}

Nearest nearest_of(const Table& table, const Vector3d& p) {
  return {gap_of(table, p), Vector3d::UnitZ(), 0};
}

Nearest nearest_of(const Sphere& sphere, const Vector3d& p) {
  const Vector3d out = p - sphere.centre_in_world;
  const double distance = out.norm();
  return {distance - sphere.radius_m, distance > 0 ? Vector3d(out / distance) : Vector3d::UnitZ(),
          -1};
}

Nearest nearest_of(const PlacedMesh& body, const Vector3d& p) {
  const ClosedMesh::Distance found = body.mesh->distance(in_frame(body.world_from_mesh, p));
  return {found.gap_m, body.world_from_mesh.rotation * found.normal, found.face};
}

/// Gap and outward direction, in its own coordinates, of a body grown by a radius from where `over`
/// is not positive. If at most one coordinate is over, `axis` is that of its face.
template <int N>
struct Grown {
  double gap_m = 0;
  Eigen::Matrix<double, N, 1> out;
  int axis = -1;

  Grown(const Eigen::Matrix<double, N, 1>& over, double radius_m) : out(over.cwiseMax(0.0)) {
    Eigen::Index most = 0;
    const double farthest = over.maxCoeff(&most), beyond = out.norm();
    gap_m = beyond + std::min(0.0, farthest) - radius_m;
    if ((over.array() > 0).count() <= 1) {
      axis = static_cast<int>(most);
      out.setZero();
      out[most] = 1;
    } else {
      out /= beyond;
    }
  }
};

Nearest nearest_of(const Cylinder& body, const Vector3d& p) {
  const Vector3d q = in_frame(body.world_from_cylinder, p);
  const Grown<2> grown(beyond(body, q), body.edge_radius_m);
  const double across = q.head<2>().norm();
  const Eigen::Vector2d away =
      across > 0 ? Eigen::Vector2d(q.head<2>() / across) : Eigen::Vector2d::UnitX();
  const Vector3d local(grown.out.x() * away.x(), grown.out.x() * away.y(),
                       std::copysign(grown.out.y(), q.z()));
  return {grown.gap_m, body.world_from_cylinder.rotation * local,
          grown.axis == 1 ? (q.z() > 0 ? 1 : 0) : -1};
}

Nearest nearest_of(const Box& box, const Vector3d& p) {
  const Vector3d q = in_frame(box.world_from_box, p);
  Grown<3> grown(beyond(box, q), box.edge_radius_m);
  for (int i = 0; i < 3; ++i) grown.out[i] = std::copysign(grown.out[i], q[i]);
  const int axis = grown.axis;
  return {grown.gap_m, box.world_from_box.rotation * grown.out,
          axis < 0 ? -1 : 2 * axis + (q[axis] > 0 ? 1 : 0)};
}

/// Curvature of a sphere about the nearest point, restricted to the directions of `across`.
Matrix3d curved(const Vector3d& normal, double radius_m, const Matrix3d& across) {
  if (radius_m < kSharp_m) return Matrix3d::Zero();
  return (across - normal * normal.transpose()) / radius_m;
}

template <class Flat>
Matrix3d curvature_of(const Flat&, const Vector3d&) {
  return Matrix3d::Zero();
}

Matrix3d curvature_of(const Sphere& sphere, const Vector3d& p) {
  const Nearest nearest = nearest_of(sphere, p);
  return curved(nearest.normal, sphere.radius_m + nearest.gap_m, Matrix3d::Identity());
}

Matrix3d curvature_of(const Box& box, const Vector3d& p) {
  const Nearest nearest = nearest_of(box, p);
  if (nearest.face >= 0) return Matrix3d::Zero();
  const Vector3d over = beyond(box, in_frame(box.world_from_box, p));
  const Matrix3d& turn = box.world_from_box.rotation;
  const Vector3d along = (over.array() > 0).cast<double>();
  return curved(nearest.normal, box.edge_radius_m + nearest.gap_m,
                turn * along.asDiagonal() * turn.transpose());
}

Matrix3d curvature_of(const Cylinder& body, const Vector3d& p) {
  const Vector3d q = in_frame(body.world_from_cylinder, p);
  const double across = q.head<2>().norm();
  if (!(across > kSharp_m)) return Matrix3d::Zero();
  const Nearest nearest = nearest_of(body, p);
  const Matrix3d& turn = body.world_from_cylinder.rotation;
  const Vector3d around = turn * Vector3d(-q.y() / across, q.x() / across, 0);
  const Vector3d away = turn * Vector3d(q.x() / across, q.y() / across, 0);
  Matrix3d sum = nearest.normal.dot(away) / across * around * around.transpose();
  if ((beyond(body, q).array() > 0).all())
    sum += curved(nearest.normal, body.edge_radius_m + nearest.gap_m,
                  Matrix3d::Identity() - around * around.transpose());
  return sum;
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

Surroundings::Surroundings(const Scene& scene, double closed_m) {
  for (const Obstacle& obstacle : scene.obstacles) {
    std::visit([this](const auto& shape) { add(shape); }, obstacle);
  }
  add(Table{scene.table_z_m});
  closed_m_ = closed_m;
  for (int shape = 0; closed_m > 0 && shape < count(); ++shape)
    (is_flat(shape) ? floors_ : bodies_).push_back(shape);
}

void Surroundings::add(const MeshObject& object) {
  add(PlacedMesh{std::make_shared<const ClosedMesh>(ClosedMesh::read(object.file)),
                 object.world_from_mesh});
}

double Surroundings::edge_radius_m(int shape) const {
  if (const auto* box = std::get_if<Box>(&shapes_[shape])) return box->edge_radius_m;
  if (const auto* cylinder = std::get_if<Cylinder>(&shapes_[shape])) return cylinder->edge_radius_m;
  return mesh(shape) != nullptr ? 0 : std::numeric_limits<double>::infinity();
}

double Surroundings::own_gap_m(int shape, const Vector3d& p) const {
  return std::visit([&p](const auto& s) { return gap_of(s, p); }, shapes_[shape]);
}

Surroundings::Raised Surroundings::raised(int shape, const Vector3d& p) const {
  Raised found = {p, Vector3d::Zero()};
  if (is_flat(shape)) return found;
  for (const int floor : floors_) {
    const Nearest below = nearest_over_floors(floor, p);
    if (below.gap_m >= closed_m_) continue;
    Vector3d above = p + (closed_m_ - below.gap_m) * below.normal;
    if (const auto* table = std::get_if<Table>(&shapes_[floor])) above.z() = table->z_m + closed_m_;
    if (own_gap_m(shape, above) < own_gap_m(shape, found.at)) found = {above, below.normal};
  }
  return found;
}

Surroundings::Nearest Surroundings::nearest_over_floors(int shape, const Vector3d& p) const {
  const auto [at, floor] = raised(shape, p);
  Nearest found =
      std::visit([&at = at](const auto& s) { return nearest_of(s, at); }, shapes_[shape]);
  const double steep = found.normal.dot(floor);
  if (steep == 0) return found;
  found.face = -1;
  found.normal -= steep * floor;
  found.slope = found.normal.norm();
  found.normal = found.slope > 0 ? Vector3d(found.normal / found.slope) : floor.unitOrthogonal();
  return found;
}

Matrix3d Surroundings::curvature_over_floors(int shape, const Vector3d& p) const {
  const auto [at, floor] = raised(shape, p);
  const Matrix3d found =
      std::visit([&at = at](const auto& s) { return curvature_of(s, at); }, shapes_[shape]);
  if (floor.isZero(0)) return found;
  const Matrix3d along = Matrix3d::Identity() - floor * floor.transpose();
  return along * found * along / nearest_over_floors(shape, p).slope;
}

Surroundings::Closed Surroundings::closed(int shape, const Vector3d& p) const {
  const double own = gap_over_floors_m(shape, p);
  Closed found = {-1, own};
  if (is_flat(shape)) return found;
  for (const int body : bodies_) {
    if (body >= shape) break;
    const double sum = own + gap_over_floors_m(body, p) - closed_m_, gap = sum > 0 ? sum / 2 : sum;
    if (gap < found.gap_m) found = {body, gap};
  }
  return found;
}

double Surroundings::gap_m(int shape, const Vector3d& p) const {
  return closed(shape, p).gap_m;
}

Surroundings::Nearest Surroundings::nearest(int shape, const Vector3d& p) const {
  const auto [with, gap] = closed(shape, p);
  Nearest found = nearest_over_floors(shape, p);
  if (with < 0) return found;
  const Nearest other = nearest_over_floors(with, p);
  const Vector3d sum = found.slope * found.normal + other.slope * other.normal;
  const double size = sum.norm();
  return {gap, size > 0 ? Vector3d(sum / size) : found.normal.unitOrthogonal(), -1,
          gap > 0 ? size / 2 : size};
}

Matrix3d Surroundings::curvature(int shape, const Vector3d& p) const {
  const Matrix3d found = curvature_over_floors(shape, p);
  const int with = closed(shape, p).with;
  if (with < 0) return found;
  const Nearest one = nearest_over_floors(shape, p), other = nearest_over_floors(with, p);
  return (one.slope * found + other.slope * curvature_over_floors(with, p)) /
         (one.slope * one.normal + other.slope * other.normal).norm();
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
