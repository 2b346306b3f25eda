// SPDX-License-Identifier: Apache-2.0
#include "synth/render/face_pattern.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/vectors.hpp"

namespace drape::synth {
namespace {

constexpr double bucket_m = 2e-3;

/// Area swept from the origin along the segment a -> b, clipped to the disc of radius r.
double sector_area(const FacePoint& a, const FacePoint& b, double r) {
  const FacePoint d = b - a;
  const double dd = d.squaredNorm();
  const auto pie = [&](const FacePoint& p, const FacePoint& q) {
    return 0.5 * r * r * std::atan2(cross(p, q), p.dot(q));
  };
  if (dd == 0) return 0;
  const double half_b = a.dot(d);
  const double discriminant = half_b * half_b - dd * (a.squaredNorm() - r * r);
  if (discriminant <= 0) return pie(a, b);
  const double root = std::sqrt(discriminant);
  const double t1 = (-half_b - root) / dd, t2 = (-half_b + root) / dd;
  if (t1 >= 1 || t2 <= 0) return pie(a, b);
  const FacePoint in = a + std::max(t1, 0.0) * d, out = a + std::min(t2, 1.0) * d;
  double area = 0.5 * cross(in, out);
  if (t1 > 0) area += pie(a, in);
  if (t2 < 1) area += pie(out, b);
  return area;
}

double signed_area(const FacePoint* points, int count) {
  double twice = 0;
  for (int i = 0; i < count; ++i) twice += cross(points[i], points[(i + 1) % count]);
  return twice / 2;
}

/// Clipped cell: after clipping by the four sides of a rectangle it has at most eight corners.
struct Cut {
  std::array<FacePoint, 12> points;
  int count = 0;
};

/// Clips to the side sign * p[axis] >= sign * limit (Sutherland, Hodgman 1974).
Cut cut(const Cut& polygon, int axis, double limit, double sign) {
  Cut result;
  for (int i = 0; i < polygon.count; ++i) {
    const FacePoint& a = polygon.points[i];
    const FacePoint& b = polygon.points[(i + 1) % polygon.count];
    const double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
    if (da >= 0) result.points[result.count++] = a;
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
      result.points[result.count++] = a + da / (da - db) * (b - a);
    }
  }
  return result;
}

double cell_box_area(const FaceCell& cell, const FaceBox& box) {
  Cut polygon;
  polygon.count = 4;
  std::copy(cell.begin(), cell.end(), polygon.points.begin());
  for (int axis = 0; axis < 2; ++axis) {
    polygon = cut(polygon, axis, box.least[axis], 1);
    polygon = cut(polygon, axis, box.most[axis], -1);
  }
  return signed_area(polygon.points.data(), polygon.count);
}

struct Bounds {
  FacePoint least, most;
  explicit Bounds(const FaceCell& cell)
      : least(cell[0].cwiseMin(cell[1]).cwiseMin(cell[2]).cwiseMin(cell[3])),
        most(cell[0].cwiseMax(cell[1]).cwiseMax(cell[2]).cwiseMax(cell[3])) {}
};

}  // namespace

double polygon_disc_area(const FaceCell& cell, const FacePoint& centre, double radius_m) {
  double area = 0;
  for (int i = 0; i < 4; ++i) {
    area += sector_area(cell[i] - centre, cell[(i + 1) % 4] - centre, radius_m);
  }
  return area;
}

FacePattern::FacePattern(const Face& face) : discs_(face.discs) {
  for (const std::vector<FaceBox>& area : face.areas)
    boxes_.insert(boxes_.end(), area.begin(), area.end());
  if (discs_.empty() && boxes_.empty()) return;
  FacePoint least = FacePoint::Constant(1e300), most = -least;
  for (const FaceDisc& disc : discs_) {
    least = least.cwiseMin((disc.centre.array() - disc.radius_m).matrix());
    most = most.cwiseMax((disc.centre.array() + disc.radius_m).matrix());
  }
  for (const FaceBox& box : boxes_) {
    least = least.cwiseMin(box.least);
    most = most.cwiseMax(box.most);
  }
  first_ = least;
  size_ = ((most - least) / bucket_m).cast<int>() + Eigen::Vector2i::Ones();
  buckets_.resize(static_cast<std::size_t>(size_.x()) * size_.y());
  int index = 0;
  for (const FaceDisc& disc : discs_) {
    const FacePoint reach = FacePoint::Constant(disc.radius_m);
    add(disc.centre - reach, disc.centre + reach, index++, true);
  }
  index = 0;
  for (const FaceBox& box : boxes_) {
    add(box.least, box.most, index++, false);
  }
}

