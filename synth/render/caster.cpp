// SPDX-License-Identifier: Apache-2.0
#include "synth/render/caster.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace drape::synth {

using Eigen::Vector2d;
using Eigen::Vector3d;

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

}  // namespace drape::synth
