// SPDX-License-Identifier: Apache-2.0
#include "synth/truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::synth {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::optional<Vector2d> image_of(const GridSurface& surface, const Camera& camera,
                                 const FacePoint& face) {
  const auto point = surface.point_in_world(face);
  if (!point) return std::nullopt;
  const auto image = project(camera.model, camera.cam_from_world * *point);
  if (!image) return std::nullopt;
  return image->px;
}

/// True if the camera sees this point of the face unoccluded.
bool is_seen(const GridSurface& surface, const SceneView& view, const FacePoint& face) {
  const auto point = surface.point_in_world(face);
  if (!point) return false;
  const Vector3d in_camera = view.camera().cam_from_world * *point;
  const auto image = project(view.camera().model, in_camera);
  if (!image) return false;
  const Hit hit = view.cast(image->px);
  constexpr double slack_m = 2e-5;
  return hit.is_hit() && hit.front && std::abs(hit.depth_m - in_camera.z()) < slack_m;
}

/// Visible fraction of a dot, sampled at its centre and on rings out to its outline.
double seen_fraction(const GridSurface& surface, const SceneView& view, const MarkOnFace& mark) {
  constexpr int rings = 3, around = 16;
  int seen = is_seen(surface, view, mark.centre) ? 1 : 0, all = 1;
  for (int ring = 1; ring <= rings && mark.radius_m > 0; ++ring) {
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      const FacePoint offset(std::cos(angle), std::sin(angle));
      seen += is_seen(surface, view, mark.centre + mark.radius_m * ring / rings * offset) ? 1 : 0;
      ++all;
    }
  }
  return seen / static_cast<double>(all);
}

template <class Sheet>
std::vector<MarkOnFace> all_marks(const Sheet& sheet) {
  std::vector<MarkOnFace> marks;
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col)
      marks.push_back({{row, col}, face_point(sheet, {row, col}), sheet.dot_diameter_m / 2});
  }
  return marks;
}

}  // namespace

void fields(Fields& f, TrueMarkView& view) {
  f(Field{"camera", "name of the camera"}.plain_name(), view.camera);
  f({"px", "image of the mark's centre; null if not in front of the camera"}, view.px);
  f({"centroid_px", "centroid of the mark's area in the image"}, view.centroid_px);
  f({"facing_deg", "angle between the printed side's normal and the ray to the camera", units::deg,
     0, 180},
    view.facing_rad);
  f({"visible_share", "fraction of the mark that is inside the picture and not hidden", 1, 0, 1},
    view.visible_fraction);
}

void fields(Fields& f, TrueMark& mark) {
  f({"row", "row of the mark", 1, 0}, mark.mark.row);
  f({"col", "column of the mark", 1, 0}, mark.mark.col);
  f({"xyz_mm", "position in the world", units::mm}, mark.point_in_world);
  f({"normal_in_world", "unit normal on the printed side"}, mark.normal_in_world);
  f({"views", "the mark in each camera's picture"}, mark.views);
}

std::vector<MarkOnFace> marks_of(const Print& print) {
  return all_marks(print);
}

std::vector<MarkOnFace> marks_of(const Target& target) {
  return all_marks(target);
}

std::optional<Vector2d> disc_centroid_px(const GridSurface& surface, const Camera& camera,
                                         const FacePoint& centre, double radius_m) {
  constexpr int nodes = 720;
  const auto middle = image_of(surface, camera, centre);
  if (!middle) return std::nullopt;
  const auto corner = [&](int k) {
    const double angle = 2 * std::numbers::pi * k / nodes;
    return image_of(surface, camera,
                    centre + radius_m * FacePoint(std::cos(angle), std::sin(angle)));
  };
  auto last = corner(nodes - 1);
  double twice = 0;
  Vector2d moment = Vector2d::Zero();
  for (int k = 0; k < nodes; ++k) {
    const auto next = corner(k);
    if (!last || !next) return std::nullopt;
    const Vector2d a = *last - *middle, b = *next - *middle;
    const double wedge = cross(a, b);
    twice += wedge;
    moment += wedge * (a + b) / 3;
    last = next;
  }
  const Vector2d offset = moment / twice;
  if (!offset.allFinite()) return std::nullopt;
  return Vector2d(*middle + offset);
}

std::vector<TrueMark> truth_of(const SyntheticScene& scene, const std::vector<MarkOnFace>& marks,
                               const std::vector<const SceneView*>& views) {
  std::vector<TrueMark> truth;
  for (const MarkOnFace& mark : marks) {
    const auto point = scene.surface.point_in_world(mark.centre);
    if (!point) {
      throw bad_input(
          fmt::format("mark ({}, {}) lies beyond the surface", mark.mark.row, mark.mark.col), {},
          "give a surface that reaches as far as the print");
    }
    TrueMark known{mark.mark, *point, scene.surface.normal_in_world(mark.centre), {}};
    for (const SceneView* view : views) {
      TrueMarkView seen;
      const Camera& camera = view->camera();
      seen.camera = camera.name;
      seen.px = image_of(scene.surface, camera, mark.centre);
      seen.centroid_px = mark.radius_m > 0
                             ? disc_centroid_px(scene.surface, camera, mark.centre, mark.radius_m)
                             : seen.px;
      const Vector3d to_camera = (centre_in_world(camera) - *point).normalized();
      seen.facing_rad = std::acos(std::clamp(to_camera.dot(known.normal_in_world), -1.0, 1.0));
      seen.visible_fraction = seen_fraction(scene.surface, *view, mark);
      known.views.push_back(seen);
    }
    truth.push_back(known);
  }
  return truth;
}

}  // namespace drape::synth