Eigen::Vector2i FacePattern::bucket_of(const FacePoint& point) const {
  const FacePoint in_buckets = (point - first_) / bucket_m;
  return {static_cast<int>(std::floor(std::clamp(in_buckets.x(), -1.0, 1.0 * size_.x()))),
          static_cast<int>(std::floor(std::clamp(in_buckets.y(), -1.0, 1.0 * size_.y())))};
}

void FacePattern::add(const FacePoint& least, const FacePoint& most, int index, bool is_disc) {
  visit(least, most, [&](const Bucket& found) {
    auto& bucket = buckets_[static_cast<std::size_t>(&found - buckets_.data())];
    (is_disc ? bucket.discs : bucket.boxes).push_back(index);
  });
}

template <class Visit>
void FacePattern::visit(const FacePoint& least, const FacePoint& most, const Visit& visit) const {
  const Eigen::Vector2i from = bucket_of(least).cwiseMax(0);
  const Eigen::Vector2i to = bucket_of(most).cwiseMin(size_ - Eigen::Vector2i::Ones());
  for (int y = from.y(); y <= to.y(); ++y) {
    for (int x = from.x(); x <= to.x(); ++x) {
      visit(buckets_[static_cast<std::size_t>(y) * size_.x() + x]);
    }
  }
}

bool FacePattern::has_edge_in(const FaceCell& cell) const {
  const Bounds bounds(cell);
  bool touched = false;
  visit(bounds.least, bounds.most, [&](const Bucket& bucket) {
    for (const int k : bucket.discs) {
      const FaceDisc& disc = discs_[k];
      double nearest = 1e300, farthest = 0;
      for (const FacePoint& corner : cell) {
        const double distance = (corner - disc.centre).norm();
        nearest = std::min(nearest, distance);
        farthest = std::max(farthest, distance);
      }
      const double size = (bounds.most - bounds.least).norm();
      touched |= farthest > disc.radius_m && nearest < disc.radius_m + size;
    }
    for (const int k : bucket.boxes) {
      const FaceBox& r = boxes_[k];
      const bool apart = (bounds.least.array() >= r.most.array()).any() ||
                         (bounds.most.array() <= r.least.array()).any();
      const bool inside = (bounds.least.array() >= r.least.array()).all() &&
                          (bounds.most.array() <= r.most.array()).all();
      touched |= !apart && !inside;
    }
  });
  return touched;
}

double FacePattern::coverage(const FaceCell& cell) const {
  const double area = signed_area(cell.data(), 4);
  if (area == 0) return is_printed(cell[0]) ? 1 : 0;
  const Bounds bounds(cell);
  std::vector<int> discs, boxes;
  visit(bounds.least, bounds.most, [&](const Bucket& bucket) {
    discs.insert(discs.end(), bucket.discs.begin(), bucket.discs.end());
    boxes.insert(boxes.end(), bucket.boxes.begin(), bucket.boxes.end());
  });
  for (std::vector<int>* found : {&discs, &boxes}) {
    std::sort(found->begin(), found->end());
    found->erase(std::unique(found->begin(), found->end()), found->end());
  }
  double inked = 0;
  for (const int k : discs) {
    inked += discs_[k].ink * polygon_disc_area(cell, discs_[k].centre, discs_[k].radius_m);
  }
  for (const int k : boxes) inked += cell_box_area(cell, boxes_[k]);
  return std::clamp(inked / area, 0.0, 1.0);
}

bool FacePattern::is_printed(const FacePoint& point) const {
  double ink = 0;
  visit(point, point, [&](const Bucket& bucket) {
    for (const int k : bucket.discs) {
      if ((point - discs_[k].centre).norm() < discs_[k].radius_m) ink += discs_[k].ink;
    }
    for (const int k : bucket.boxes) {
      const FaceBox& r = boxes_[k];
      ink += (point.array() >= r.least.array()).all() && (point.array() < r.most.array()).all();
    }
  });
  return ink > 0.5;
}

}  // namespace drape::synth
