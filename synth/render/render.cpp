// SPDX-License-Identifier: Apache-2.0
#include "synth/render/render.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.hpp"
#include "core/units.hpp"
#include "synth/random.hpp"

namespace drape::synth {

namespace {

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

constexpr int parts = 4;             // subdivisions of a pixel per side where the print has an edge
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
    const bool any =
        std::any_of(corners.begin(), corners.end(), [](const Hit& hit) { return hit.is_hit(); });
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

  /// True if all corners lie on one smooth side of a sheet, or on unprinted objects of like depth.
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

  /// Ink in cell (i, j) of a pixel. The cell is halved again if an edge runs through it, so that
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
