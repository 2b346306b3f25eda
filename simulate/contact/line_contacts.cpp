// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/line_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "simulate/contact/deepest.hpp"
#include "simulate/contact/solid_features.hpp"
#include "simulate/fabric/wide.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kWatch = 0.2e-3;  // m; a point closer than this may touch before the next refresh
constexpr double kLookAgain = 30e-6;  // m; path after which a watched element is searched again
// In m: a piece farther on a face than this stays on it meanwhile
constexpr double kFromEdge = 0.5e-3;
constexpr double kEndFraction = 0.02;  // places nearer to a particle than this fraction are its own
constexpr int kThirdSteps = 14;        // steps of the ternary search: 0.4 % of the line piece
constexpr int kHalfSteps = 20;         // steps of halving: a millionth of it
// Relative to the distance along a line: all its places are as deep
constexpr double kFlatSlope = 1e-9;
// Per side, inside a cell; fixed, so that no load jumps between them
constexpr int kCellPoints = 3;
constexpr double kFollow = 1e-3;  // m per slope: how fast a place slides along its line
constexpr int kSettle = 32;       // looks in which places come to where they stay

/// True if normals turn within the depth that the stiffer springs allow.
bool turns_at_once(const Surroundings& surroundings, int shape) {
  const Cylinder* const cylinder = surroundings.cylinder(shape);
  return is_sharp(surroundings, shape) || (cylinder != nullptr && cylinder->edge_radius_m == 0);
}

/// Lines mix two particles, cells four.
int corners_of(const LineContacts::Point& point) {
  return point.weight[2] == 0 && point.weight[3] == 0 ? 2 : 4;
}

DRAPE_INLINE Vector3d mix(const Field& field, const LineContacts::Point& point) {
  Vector3d sum = point.weight[0] * at(field, point.particle[0]) +
                 point.weight[1] * at(field, point.particle[1]);
  if (corners_of(point) == 2) return sum;
  sum += point.weight[2] * at(field, point.particle[2]);
  return sum + point.weight[3] * at(field, point.particle[3]);
}

}  // namespace

LineContacts::LineContacts(const Cloth& cloth, const Surroundings& surroundings, double friction,
                           double gravity_m_per_s2, Shapes shapes)
    : cloth_(&cloth),
      surroundings_(&surroundings),
      friction_(friction),
      follows_(shapes == Shapes::smooth) {
  const double mass = cloth.total_mass_kg() / cloth.count();
  shear_stiffness_ = mass * gravity_m_per_s2 / sink_m;
  const double stiffer =
      std::max(shear_stiffness_, cloth.total_mass_kg() * gravity_m_per_s2 / sheet_sink_m);
  double stiffest = shear_stiffness_;
  for (int shape = 0; shape < surroundings.count(); ++shape) {
    const bool sharp = is_sharp(surroundings, shape);
    watched_.push_back(!surroundings.is_flat(shape) && (shapes == Shapes::all || !sharp));
    const double stiffness = turns_at_once(surroundings, shape) ? shear_stiffness_ : stiffer;
    // A fifth of critical: a light corner particle takes part in a dozen of these and must stay
    // stable.
    pressing_.push_back({stiffness, 0.4 * std::sqrt(stiffness * mass)});
    if (watched_.back()) stiffest = std::max(stiffest, stiffness);
  }
  frequency2_ = stiffest / mass;
  const GridSpec& grid = cloth.grid();
  reach_m_ = 0.75 * std::max(grid.warp_spacing_m(), grid.weft_spacing_m());
  elements_ = (2 + kCellPoints * kCellPoints) * cloth.count();
  points_.reserve(static_cast<std::size_t>(elements_) * std::max(1, surroundings.count()));
  until_.assign(3 * static_cast<std::size_t>(cloth.count()), -1.0);
}

