// SPDX-License-Identifier: Apache-2.0
#include "tests/figure4/picture.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/drawing/svg.hpp"

namespace drape::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Picture units; the scales are per metre.
constexpr double kPanel = 330, kHeight = 600, kScale = 1650, kSphereRow = 150;
constexpr double kPlanScale = 1300, kPlanRow = 440;
constexpr double kUnderCloth_m = 0.015;  // puts the sphere's faces behind the cloth that lies on it

/// Orthographic view from above, from the side of the patch between warp and weft.
struct View {
  Vector3d right = Vector3d(-0.5, 0.866, 0).normalized();
  Vector3d toward = Vector3d(0.74, 0.427, 0.52).normalized();
  Vector3d up = toward.cross(right);
};

struct Face {
  double nearness = 0;
  std::vector<Vector3d> corners;
  bool cloth = true;
};

void add_sphere(const Sphere& sphere, const View& view, std::vector<Face>& faces) {
  constexpr int kMeridians = 24, kParallels = 12;
  const auto at = [&](int i, int j) {
    const double turn = 2 * std::numbers::pi * i / kMeridians,
                 down = std::numbers::pi * j / kParallels;
    return Vector3d(sphere.centre_in_world +
                    sphere.radius_m * Vector3d(std::sin(down) * std::cos(turn),
                                               std::sin(down) * std::sin(turn), std::cos(down)));
  };
  for (int i = 0; i < kMeridians; ++i) {
    for (int j = 0; j < kParallels; ++j) {
      const Vector3d middle = (at(i, j) + at(i + 1, j + 1)) / 2;
      if (view.toward.dot(middle - sphere.centre_in_world) > 0)
        faces.push_back({view.toward.dot(middle) - kUnderCloth_m,
                         {at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)},
                         false});
    }
  }
}

std::string colour(const Face& face, const View& view) {
  const std::vector<Vector3d>& p = face.corners;
  Vector3d normal = (p[1] - p[0]).cross(p.back() - p[0]);
  if (normal.norm() == 0) normal = (p[2] - p[1]).cross(p[3] - p[1]);
  if (normal.dot(view.toward) < 0) normal = -normal;
  const Vector3d light = (view.toward + 0.6 * view.up - 0.7 * view.right).normalized();
  const double shade = 0.35 + 0.65 * std::max(0.0, normal.normalized().dot(light));
  const Vector3d full = face.cloth ? Vector3d(214, 226, 242) : Vector3d(226, 170, 110);
  const Eigen::Vector3i c = (shade * full).array().round().cast<int>();
  return fmt::format("fill=\"#{:02x}{:02x}{:02x}\"", c.x(), c.y(), c.z());
}

/// A point rounded to a tenth of a unit, which keeps the file small.
Vector2d rounded(double x, double y) {
  return {std::round(x * 10) / 10, std::round(y * 10) / 10};
}

/// Draws far faces first (painter's algorithm).
void draw_sheet(Svg& svg, const SphereDrape& drape, const Sphere& sphere, double middle) {
  const View view;
  std::vector<Face> faces;
  add_sphere(sphere, view, faces);
  for (const std::vector<int>& face : drape.faces) {
    Face item;
    for (const int i : face) {
      item.corners.push_back(drape.points_m[i]);
      item.nearness += view.toward.dot(drape.points_m[i]) / static_cast<double>(face.size());
    }
    faces.push_back(std::move(item));
  }
  std::stable_sort(faces.begin(), faces.end(),
                   [](const Face& a, const Face& b) { return a.nearness < b.nearness; });
  svg.open_group("stroke=\"#456\" stroke-width=\"0.4\" stroke-linejoin=\"round\"");
  for (const Face& face : faces) {
    std::vector<Vector2d> corners;
    for (const Vector3d& p : face.corners) {
      const Vector3d from = p - sphere.centre_in_world;
      corners.push_back(
          rounded(middle + kScale * view.right.dot(from), kSphereRow - kScale * view.up.dot(from)));
    }
    svg.polygon(corners, colour(face, view));
  }
  svg.close_group();
}

void draw_hem(Svg& svg, const SphereDrape& drape, double middle) {
  // The warp runs along -y in world, so the mirror u -> -u is y -> -y.
  std::vector<Vector2d> hem, image;
  for (const int i : drape.hem) {
    const Vector3d& p = drape.points_m[i];
    hem.push_back(rounded(middle + kPlanScale * p.x(), kPlanRow - kPlanScale * p.y()));
    image.push_back(rounded(middle + kPlanScale * p.x(), kPlanRow + kPlanScale * p.y()));
  }
  svg.polygon(image, "fill=\"none\" stroke=\"#c40\" stroke-width=\"1.5\"");
  svg.polygon(hem, "fill=\"none\" stroke=\"#000\"");
}

}  // namespace

std::string svg_of(const std::vector<Panel>& panels, const Sphere& sphere) {
  const double width = kPanel * static_cast<double>(panels.size());
  Svg svg(width, kHeight, "One cloth over a sphere by quads and by triangles (Fig. 4)");
  svg.rectangle(0, 0, width, kHeight, "fill=\"#fff\"");
  double middle = kPanel / 2;
  for (const Panel& panel : panels) {
    draw_sheet(svg, panel.drape, sphere, middle);
    draw_hem(svg, panel.drape, middle);
    svg.text({middle, 20}, panel.title, 15, "middle");
    svg.text({middle, kHeight - 12}, panel.note, 13, "middle");
    middle += kPanel;
  }
  return svg.finish();
}

}  // namespace drape::test
