// SPDX-License-Identifier: Apache-2.0
#include "detect/cloth_picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <variant>

#include "core/units.hpp"
#include "detect/prints/layout.hpp"

namespace drape::test {

using namespace detect;

namespace {

constexpr int ink_per_mm = 20;
constexpr double step_mm = 0.05;  // along the weft and across the picture
constexpr int samples = 4;        // per side of a pixel
constexpr double table_level = 0.15;

using units::mm;

}  // namespace

ClothPicture::ClothPicture(const Print& print, const ClothView& view)
    : print_(print),
      view_(view),
      turn_(Eigen::Rotation2D<double>(view.turn_rad).toRotationMatrix()) {
  side_x_ = static_cast<int>(std::lround(print.patch_m.y() / mm * ink_per_mm));
  side_y_ = static_cast<int>(std::lround(print.patch_m.x() / mm * ink_per_mm));
  cv::Mat ink(side_y_, side_x_, CV_8U, cv::Scalar(0));
  PrintOptions fit;
  fit.paper = "fit";
  const PrintedPage printed = page_of(print, fit);
  const Eigen::Vector2d corner =
      printed.first_m - Eigen::Vector2d(print.margin_m.y(), print.margin_m.x());
  const auto at = [&](const Eigen::Vector2d& page_m) -> Eigen::Vector2d {
    return (page_m - corner) / mm * ink_per_mm;
  };
  for (const auto& item : printed.page.items) {
    if (const auto* disc = std::get_if<PageDisc>(&item)) {
      const Eigen::Vector2d c = at(disc->centre_m);
      const double r = disc->radius_m / mm * ink_per_mm;
      for (int y = static_cast<int>(c.y() - r) - 1; y <= c.y() + r + 1; ++y) {
        for (int x = static_cast<int>(c.x() - r) - 1; x <= c.x() + r + 1; ++x) {
          if (x < 0 || y < 0 || x >= side_x_ || y >= side_y_) continue;
          if (std::hypot(x + 0.5 - c.x(), y + 0.5 - c.y()) <= r) {
            ink.at<unsigned char>(y, x) = disc->dark ? 1 : 0;
          }
        }
      }
    }
    if (const auto* area = std::get_if<PageArea>(&item)) {
      for (const PageBox& box : area->boxes) {
        const Eigen::Vector2d a = at(box.corner_m), b = at(box.corner_m + box.size_m);
        const cv::Rect whole(0, 0, side_x_, side_y_);
        const cv::Rect part(cv::Point(cvRound(a.x()), cvRound(a.y())),
                            cv::Point(cvRound(b.x()), cvRound(b.y())));
        if ((part & whole).area() > 0) ink(part & whole).setTo(1);
      }
    }
  }
  ink_.assign(ink.datastart, ink.dataend);
  // The weft's curve in the picture and its height, then who is uppermost where.
  double along = 0, height = 0;
  const double length_mm = print.patch_m.y() / mm;
  const auto steps = static_cast<int>(length_mm / step_mm);
  for (int k = 0; k <= steps; ++k) {
    along_mm_.push_back(along);
    height_mm_.push_back(height);
    const double slope = view.slope_rad(k * step_mm);
    along += std::cos(slope) * step_mm;
    height += std::sin(slope) * step_mm;
  }
  first_along_mm_ = *std::min_element(along_mm_.begin(), along_mm_.end());
  const double last = *std::max_element(along_mm_.begin(), along_mm_.end());
  front_mm_.assign(static_cast<std::size_t>((last - first_along_mm_) / step_mm) + 2, -1.0);
  std::vector<double> top(front_mm_.size(), -1e9);
  for (std::size_t k = 0; k + 1 < along_mm_.size(); ++k) {
    const auto bin = static_cast<std::size_t>((along_mm_[k] - first_along_mm_) / step_mm);
    if (height_mm_[k] <= top[bin]) continue;
    top[bin] = height_mm_[k];
    front_mm_[bin] = static_cast<double>(k) * step_mm;
  }
  for (std::size_t bin = 1; bin + 1 < front_mm_.size(); ++bin) {
    if (front_mm_[bin] < 0) front_mm_[bin] = front_mm_[bin - 1];
  }
}

void ClothPicture::wipe(const Eigen::Vector2d& at_mm, double radius_mm) {
  cv::Mat ink(side_y_, side_x_, CV_8U, ink_.data());
  cv::circle(ink, cv::Point(cvRound(at_mm.x() * ink_per_mm), cvRound(at_mm.y() * ink_per_mm)),
             cvRound(radius_mm * ink_per_mm), 0, cv::FILLED);
}

void ClothPicture::stain(const Eigen::Vector2d& at_mm, double radius_mm) {
  cv::Mat ink(side_y_, side_x_, CV_8U, ink_.data());
  cv::circle(ink, cv::Point(cvRound(at_mm.x() * ink_per_mm), cvRound(at_mm.y() * ink_per_mm)),
             cvRound(radius_mm * ink_per_mm), 1, cv::FILLED);
}

void ClothPicture::mirror(const Eigen::Vector2d& at_mm, double half_edge_mm) {
  cv::Mat ink(side_y_, side_x_, CV_8U, ink_.data());
  const int half = cvRound(half_edge_mm * ink_per_mm);
  const cv::Rect part(cvRound(at_mm.x() * ink_per_mm) - half,
                      cvRound(at_mm.y() * ink_per_mm) - half, 2 * half, 2 * half);
  cv::Mat flipped;
  cv::flip(ink(part), flipped, 1);
  flipped.copyTo(ink(part));
}

Eigen::Vector2d ClothPicture::to_px(double along_mm, double warp_mm) const {
  const double middle_x =
      0.5 * (first_along_mm_ + first_along_mm_ + static_cast<double>(front_mm_.size()) * step_mm);
  const Eigen::Vector2d flat(along_mm - middle_x,
                             view_.squeeze * (warp_mm - print_.patch_m.x() / mm / 2));
  const Eigen::Vector2d ideal = view_.px_per_mm * (turn_ * flat);
  Eigen::Vector2d distorted = ideal;
  for (int k = 0; k < 50; ++k) {
    distorted = ideal / (1 + view_.kappa_per_px2 * distorted.squaredNorm());
  }
  return distorted + Eigen::Vector2d(view_.width_px - 1, view_.height_px - 1) / 2;
}

std::optional<Eigen::Vector2d> ClothPicture::place_at(const Eigen::Vector2d& px) const {
  const Eigen::Vector2d from_middle =
      px - Eigen::Vector2d(view_.width_px - 1, view_.height_px - 1) / 2;
  const Eigen::Vector2d ideal = from_middle * (1 + view_.kappa_per_px2 * from_middle.squaredNorm());
  const Eigen::Vector2d flat = turn_.transpose() * ideal / view_.px_per_mm;
  const double across =
      (flat.x() + 0.5 * static_cast<double>(front_mm_.size()) * step_mm) / step_mm;
  const double warp = flat.y() / view_.squeeze + print_.patch_m.x() / mm / 2;
  if (across < 0 || across >= static_cast<double>(front_mm_.size()) - 1 || warp < 0 ||
      warp >= print_.patch_m.x() / mm) {
    return std::nullopt;
  }
  const double weft = front_mm_[static_cast<std::size_t>(across)];
  if (weft < 0) return std::nullopt;
  // The bin's weft distance lies where the cloth passes it; the remainder is straight.
  const auto k = static_cast<std::size_t>(std::lround(weft / step_mm));
  const double rest = across * step_mm + first_along_mm_ - along_mm_[k];
  const double forward = std::cos(view_.slope_rad(weft));
  const double exact = weft + (std::abs(forward) > 0.2 ? rest / forward : 0.0);
  return Eigen::Vector2d(std::clamp(exact, 0.0, print_.patch_m.y() / mm), warp);
}

Eigen::Vector2d ClothPicture::place_mm(MarkId mark) const {
  const Eigen::Vector2d material = print_.material_m(mark) / mm;
  return {material.y(), material.x()};
}

std::optional<Eigen::Vector2d> ClothPicture::seen_px(MarkId mark) const {
  const Eigen::Vector2d place = place_mm(mark);
  const double radius = print_.dot_diameter_m / mm / 2;
  const auto along = [&](double weft) {
    const auto k = static_cast<std::size_t>(std::lround(weft / step_mm));
    return along_mm_[std::min(k, along_mm_.size() - 1)];
  };
  for (const double part : {-0.5, 0.0, 0.5}) {
    const double weft = place.x() + part * radius;
    const auto bin = static_cast<std::size_t>((along(weft) - first_along_mm_) / step_mm);
    if (std::abs(front_mm_[bin] - weft) > 0.5) return std::nullopt;
  }
  return to_px(along(place.x()), place.y());
}

GreyImage ClothPicture::draw() const {
  cv::Mat picture(view_.height_px, view_.width_px, CV_64F);
  for (int v = 0; v < view_.height_px; ++v) {
    for (int u = 0; u < view_.width_px; ++u) {
      double fraction = 0;
      for (int k = 0; k < samples * samples; ++k) {
        const int right = k % samples, down = k / samples;
        const auto place =
            place_at({u - 0.5 + (right + 0.5) / samples, v - 0.5 + (down + 0.5) / samples});
        double level = table_level;
        if (place) {
          const int x = std::min(static_cast<int>(place->x() * ink_per_mm), side_x_ - 1);
          const int y = std::min(static_cast<int>(place->y() * ink_per_mm), side_y_ - 1);
          level = ink_[static_cast<std::size_t>(y) * side_x_ + x] != 0 ? view_.dark / view_.bright
                                                                       : 1.0;
        }
        fraction += level / (samples * samples);
      }
      const double slope = 1 + view_.light_slope_per_px * (u - view_.width_px / 2.0);
      picture.at<double>(v, u) = view_.bright * fraction * slope * view_.light(u, v);
    }
  }
  cv::GaussianBlur(picture, picture, {}, view_.blur_px);
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0, view_.noise);
  GreyImage image{view_.width_px, view_.height_px, {}, {}};
  for (int v = 0; v < view_.height_px; ++v) {
    for (int u = 0; u < view_.width_px; ++u) {
      const double level = picture.at<double>(v, u) + noise(random);
      image.bytes.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L)));
    }
  }
  return image;
}

}  // namespace drape::test