/// Where between p and q a shape is entered deepest. Places that stay where they are found are not
/// found finer than need be, so that a small change of the sheet leaves them.
double LineContacts::deepest_fraction(int shape, const Vector3d& p, const Vector3d& q) const {
  double low = 0, high = 1;
  for (int k = 0; k < kThirdSteps; ++k) {
    const double third = (high - low) / 3;
    const bool left = surroundings_->gap_m(shape, p + (low + third) * (q - p)) <
                      surroundings_->gap_m(shape, p + (high - third) * (q - p));
    (left ? high : low) = left ? high - third : low + third;
  }
  return 0.5 * (low + high);
}

/// The same for a place that follows, halved by the distance's slope. One that comes to a particle
/// stays beside it, so that its load does not vanish.
double LineContacts::followed_fraction(int shape, const Vector3d& p, const Vector3d& q) const {
  const Vector3d span = q - p;
  const double flat = kFlatSlope * span.norm();
  double low = kEndFraction, high = 1 - kEndFraction, t = 0.5;
  for (int k = 0; k < kHalfSteps; ++k, t = 0.5 * (low + high)) {
    const double slope = surroundings_->normal(shape, p + t * span).dot(span);
    if (std::abs(slope) <= flat) break;
    (slope > 0 ? high : low) = t;
  }
  return t;
}

/// On a face the particles bear it all. There places between them, the stiffer the more, would hand
/// their load over in many small parts only: multipliers are moved once in each step. What may
/// reach an edge before places are found again is watched.
bool LineContacts::leaves_to_particles(int shape, std::span<Vector3d> corners) const {
  if (follows_) return false;
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& corner : corners) middle += corner / static_cast<double>(corners.size());
  for (Vector3d& corner : corners) corner += kFromEdge * (corner - middle).normalized();
  return is_seen_flat(*surroundings_, shape, corners);
}

double LineContacts::try_line(const Field& position, int element, int a, int b) {
  const Vector3d p = at(position, a);
  const Vector3d q = at(position, b);
  double least = reach_m_;
  for (int shape = 0; shape < surroundings_->count(); ++shape) {
    if (!watched_[shape]) continue;
    // The distance is convex along the line, so its ends and middle bound it from below.
    const double middle = surroundings_->gap_m(shape, 0.5 * (p + q));
    if (middle > reach_m_) {
      least = std::min(least, middle - 0.5 * (p - q).norm());
      continue;
    }
    const double ends = std::max(surroundings_->gap_m(shape, p), surroundings_->gap_m(shape, q));
    least = std::min(least, 2 * middle - ends);
    if (2 * middle - ends > kWatch) continue;
    std::array corners{p, q};
    if (leaves_to_particles(shape, corners)) continue;
    const double t = follows_ ? followed_fraction(shape, p, q) : deepest_fraction(shape, p, q);
    if (t < kEndFraction || t > 1 - kEndFraction) continue;
    if (surroundings_->gap_m(shape, p + t * (q - p)) > kWatch) continue;
    points_.push_back({element, shape, {a, b, a, b}, {1 - t, t, 0, 0}});
    return 0;
  }
  return least - kWatch;
}

