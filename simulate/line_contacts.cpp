// SPDX-License-Identifier: Apache-2.0
#include "simulate/line_contacts.hpp"

#include <algorithm>
#include <cmath>

namespace drape::sim {
namespace {

using Eigen::Vector3d;

constexpr double kWatch = 0.2e-3;   // m; a point closer than this may touch before the next refresh
constexpr double kEndShare = 0.02;  // contacts nearer to a particle than this share are its own
constexpr int kSearchSteps = 14;    // of the ternary search: 0.4 % of the line piece
constexpr int kCellPoints =
    3;  // per side, inside a cell; fixed, so that no load jumps between them

Vector3d at(const Field& x, int i) {
  const std::size_t n = x.size() / 3;
  return {x[i], x[n + i], x[2 * n + i]};
}

template <class Point>
Vector3d mix(const Field& field, const Point& point) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) sum += point.weight[k] * at(field, point.particle[k]);
  return sum;
}

}  // namespace

LineContacts::LineContacts(const Cloth& cloth, const Surroundings& surroundings, double friction,
                           double gravity_m_per_s2)
    : cloth_(&cloth),
      surroundings_(&surroundings),
      friction_(friction),
      gravity_(gravity_m_per_s2) {
  const double mass = cloth.total_mass_kg() / cloth.count();
  stiffness_ = mass * gravity_ / sink_m;
  // A fifth of critical: a light corner particle shares a dozen of these and must stay stable.
  damping_ = 0.4 * std::sqrt(stiffness_ * mass);
  const GridSpec& grid = cloth.grid();
  reach_m_ = 0.75 * std::max(grid.warp_spacing_m(), grid.weft_spacing_m());
  const std::size_t elements =
      (2 + kCellPoints * kCellPoints) * static_cast<std::size_t>(cloth.count());
  points_.reserve(elements * std::max(1, surroundings.count()));
  friction_spring_.assign(elements, Vector3d::Zero());
  touched_.assign(elements, 0);
}

void LineContacts::try_line(const Field& position, int element, int a, int b) {
  const Vector3d p = at(position, a);
  const Vector3d q = at(position, b);
  for (int shape = 0; shape < surroundings_->count(); ++shape) {
    if (surroundings_->is_flat(shape)) continue;
    // The distance is convex along the line, so its ends and middle bound it from below.
    const double middle = surroundings_->gap_m(shape, 0.5 * (p + q));
    if (middle > reach_m_) continue;
    const double ends = std::max(surroundings_->gap_m(shape, p), surroundings_->gap_m(shape, q));
    if (2 * middle - ends > kWatch) continue;
    double low = 0;
    double high = 1;
    for (int k = 0; k < kSearchSteps; ++k) {
      const double third = (high - low) / 3;
      const bool left = surroundings_->gap_m(shape, p + (low + third) * (q - p)) <
                        surroundings_->gap_m(shape, p + (high - third) * (q - p));
      (left ? high : low) = left ? high - third : low + third;
    }
    const double t = 0.5 * (low + high);
    if (t < kEndShare || t > 1 - kEndShare) continue;
    if (surroundings_->gap_m(shape, p + t * (q - p)) > kWatch) continue;
    points_.push_back({element, shape, {a, b, a, b}, {1 - t, t, 0, 0}});
    return;
  }
}

void LineContacts::try_cell(const Field& position, int corner) {
  const int cols = cloth_->grid().cols;
  const int first = 2 * cloth_->count() + kCellPoints * kCellPoints * corner;
  Point point{first, 0, {corner, corner + 1, corner + cols, corner + cols + 1}, {}};
  point.weight.fill(0.25);
  const Vector3d centre = mix(position, point);
  for (int shape = 0; shape < surroundings_->count(); ++shape) {
    if (surroundings_->is_flat(shape)) continue;
    if (surroundings_->gap_m(shape, centre) > reach_m_) continue;
    point.shape = shape;
    for (int r = 0; r < kCellPoints; ++r) {
      for (int c = 0; c < kCellPoints; ++c) {
        const double u = (r + 1) / (kCellPoints + 1.0);
        const double v = (c + 1) / (kCellPoints + 1.0);
        point.element = first + r * kCellPoints + c;
        point.weight = {(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v};
        if (surroundings_->gap_m(shape, mix(position, point)) < kWatch) points_.push_back(point);
      }
    }
  }
}

void LineContacts::refresh(const Field& position) {
  points_.clear();
  const GridSpec& grid = cloth_->grid();
  const int n = grid.count();
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      const int i = grid.index(r, c);
      if (r + 1 < grid.rows) try_line(position, i, i, i + grid.cols);
      if (c + 1 < grid.cols) try_line(position, n + i, i, i + 1);
      if (r + 1 < grid.rows && c + 1 < grid.cols) try_cell(position, i);
    }
  }
  std::fill(touched_.begin(), touched_.end(), 0);
  for (const Point& point : points_) touched_[point.element] = 1;
  for (std::size_t e = 0; e < touched_.size(); ++e) {
    if (touched_[e] == 0) friction_spring_[e].setZero();
  }
}

LineContacts::Push LineContacts::push(const Point& point, const Field& position,
                                      const Field* velocity) const {
  Push result;
  const Vector3d p = mix(position, point);
  result.gap = surroundings_->gap_m(point.shape, p);
  if (result.gap >= 0) return result;
  result.normal = surroundings_->normal(point.shape, p);
  result.normal_n = -stiffness_ * result.gap;
  if (velocity != nullptr) {
    const double approach = -mix(*velocity, point).dot(result.normal);
    result.normal_n = std::max(0.0, result.normal_n + damping_ * approach);
  }
  return result;
}

void LineContacts::add_forces(const Field& position, const Field* velocity, Field& force) const {
  const std::size_t n = position.size() / 3;
  for (const Point& point : points_) {
    const Push contact = push(point, position, velocity);
    if (contact.gap >= 0) continue;
    Vector3d total = contact.normal_n * contact.normal;
    Vector3d tangential = -stiffness_ * friction_spring_[point.element];
    if (velocity != nullptr) tangential -= 0.5 * damping_ * mix(*velocity, point);
    tangential -= tangential.dot(contact.normal) * contact.normal;
    const double limit = friction_ * contact.normal_n;
    const double size = tangential.norm();
    if (size > limit) tangential *= limit / size;
    total += tangential;
    for (int k = 0; k < 4; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        force[axis * n + point.particle[k]] += point.weight[k] * total[axis];
      }
    }
  }
}

void LineContacts::advance(const Field& position, const Field& velocity, double step_s) {
  for (const Point& point : points_) {
    Vector3d& spring = friction_spring_[point.element];
    const Push contact = push(point, position, nullptr);
    if (contact.gap >= 0) {
      spring.setZero();
      continue;
    }
    spring += step_s * mix(velocity, point);
    spring -= spring.dot(contact.normal) * contact.normal;
    const double limit = friction_ * contact.normal_n / stiffness_;
    const double size = spring.norm();
    if (size > limit) spring *= limit / size;
  }
}

double LineContacts::energy_j(const Field& position) const {
  double sum = 0;
  for (const Point& point : points_) {
    const double gap = push(point, position, nullptr).gap;
    if (gap < 0) sum += 0.5 * stiffness_ * gap * gap;
  }
  return sum;
}

}  // namespace drape::sim
