// SPDX-License-Identifier: Apache-2.0
#include "synth/render/render.hpp"

#include <Eigen/Geometry>

#include "core/geometry/vectors.hpp"
#include "core/parallel.hpp"

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

/// Signed area of the intersection of a polygon, by its orientation, with a disc.
double polygon_disc_area(const FaceCell& cell, const FacePoint& centre, double radius_m) {
  double area = 0;
  for (int i = 0; i < 4; ++i) {
    area += sector_area(cell[i] - centre, cell[(i + 1) % 4] - centre, radius_m);
  }
  return area;
}

/// Clipped cell: after clipping by the four edges of a rectangle it has at most eight corners.
struct Cut {
  std::array<FacePoint, 12> points;
  int count = 0;
};

/// Clips to the half plane sign * p[axis] >= sign * limit (Sutherland, Hodgman 1974).
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
  std::ranges::copy(cell, polygon.points.begin());
  for (int axis = 0; axis < 2; ++axis) {
    polygon = cut(polygon, axis, box.least[axis], 1);
    polygon = cut(polygon, axis, box.most[axis], -1);
  }
  return signed_area({polygon.points.data(), static_cast<std::size_t>(polygon.count)});
}

struct Bounds {
  FacePoint least, most;
  explicit Bounds(const FaceCell& cell)
      : least(cell[0].cwiseMin(cell[1]).cwiseMin(cell[2]).cwiseMin(cell[3])),
        most(cell[0].cwiseMax(cell[1]).cwiseMax(cell[2]).cwiseMax(cell[3])) {}
};

std::vector<double> kernel(double sigma_px) {
  const int reach = static_cast<int>(std::ceil(4 * sigma_px));
  std::vector<double> weights;
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) {
    weights.push_back(std::exp(-0.5 * k * k / (sigma_px * sigma_px)));
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Blurs along rows and transposes the picture, so that two calls blur along both axes.
std::vector<double> blurred_and_turned(const std::vector<double>& from, int width, int height,
                                       const std::vector<double>& weights, int threads) {
  const int reach = static_cast<int>(weights.size()) / 2;
  std::vector<double> to(from.size());
  parallel_for(static_cast<std::size_t>(height), threads, [&](std::size_t y) {
    const double* row = from.data() + y * width;
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = -reach; k <= reach; ++k)
        sum += weights[k + reach] * row[std::clamp(x + k, 0, width - 1)];
      to[static_cast<std::size_t>(x) * height + y] = sum;
    }
  });
  return to;
}

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int parts = 4;             // subdivisions of a pixel per axis where the print has an edge
constexpr int band = 8;              // pixel rows rendered together
constexpr double most_oblique = 12;  // limit of a pixel's foreshortening: cloth seen at 85 degrees

std::vector<Triangle> all_triangles(const SyntheticScene& scene) {
  std::vector<Triangle> all = triangles_of(scene.surface);
  all.insert(all.end(), scene.scenery.begin(), scene.scenery.end());
  return all;
}

/// Brightness along u as a triangular wave between 0.75 and 1.25.
double ramp(double u, double slope_per_px) {
  if (slope_per_px == 0) return 1;
  const double phase = std::fmod(u * slope_per_px, 1.0);
  return 0.75 + (phase < 0.5 ? phase : 1 - phase);
}

double weave(const FacePoint& face, const RenderOptions& options) {
  if (options.weave_rms == 0) return 1;
  const Vector2d threads = face / options.weave_pitch_m;
  const double over_under =
      std::sin(std::numbers::pi * threads.x()) * std::sin(std::numbers::pi * threads.y());
  const auto x = static_cast<std::int64_t>(std::floor(threads.x()));
  const auto y = static_cast<std::int64_t>(std::floor(threads.y()));
  const double crossing =
      std::sqrt(12.0) * (uniform(options.seed, static_cast<std::uint64_t>(x * 1000003 + y)) - 0.5);
  return 1 + options.weave_rms * (1.2 * over_under + 0.8 * crossing);  // variance 0.36 + 0.64 = 1
}

}  // namespace

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
  const double area = signed_area(cell);
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