double LineContacts::try_cell(const Field& position, int corner) {
  const int cols = cloth_->grid().cols;
  const int first = 2 * cloth_->count() + kCellPoints * kCellPoints * corner;
  Point point{first, 0, {corner, corner + 1, corner + cols, corner + cols + 1}, {}};
  point.weight.fill(0.25);
  const Vector3d centre = mix(position, point);
  double least = reach_m_;
  for (int shape = 0; shape < surroundings_->count(); ++shape) {
    if (!watched_[shape]) continue;
    const double middle = surroundings_->gap_m(shape, centre);
    if (middle > reach_m_) {
      least = std::min(least, middle - reach_m_);
      continue;
    }
    std::array<Vector3d, 4> corners;
    for (int k = 0; k < 4; ++k) corners[k] = at(position, point.particle[k]);
    if (leaves_to_particles(shape, corners)) {
      least = 0;
      continue;
    }
    point.shape = shape;
    for (int r = 0; r < kCellPoints; ++r) {
      for (int c = 0; c < kCellPoints; ++c) {
        const double u = (r + 1) / (kCellPoints + 1.0);
        const double v = (c + 1) / (kCellPoints + 1.0);
        point.element = first + r * kCellPoints + c;
        point.weight = {(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v};
        const double gap = surroundings_->gap_m(shape, mix(position, point));
        least = std::min(least, gap);
        if (gap < kWatch) points_.push_back(point);
      }
    }
  }
  return least - kWatch;
}

void LineContacts::refresh(const Field& position) {
  look_everywhere();
  refresh(position, std::vector<double>(cloth_->count(), 0.0));
}

void LineContacts::look_everywhere() {
  std::fill(until_.begin(), until_.end(), -1.0);
}

void LineContacts::refresh(const Field& position, const std::vector<double>& path_m) {
  before_.swap(points_);
  points_.clear();
  const GridSpec& grid = cloth_->grid();
  const int n = grid.count();
  std::size_t old = 0;  // both lists are ordered by place: a particle's two lines, then its cell
  const auto visit = [&](int slot, int first, int last, double path, const auto& look) {
    const std::size_t begin = old;
    while (old < before_.size() && before_[old].element >= first && before_[old].element < last)
      ++old;
    if (path <= until_[slot]) {
      points_.insert(points_.end(), before_.begin() + static_cast<std::ptrdiff_t>(begin),
                     before_.begin() + static_cast<std::ptrdiff_t>(old));
      return;
    }
    const std::size_t now = points_.size();
    until_[slot] = path + std::max(kLookAgain, look());
    if (follows_ && slot < 2 * n) keep_places(position, begin, old, now);
    forget_gone(begin, old, now);
  };
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      const int i = grid.index(r, c);
      const int s = grid.cols;
      const bool down = cloth_->line(0).width[i] > 0, right = cloth_->line(1).width[i] > 0;
      if (down) {
        visit(i, i, i + 1, std::max(path_m[i], path_m[i + s]),
              [&] { return try_line(position, i, i, i + s); });
      }
      if (right) {
        visit(n + i, n + i, n + i + 1, std::max(path_m[i], path_m[i + 1]),
              [&] { return try_line(position, n + i, i, i + 1); });
      }
      if (cloth_->has_cell(i)) {
        const int first = 2 * n + kCellPoints * kCellPoints * i;
        visit(2 * n + i, first, first + kCellPoints * kCellPoints,
              std::max({path_m[i], path_m[i + 1], path_m[i + s], path_m[i + s + 1]}),
              [&] { return try_cell(position, i); });
      }
    }
  }
  clear_.assign(points_.size(), 0.0);
  choose_all();
}

/// A place that presses on a line slides from where it is, see follow().
void LineContacts::keep_places(const Field& position, std::size_t begin, std::size_t end,
                               std::size_t now) {
  for (; now < points_.size(); ++now) {
    for (std::size_t k = begin; k < end; ++k) {
      if (before_[k].shape == points_[now].shape &&
          surroundings_->gap_m(before_[k].shape, mix(position, before_[k])) < 0)
        points_[now].weight = before_[k].weight;
    }
  }
}

/// A place that is no longer watched gets a new friction spring next time.
void LineContacts::forget_gone(std::size_t begin, std::size_t end, std::size_t now) {
  for (std::size_t k = begin; k < end; ++k) {
    while (now < points_.size() && points_[now].element < before_[k].element) ++now;
    if (now == points_.size() || points_[now].element != before_[k].element)
      forget_spring(before_[k].element);
  }
}

/// A line nearly along a face touches two edges, and its deepest place jumps from one to the other
/// as it tilts; a load that jumped with it would bring energy in for ever. So a place slides
/// towards the deepest one as fast as the line is inclined against the surface: along a face it
/// stays where it balances the line, as both edges would.
double LineContacts::follow(const Field& position) {
  double brought_j = 0;
  for (const int k : chosen_) {
    Point& point = points_[k];
    if (point.element >= 2 * cloth_->count()) continue;
    const Vector3d here = mix(position, point);
    const double before = surroundings_->gap_m(point.shape, here);
    if (before >= 0) continue;
    const Vector3d p = at(position, point.particle[0]), span = at(position, point.particle[1]) - p;
    const double slope = surroundings_->normal(point.shape, here).dot(span);
    const double reach = kFollow * std::abs(slope) / span.squaredNorm();
    const double t = std::clamp(followed_fraction(point.shape, p, p + span),
                                point.weight[1] - reach, point.weight[1] + reach);
    point.weight = {1 - t, t, 0, 0};
    const double after = std::min(0.0, surroundings_->gap_m(point.shape, mix(position, point)));
    brought_j += 0.5 * pressing_[point.shape].stiffness * (after * after - before * before);
  }
  return brought_j;
}

