// SPDX-License-Identifier: Apache-2.0
#include "tests/conformance/board_picture.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/units.hpp"

namespace drape::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCell_m = 2 * units::mm;
constexpr float kDark = 40, kLight = 200;

/// The marks of a page sorted into cells of 2 mm, for fast look-up.
class Paper {
 public:
  explicit Paper(const Page& page)
      : cols_(static_cast<int>(page.size_m.x() / kCell_m) + 1),
        rows_(static_cast<int>(page.size_m.y() / kCell_m) + 1),
        cells_(static_cast<std::size_t>(cols_) * rows_) {
    for (const auto& item : page.items) {
      if (const auto* area = std::get_if<PageArea>(&item)) {
        for (const PageBox& box : area->boxes) add({box.corner_m, box.size_m, false});
      } else if (const auto* disc = std::get_if<PageDisc>(&item)) {
        const Vector2d half = Vector2d::Constant(disc->radius_m);
        add({disc->centre_m - half, 2 * half, true});
      }
    }
  }

  [[nodiscard]] bool dark(const Vector2d& at) const {
    const int x = static_cast<int>(std::floor(at.x() / kCell_m));
    const int y = static_cast<int>(std::floor(at.y() / kCell_m));
    if (x < 0 || y < 0 || x >= cols_ || y >= rows_) return false;
    for (const Shape& shape : cells_[static_cast<std::size_t>(y) * cols_ + x]) {
      const Vector2d in = (at - shape.corner).cwiseQuotient(shape.size);
      if (shape.round ? (in.array() - 0.5).matrix().squaredNorm() < 0.25
                      : in.minCoeff() >= 0 && in.maxCoeff() < 1)
        return true;
    }
    return false;
  }

 private:
  struct Shape {
    Vector2d corner, size;
    bool round;
  };

  void add(const Shape& shape) {
    const auto cell = [](double metres) { return static_cast<int>(std::floor(metres / kCell_m)); };
    const Vector2d end = shape.corner + shape.size;
    for (int y = std::max(0, cell(shape.corner.y())); y <= std::min(rows_ - 1, cell(end.y())); ++y)
      for (int x = std::max(0, cell(shape.corner.x())); x <= std::min(cols_ - 1, cell(end.x()));
           ++x)
        cells_[static_cast<std::size_t>(y) * cols_ + x].push_back(shape);
  }

  int cols_, rows_;
  std::vector<std::vector<Shape>> cells_;
};

/// Points of the page hit by the rays through a camera's pixel corners.
class Rays {
 public:
  Rays(const PrintedPage& printed, const Camera& camera, const std::vector<Vector3d>& rays,
       const WorldFromTarget& world_from_target)
      : width_(camera.model.width_px + 1) {
    const Eigen::Matrix3d target_from_world = world_from_target.rotation.transpose();
    const Vector3d eye =
        target_from_world * (centre_in_world(camera) - world_from_target.translation_m);
    const Eigen::Matrix3d target_from_camera =
        target_from_world * camera.cam_from_world.rotation.transpose();
    for (const Vector3d& in_camera : rays) {
      const Vector3d ray = target_from_camera * in_camera;
      const Vector3d on_target = eye - eye.z() / ray.z() * ray;
      on_page_.emplace_back(printed.face_m + Vector2d(on_target.x(), -on_target.y()));
    }
  }

  /// Upper left corner of a pixel.
  [[nodiscard]] const Vector2d& at(int u, int v) const {
    return on_page_[static_cast<std::size_t>(v) * width_ + u];
  }

  [[nodiscard]] Vector2d within(int u, int v, double right, double down) const {
    return (1 - down) * ((1 - right) * at(u, v) + right * at(u + 1, v)) +
           down * ((1 - right) * at(u, v + 1) + right * at(u + 1, v + 1));
  }

 private:
  int width_;
  std::vector<Vector2d> on_page_;
};

float light_of(const Paper& paper, const Rays& rays, int u, int v) {
  const bool first = paper.dark(rays.at(u, v));
  if (first == paper.dark(rays.at(u + 1, v)) && first == paper.dark(rays.at(u, v + 1)) &&
      first == paper.dark(rays.at(u + 1, v + 1)) &&
      first == paper.dark(rays.within(u, v, 0.5, 0.5)))
    return first ? kDark : kLight;
  constexpr int kSamples = 8;
  int dark = 0;
  for (int k = 0; k < kSamples * kSamples; ++k) {
    const int col = k % kSamples, row = k / kSamples;
    const double right = (col + 0.5) / kSamples, down = (row + 0.5) / kSamples;
    dark += paper.dark(rays.within(u, v, right, down)) ? 1 : 0;
  }
  return kLight + (kDark - kLight) * static_cast<float>(dark) / (kSamples * kSamples);
}

}  // namespace

std::vector<Vector3d> corner_rays(const Camera& camera) {
  std::vector<Vector3d> rays;
  for (int v = 0; v <= camera.model.height_px; ++v) {
    for (int u = 0; u <= camera.model.width_px; ++u)
      rays.push_back(*unproject(camera.model, {u - 0.5, v - 0.5}));
  }
  return rays;
}

cv::Mat picture_of(const PrintedPage& printed, const Camera& camera,
                   const std::vector<Vector3d>& rays, const WorldFromTarget& world_from_target,
                   unsigned seed) {
  const Paper paper(printed.page);
  const Rays on_page(printed, camera, rays, world_from_target);
  cv::Mat light(camera.model.height_px, camera.model.width_px, CV_32F), blurred;
  for (int v = 0; v < light.rows; ++v)
    for (int u = 0; u < light.cols; ++u) light.at<float>(v, u) = light_of(paper, on_page, u, v);
  cv::GaussianBlur(light, blurred, {}, 0.6);
  cv::RNG random(seed);
  cv::Mat noise(light.size(), CV_32F), picture;
  random.fill(noise, cv::RNG::NORMAL, 0, 1.5);
  cv::Mat(blurred + noise).convertTo(picture, CV_8U);
  return picture;
}

}  // namespace drape::test