std::vector<Triangle> triangles_of(const GridSurface& surface) {
  std::vector<Vector3d> normals;
  for (int row = 0; row < surface.rows; ++row) {
    for (int col = 0; col < surface.cols; ++col) normals.push_back(surface.vertex_normal(row, col));
  }
  std::vector<Triangle> triangles;
  const auto add = [&](std::array<MarkId, 3> corners) {
    Triangle triangle;
    triangle.printed = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [row, col] = corners[k];
      triangle.corners_in_world[k] = surface.at(row, col);
      triangle.normals_in_world[k] = normals[static_cast<std::size_t>(row) * surface.cols + col];
      triangle.face[k] = surface.first + surface.step.cwiseProduct(Vector2d(col, row));
    }
    triangles.push_back(triangle);
  };
  for (int row = 0; row + 1 < surface.rows; ++row) {
    for (int col = 0; col + 1 < surface.cols; ++col) {
      add({MarkId{row, col}, MarkId{row, col + 1}, MarkId{row + 1, col}});
      add({MarkId{row, col + 1}, MarkId{row + 1, col + 1}, MarkId{row + 1, col}});
    }
  }
  return triangles;
}

PixelRays::PixelRays(const CameraModel& model) : width_(model.width_px), height_(model.height_px) {
  corners_.reserve(static_cast<std::size_t>(width_ + 1) * (height_ + 1));
  for (int row = 0; row <= height_; ++row) {
    for (int column = 0; column <= width_; ++column) {
      const auto ray = unproject(model, {column - 0.5, row - 0.5});
      corners_.push_back(ray ? Vector2d(ray->hnormalized())
                             : Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
    }
  }
  const int x = width_ / 2, y = height_ / 2;
  focal_px_ = 1 / (corner(x + 1, y) - corner(x, y)).norm();
}

Vector2d PixelRays::direction(double u, double v) const {
  const int column = std::clamp(static_cast<int>(std::floor(u + 0.5)), 0, width_ - 1);
  const int row = std::clamp(static_cast<int>(std::floor(v + 0.5)), 0, height_ - 1);
  return within(column, row, u + 0.5 - column, v + 0.5 - row);
}

Vector2d PixelRays::within(int column, int row, double x, double y) const {
  return (1 - y) * ((1 - x) * corner(column, row) + x * corner(column + 1, row)) +
         y * ((1 - x) * corner(column, row + 1) + x * corner(column + 1, row + 1));
}

Caster::Caster(const Camera& camera, const std::vector<Triangle>& triangles)
    : triangles_(triangles),
      tiles_across_((camera.model.width_px + tile - 1) / tile),
      tiles_down_((camera.model.height_px + tile - 1) / tile) {
  std::vector<std::array<Vector3d, 3>> in_camera(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      in_camera[i][k] = camera.cam_from_world * triangles[i].corners_in_world[k];
    const auto& [a, b, c] = in_camera[i];
    packed_.push_back({b.cross(c), c.cross(a), a.cross(b), a.dot(b.cross(c))});
  }
  bin(camera.model, in_camera);
}

void Caster::bin(const CameraModel& model, const std::vector<std::array<Vector3d, 3>>& in_camera) {
  constexpr double reach = 2;  // px; more than lens distortion bends a small triangle's edge
  struct Span {
    int left, right, top, bottom;
  };
  std::vector<Span> spans(in_camera.size(), {0, -1, 0, -1});
  for (std::size_t i = 0; i < in_camera.size(); ++i) {
    Vector2d least = Vector2d::Constant(1e9), most = -least;
    bool all = true;
    for (const Vector3d& corner : in_camera[i]) {
      const auto image = project(model, corner);
      all &= image.has_value();
      if (!image) continue;
      least = least.cwiseMin(image->px);
      most = most.cwiseMax(image->px);
    }
    if (!all) continue;
    const auto tile_at = [](double px, int count) {
      return static_cast<int>(std::floor(std::clamp(px / tile, -1.0, 1.0 * count)));
    };
    spans[i] = {std::max(0, tile_at(least.x() - reach, tiles_across_)),
                std::min(tiles_across_ - 1, tile_at(most.x() + reach, tiles_across_)),
                std::max(0, tile_at(least.y() - reach, tiles_down_)),
                std::min(tiles_down_ - 1, tile_at(most.y() + reach, tiles_down_))};
  }
  const auto each = [&](const auto& visit) {
    for (std::size_t i = 0; i < spans.size(); ++i) {
      for (int y = spans[i].top; y <= spans[i].bottom; ++y) {
        for (int x = spans[i].left; x <= spans[i].right; ++x) {
          visit(static_cast<std::size_t>(y) * tiles_across_ + x, static_cast<int>(i));
        }
      }
    }
  };
  first_.assign(static_cast<std::size_t>(tiles_across_) * tiles_down_ + 1, 0);
  each([&](std::size_t t, int) { ++first_[t + 1]; });
  for (std::size_t t = 1; t < first_.size(); ++t) first_[t] += first_[t - 1];
  members_.resize(static_cast<std::size_t>(first_.back()));
  std::vector<int> next(first_.begin(), first_.end() - 1);
  each([&](std::size_t t, int i) { members_[static_cast<std::size_t>(next[t]++)] = i; });
}

Hit Caster::cast(int column, int row, const Vector2d& direction) const {
  Hit hit;
  if (column < 0 || row < 0 || !(direction.x() == direction.x())) return hit;
  const int x = std::min(column / tile, tiles_across_ - 1);
  const int y = std::min(row / tile, tiles_down_ - 1);
  const std::size_t t = static_cast<std::size_t>(y) * tiles_across_ + x;
  const Vector3d d(direction.x(), direction.y(), 1);
  for (int k = first_[t]; k < first_[t + 1]; ++k) {
    const Packed& p = packed_[members_[k]];
    const double w0 = p.n0.dot(d), w1 = p.n1.dot(d), w2 = p.n2.dot(d);
    const double sum = w0 + w1 + w2;
    if (sum == 0) continue;
    // Tolerance that keeps a ray along a shared edge from slipping between both triangles.
    constexpr double slack = -1e-10;
    const double b0 = w0 / sum, b1 = w1 / sum, b2 = w2 / sum;
    if (b0 < slack || b1 < slack || b2 < slack) continue;
    const double depth = p.determinant / sum;
    if (depth <= 0 || (hit.is_hit() && depth >= hit.depth_m)) continue;
    hit = {members_[k], b1, b2, depth, p.determinant > 0};
  }
  return hit;
}

FacePoint Caster::face(const Hit& hit) const {
  const auto& face = triangles_[hit.triangle].face;
  return face[0] + hit.b1 * (face[1] - face[0]) + hit.b2 * (face[2] - face[0]);
}

Vector3d Caster::normal_in_world(const Hit& hit) const {
  const auto& n = triangles_[hit.triangle].normals_in_world;
  return ((1 - hit.b1 - hit.b2) * n[0] + hit.b1 * n[1] + hit.b2 * n[2]).normalized();
}

/// Renders rows of pixels of one view.
class Painter {
 public:
  Painter(const SceneView& view, const RenderOptions& options)
      : view_(view),
        caster_(view.caster_),
        options_(options),
        towards_light_(options.towards_light_in_world.normalized()) {}

  void paint_band(int first_row, int last_row, std::vector<double>& light) const {
    const int width = view_.rays_.width();
    std::vector<Hit> above, below(width + 1);
    const auto fill = [&](int row, std::vector<Hit>& hits) {
      hits.resize(width + 1);
      for (int column = 0; column <= width; ++column) {
        hits[column] =
            caster_.cast(std::min(column, width - 1), std::min(row, view_.rays_.height() - 1),
                         view_.rays_.corner(column, row));
      }
    };
    fill(first_row, above);
    for (int row = first_row; row < last_row; ++row) {
      fill(row + 1, below);
      for (int column = 0; column < width; ++column) {
        light[static_cast<std::size_t>(row) * width + column] = pixel(
            column, row, {above[column], above[column + 1], below[column + 1], below[column]});
      }
      std::swap(above, below);
    }
  }

 private:
  using Corners = std::array<Hit, 4>;

  [[nodiscard]] double pixel(int column, int row, const Corners& corners) const {
    const bool any = std::ranges::any_of(corners, [](const Hit& hit) { return hit.is_hit(); });
    if (!any) return options_.background_grey;
    if (!is_one_surface(corners, 1)) return mixed_pixel(column, row);
    const Hit centre = hit_at(column, row, column, row);
    if (!centre.is_hit()) return mixed_pixel(column, row);
    const double bare = bare_light(centre, column);
    if (!is_print_side(centre)) return bare;
    const FaceCell cell = cell_of(corners);
    if (!view_.scene_.pattern.has_edge_in(cell)) {
      return bare * ink(view_.scene_.pattern.is_printed(caster_.face(centre)) ? 1 : 0);
    }
    return bare * printed_pixel(column, row);
  }

  [[nodiscard]] bool is_print_side(const Hit& hit) const {
    return caster_.triangle(hit).printed && hit.front;
  }

  [[nodiscard]] FaceCell cell_of(const Corners& corners) const {
    return {caster_.face(corners[0]), caster_.face(corners[1]), caster_.face(corners[2]),
            caster_.face(corners[3])};
  }

  /// True if all corners lie on one smooth side of a sheet, or on bare objects of similar depth.
  [[nodiscard]] bool is_one_surface(const Corners& corners, double side_px) const {
    for (const Hit& hit : corners) {
      if (!hit.is_hit() || hit.front != corners[0].front ||
          caster_.triangle(hit).printed != caster_.triangle(corners[0]).printed) {
        return false;
      }
    }
    const double longest = most_oblique * side_px * corners[0].depth_m / view_.rays_.focal_px();
    const bool printed = caster_.triangle(corners[0]).printed;
    for (std::size_t k = 0; k < 4; ++k) {
      const Hit& a = corners[k];
      const Hit& b = corners[(k + 1) % 4];
      const double jump =
          printed ? (caster_.face(a) - caster_.face(b)).norm() : std::abs(a.depth_m - b.depth_m);
      if (jump > longest) return false;
    }
    return true;
  }

  [[nodiscard]] Hit hit_at(int column, int row, double u, double v) const {
    return caster_.cast(column, row, view_.rays_.direction(u, v));
  }

  [[nodiscard]] double ink(double fraction) const {
    return 1 - fraction * (1 - options_.ink_ratio);
  }

  /// Mean ink coverage of a pixel, from exact areas of its cells.
  [[nodiscard]] double printed_pixel(int column, int row) const {
    std::array<Hit, (parts + 1) * (parts + 1)> hits;
    for (int j = 0; j <= parts; ++j) {
      for (int i = 0; i <= parts; ++i) {
        hits[j * (parts + 1) + i] = caster_.cast(
            column, row, view_.rays_.within(column, row, i / double(parts), j / double(parts)));
      }
    }
    double sum = 0;
    for (int j = 0; j < parts; ++j) {
      for (int i = 0; i < parts; ++i) {
        const int k = j * (parts + 1) + i;
        sum += cell_ink(column, row, i, j,
                        {hits[k], hits[k + 1], hits[k + parts + 2], hits[k + parts + 1]});
      }
    }
    return sum / (parts * parts);
  }

  /// Ink in cell (i, j) of a pixel. Halves the cell again if an edge runs through it, so that
  /// curvature of the surface within the cell is negligible.
  [[nodiscard]] double cell_ink(int column, int row, int i, int j, const Corners& corners) const {
    if (!is_one_surface(corners, 1.0 / parts) || !is_print_side(corners[0])) {
      const Hit& hit = corners[0];
      if (!hit.is_hit() || !is_print_side(hit)) return 1;
      return ink(view_.scene_.pattern.is_printed(caster_.face(hit)) ? 1 : 0);
    }
    const FaceCell cell = cell_of(corners);
    if (!view_.scene_.pattern.has_edge_in(cell)) {
      return ink(view_.scene_.pattern.is_printed((cell[0] + cell[2]) / 2) ? 1 : 0);
    }
    const auto at = [&](double x, double y) {
      return caster_.cast(column, row,
                          view_.rays_.within(column, row, (i + x) / parts, (j + y) / parts));
    };
    const Hit top = at(0.5, 0), left = at(0, 0.5), middle = at(0.5, 0.5), right = at(1, 0.5),
              bottom = at(0.5, 1);
    double fraction = 0;
    for (const Corners& quarter :
         {Corners{corners[0], top, middle, left}, Corners{top, corners[1], right, middle},
          Corners{middle, right, corners[2], bottom}, Corners{left, middle, bottom, corners[3]}}) {
      const bool whole = is_one_surface(quarter, 1.0 / parts);
      fraction += view_.scene_.pattern.coverage(whole ? cell_of(quarter) : cell) / 4;
    }
    return ink(fraction);
  }

  /// Samples the parts of a pixel one by one if a silhouette crosses it.
  [[nodiscard]] double mixed_pixel(int column, int row) const {
    constexpr int samples = 2 * parts;
    double sum = 0;
    for (int j = 0; j < samples; ++j) {
      for (int i = 0; i < samples; ++i) {
        const Hit hit = caster_.cast(
            column, row, view_.rays_.within(column, row, (i + 0.5) / samples, (j + 0.5) / samples));
        if (!hit.is_hit()) {
          sum += options_.background_grey;
          continue;
        }
        const bool printed =
            is_print_side(hit) && view_.scene_.pattern.is_printed(caster_.face(hit));
        sum += bare_light(hit, column) * ink(printed ? 1 : 0);
      }
    }
    return sum / (samples * samples);
  }

  /// Brightness of the unprinted surface: diffuse, with directional and ambient light.
  [[nodiscard]] double bare_light(const Hit& hit, double u) const {
    const Triangle& triangle = caster_.triangle(hit);
    Vector3d normal = caster_.normal_in_world(hit);
    if (triangle.printed && !hit.front) normal = -normal;
    const double lit = std::max(0.0, normal.dot(towards_light_));
    const double shade = options_.ambient + (1 - options_.ambient) * lit;
    const double texture = triangle.printed ? weave(caster_.face(hit), options_) : 1;
    return options_.white_grey * triangle.reflectance * shade * texture *
           ramp(u, options_.gradient_per_px);
  }

  const SceneView& view_;
  const Caster& caster_;
  const RenderOptions& options_;
  Vector3d towards_light_;
};

void fields(Fields& f, RenderOptions& o) {
  f.otherwise({"white_grey", "grey level of the bare cloth", 1, 1, 255}, o.white_grey);
  f.otherwise({"ink_ratio", "grey level of the print relative to that of the cloth", 1, 0, 0.99},
              o.ink_ratio);
  f.otherwise({"blur_px", "standard deviation of the lens's blur", 1, 0}, o.blur_px);
  f.otherwise({"noise_grey", "standard deviation of the noise at grey level 128", 1, 0},
              o.noise_grey);
  f.otherwise({"gradient_percent_per_px", "gradient of the lighting", units::percent, 0},
              o.gradient_per_px);
  f.otherwise({"weave_percent", "contrast of the weave's texture, RMS", units::percent, 0},
              o.weave_rms);
  f.otherwise({"seed", "seed of noise, weave, poses and folds"}, o.seed);
}

SceneView::SceneView(const SyntheticScene& scene, const Camera& camera, const PixelRays& rays)
    : scene_(scene),
      camera_(camera),
      rays_(rays),
      triangles_(all_triangles(scene)),
      caster_(camera_, triangles_) {}

Hit SceneView::cast(const Vector2d& px) const {
  const int column = static_cast<int>(std::floor(px.x() + 0.5));
  const int row = static_cast<int>(std::floor(px.y() + 0.5));
  if (column < 0 || row < 0 || column >= rays_.width() || row >= rays_.height()) return {};
  return caster_.cast(column, row, rays_.direction(px.x(), px.y()));
}

std::vector<double> SceneView::light(const RenderOptions& options) const {
  const int height = rays_.height();
  std::vector<double> result(static_cast<std::size_t>(rays_.width()) * height);
  const Painter painter(*this, options);
  const auto bands = static_cast<std::size_t>((height + band - 1) / band);
  parallel_for(bands, options.threads, [&](std::size_t k) {
    const int first = static_cast<int>(k) * band;
    painter.paint_band(first, std::min(height, first + band), result);
  });
  return result;
}

GreyPicture expose(const std::vector<double>& light, int width_px, int height_px,
                   std::uint64_t frame, const RenderOptions& options) {
  std::vector<double> level = light;
  if (options.blur_px > 0) {
    const auto weights = kernel(options.blur_px);
    level = blurred_and_turned(level, width_px, height_px, weights, options.threads);
    level = blurred_and_turned(level, height_px, width_px, weights, options.threads);
  }
  GreyPicture picture{width_px, height_px, std::vector<std::uint8_t>(level.size())};
  const std::uint64_t stream = mixed(options.seed) ^ mixed(frame + 0x517cc1b7ULL);
  parallel_for(static_cast<std::size_t>(height_px), options.threads, [&](std::size_t y) {
    for (std::size_t i = y * width_px; i < (y + 1) * width_px; ++i) {
      const double sigma =
          options.noise_grey * std::sqrt(0.5 + 0.5 * std::max(0.0, level[i]) / 128);
      const double noisy = level[i] + (sigma > 0 ? sigma * normal(stream, i) : 0);
      picture.bytes[i] = static_cast<std::uint8_t>(std::clamp(std::lround(noisy), 0L, 255L));
    }
  });
  return picture;
}

}  // namespace drape::synth