double LineContacts::settle(const Field& position) {
  double brought_j = 0;
  for (int look = 0; look < kSettle; ++look) brought_j += follow(position);
  return brought_j;
}

void LineContacts::choose_all() {
  chosen_.resize(points_.size());
  std::iota(chosen_.begin(), chosen_.end(), 0);
}

void LineContacts::choose(const Field& position, double farthest_path_m, double margin_m) {
  chosen_.clear();
  for (std::size_t k = 0; k < points_.size(); ++k) {
    if (clear_[k] > farthest_path_m + margin_m) continue;
    const double gap = surroundings_->gap_m(points_[k].shape, mix(position, points_[k]));
    clear_[k] = farthest_path_m + gap;
    if (gap <= margin_m) {
      chosen_.push_back(static_cast<int>(k));
    } else {
      forget_spring(points_[k].element);
    }
  }
}

LineContacts::Push LineContacts::push(const Point& point, const Field& position,
                                      const Field* velocity) const {
  Push result;
  const Vector3d p = mix(position, point);
  result.gap = surroundings_->gap_m(point.shape, p);
  if (result.gap >= 0) return result;
  result.normal = surroundings_->normal(point.shape, p);
  const Spring& spring = pressing_[point.shape];
  result.normal_n = -spring.stiffness * result.gap;
  if (velocity != nullptr) {
    const double approach = -mix(*velocity, point).dot(result.normal);
    result.normal_n = std::max(0.0, result.normal_n + spring.damping * approach);
  }
  return result;
}

void LineContacts::add_forces(const Field& position, const Field* velocity, Field& force) const {
  const std::size_t n = position.size() / 3;
  for (const int k : chosen_) {
    const Point& point = points_[k];
    const Push contact = push(point, position, velocity);
    if (contact.gap >= 0) continue;
    Vector3d total = contact.normal_n * contact.normal;
    Vector3d tangential = -shear_stiffness_ * friction_spring_m(point.element);
    if (velocity != nullptr)
      tangential -= 0.5 * pressing_[point.shape].damping * mix(*velocity, point);
    tangential -= tangential.dot(contact.normal) * contact.normal;
    const double limit = friction_ * contact.normal_n;
    const double size = tangential.norm();
    if (size > limit) tangential *= limit / size;
    total += tangential;
    const int corners = corners_of(point);
    for (int corner = 0; corner < corners; ++corner) {
      for (int axis = 0; axis < 3; ++axis) {
        force[axis * n + point.particle[corner]] += point.weight[corner] * total[axis];
      }
    }
  }
}

void LineContacts::forget_spring(int element) {
  if (!friction_spring_.empty()) friction_spring_[element].setZero();
}

void LineContacts::advance(const Field& position, const Field& velocity, double step_s) {
  if (friction_spring_.empty()) friction_spring_.assign(elements_, Vector3d::Zero());
  for (const int k : chosen_) {
    const Point& point = points_[k];
    Vector3d& spring = friction_spring_[point.element];
    const Push contact = push(point, position, nullptr);
    if (contact.gap >= 0) {
      spring.setZero();
      continue;
    }
    spring += step_s * mix(velocity, point);
    spring -= spring.dot(contact.normal) * contact.normal;
    const double limit = friction_ * contact.normal_n / shear_stiffness_;
    const double size = spring.norm();
    if (size > limit) spring *= limit / size;
  }
}

double LineContacts::energy_j(const Field& position) const {
  double sum = 0;
  for (const Point& point : points_) {
    const double gap = push(point, position, nullptr).gap;
    if (gap < 0) sum += 0.5 * pressing_[point.shape].stiffness * gap * gap;
  }
  return sum;
}

}  // namespace drape::simulate
