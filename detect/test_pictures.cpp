// SPDX-License-Identifier: Apache-2.0
#include "detect/test_pictures.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/units.hpp"

namespace drape::test {

using namespace detect;

namespace {

constexpr int dot_side = 64;
constexpr int ink_per_mm = 20;
constexpr double step_mm = 0.05;  // along the weft and across the picture
constexpr int samples = 4;        // per side of a pixel
constexpr double table_level = 0.15;

using units::mm;

/// Fraction of a pixel inside the ellipse: exact along u, 32 lines along v.
double coverage(const SyntheticDot& dot, const Eigen::Matrix2d& inverse, int x, int y) {
  constexpr int lines = 32;
  double inside = 0;
  for (int j = 0; j < lines; ++j) {
    const double v = y - 0.5 + (j + 0.5) / lines - dot.centre_px.y();
    // inverse(0,0) u^2 + 2 inverse(0,1) v u + inverse(1,1) v^2 = 1
    const double half = inverse(0, 1) * v;
    const double root = half * half - inverse(0, 0) * (inverse(1, 1) * v * v - 1);
    if (root <= 0) continue;
    const double from = dot.centre_px.x() + (-half - std::sqrt(root)) / inverse(0, 0);
    const double to = dot.centre_px.x() + (-half + std::sqrt(root)) / inverse(0, 0);
    const double end = std::min({to, x + 0.5, dot.hidden_from_u});
    inside += std::max(0.0, end - std::max(from, x - 0.5)) / lines;
  }
  return inside;
}

/// Relative changes of light from thread to thread: blurred white noise with RMS `size`.
cv::Mat weave(double size, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  cv::Mat field(dot_side, dot_side, CV_64F);
  for (int k = 0; k < dot_side * dot_side; ++k)
    field.at<double>(k / dot_side, k % dot_side) = normal(random);
  cv::GaussianBlur(field, field, {}, 0.7);
  return field * (size * dot_side / cv::norm(field));
}

}  // namespace

cv::Mat sampled(int width_px, int height_px, int per_side,
                const std::function<double(const Eigen::Vector2d&)>& level) {
  cv::Mat light(height_px, width_px, CV_64F);
  for (int v = 0; v < height_px; ++v) {
    for (int u = 0; u < width_px; ++u) {
      double sum = 0;
      for (int k = 0; k < per_side * per_side; ++k)
        sum += level(
            {u - 0.5 + (k % per_side + 0.5) / per_side, v - 0.5 + (k / per_side + 0.5) / per_side});
      light.at<double>(v, u) = sum / (per_side * per_side);
    }
  }
  return light;
}

GreyImage exposed(const cv::Mat& light, double blur_px, double noise_grey, unsigned seed) {
  cv::Mat blurred = light;
  if (blur_px > 0) cv::GaussianBlur(light, blurred, {}, blur_px);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_grey);
  GreyImage image{light.cols, light.rows, {}, {}};
  for (int v = 0; v < light.rows; ++v)
    for (int u = 0; u < light.cols; ++u)
      image.bytes.push_back(
          cv::saturate_cast<std::uint8_t>(std::lround(blurred.at<double>(v, u) + noise(random))));
  return image;
}

GreyImage image_of(const cv::Mat& picture) {
  GreyImage image{picture.cols, picture.rows, {}, {}};
  image.bytes.assign(picture.datastart, picture.dataend);
  return image;
}

GreyImage draw(const SyntheticDot& dot, std::mt19937& random) {
  const Eigen::Matrix2d inverse = dot.shape_px2.inverse();
  cv::Mat picture(dot_side, dot_side, CV_64F);
  for (int y = 0; y < dot_side; ++y) {
    for (int x = 0; x < dot_side; ++x) {
      const double light = dot.bright * (1 + dot.slope_per_px * (x - dot.centre_px.x()));
      const double print = 1 - dot.contrast / dot.bright * coverage(dot, inverse, x, y);
      picture.at<double>(y, x) = light * print;
    }
  }
  cv::GaussianBlur(picture, picture, {}, dot.lens_blur_px);
  if (dot.texture > 0) picture = picture.mul(1 + weave(dot.texture / dot.bright, random));
  std::normal_distribution<double> noise(0, dot.noise);
  GreyImage image{dot_side, dot_side, {}, {}};
  for (int k = 0; k < dot_side * dot_side; ++k) {
    const double level = picture.at<double>(k / dot_side, k % dot_side) + noise(random);
    image.bytes.push_back(cv::saturate_cast<std::uint8_t>(std::lround(level)));
    if (dot.bits > 8) {
      const double steps = std::ldexp(1.0, dot.bits - 8);
      image.levels.push_back(static_cast<float>(std::round(level * steps) / steps));
    }
  }
  return image;
}

Blob blob_of(const SyntheticDot& dot) {
  Blob blob;
  blob.label = 1;
  blob.centre_px = dot.centre_px + Eigen::Vector2d(0.3, -0.2);
  blob.shape_px2 = 1.1 * dot.shape_px2;
  blob.bright = dot.bright;
  blob.dark = dot.bright - dot.contrast;
  return blob;
}

ClothPicture::ClothPicture(const Print& print, const ClothView& view)
    : print_(print),
      view_(view),
      turn_(Eigen::Rotation2D<double>(view.turn_rad).toRotationMatrix()) {
  side_x_ = static_cast<int>(std::lround(print.patch_m.y() / mm * ink_per_mm));
  side_y_ = static_cast<int>(std::lround(print.patch_m.x() / mm * ink_per_mm));
  cv::Mat ink(side_y_, side_x_, CV_8U, cv::Scalar(0));
  const Face face = face_of(print);
  const auto at = [](const FacePoint& face_m) -> Eigen::Vector2d {
    return face_m / mm * ink_per_mm;
  };
  for (const FaceDisc& disc : face.discs) {
    const Eigen::Vector2d c = at(disc.centre);
    const double r = disc.radius_m / mm * ink_per_mm;
    for (int y = static_cast<int>(c.y() - r) - 1; y <= c.y() + r + 1; ++y)
      for (int x = static_cast<int>(c.x() - r) - 1; x <= c.x() + r + 1; ++x)
        if (x >= 0 && y >= 0 && x < side_x_ && y < side_y_ &&
            std::hypot(x + 0.5 - c.x(), y + 0.5 - c.y()) <= r)
          ink.at<unsigned char>(y, x) = disc.ink > 0 ? 1 : 0;
  }
  for (const std::vector<FaceBox>& boxes : face.areas) {
    for (const FaceBox& box : boxes) {
      const Eigen::Vector2d a = at(box.least), b = at(box.most);
      const cv::Rect part(cv::Point(cvRound(a.x()), cvRound(a.y())),
                          cv::Point(cvRound(b.x()), cvRound(b.y())));
      ink(part & cv::Rect(0, 0, side_x_, side_y_)).setTo(1);
    }
  }
  ink_.assign(ink.datastart, ink.dataend);
  // The weft's curve in the picture with its height, then the uppermost point at each coordinate.
  double along = 0, height = 0;
  std::vector<double> height_mm;
  const double length_mm = print.patch_m.y() / mm;
  const auto steps = static_cast<int>(length_mm / step_mm);
  for (int k = 0; k <= steps; ++k) {
    along_mm_.push_back(along);
    height_mm.push_back(height);
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
    if (height_mm[k] <= top[bin]) continue;
    top[bin] = height_mm[k];
    front_mm_[bin] = static_cast<double>(k) * step_mm;
  }
  for (std::size_t bin = 1; bin + 1 < front_mm_.size(); ++bin) {
    if (front_mm_[bin] < 0) front_mm_[bin] = front_mm_[bin - 1];
  }
}

void ClothPicture::paint(const Eigen::Vector2d& at_mm, double radius_mm, int ink) {
  cv::Mat all_ink(side_y_, side_x_, CV_8U, ink_.data());
  cv::circle(all_ink, cv::Point(cvRound(at_mm.x() * ink_per_mm), cvRound(at_mm.y() * ink_per_mm)),
             cvRound(radius_mm * ink_per_mm), ink, cv::FILLED);
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
  // The weft distance of the bin where the cloth passes it; the remainder is linear.
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
  const double ink_level = view_.dark / view_.bright;
  const cv::Mat fraction =
      sampled(view_.width_px, view_.height_px, samples, [&](const Eigen::Vector2d& px) {
        const auto place = place_at(px);
        if (!place) return table_level;
        const int x = std::min(static_cast<int>(place->x() * ink_per_mm), side_x_ - 1);
        const int y = std::min(static_cast<int>(place->y() * ink_per_mm), side_y_ - 1);
        return ink_[static_cast<std::size_t>(y) * side_x_ + x] != 0 ? ink_level : 1.0;
      });
  cv::Mat light(fraction.size(), CV_64F);
  for (int v = 0; v < light.rows; ++v)
    for (int u = 0; u < light.cols; ++u)
      light.at<double>(v, u) = view_.bright * fraction.at<double>(v, u) * view_.light(u, v);
  return exposed(light, view_.blur_px, view_.noise, 9);
}

Print small_print(bool classes, bool tags) {
  Print print;
  print.rows = print.cols = side;
  print.pitch_m = 20 * mm;
  print.dot_diameter_m = 4 * mm;
  print.patch_m = {120 * mm, 120 * mm};
  print.margin_m = {10 * mm, 10 * mm};
  if (tags) {
    print.tag_family = "tag36h11";
    print.tag_edge_m = 12 * mm;
    int id = 0;
    for (int row = 0; row + 1 < side; ++row) {
      for (int col = row % 2; col + 1 < side; col += 2) {
        print.tags.push_back({id++, print.material_m({row, col}) + Eigen::Vector2d(10, 10) * mm});
      }
    }
  }
  if (classes) {
    print.dot_classes =
        DotClasses{1.6 * mm, {"#o##o#", "##o#oo", "o###o#", "oo#o##", "#ooo#o", "##o#oo"}};
  }
  return print;
}

FrameDetections detected(const GreyImage& image, const Print& print, double* blur_px) {
  TagFinder finder(print.tag_family);
  return detect_frame(image, plane_of(print), finder, {}, blur_px);
}

Look judged(FrameDetections frame, const ClothPicture& picture) {
  Look look;
  look.frame = std::move(frame);
  for (int k = 0; k < all; ++k) look.visible += picture.seen_px({k / side, k % side}).has_value();
  for (const Detection& dot : look.frame.detections) {
    const auto truth = picture.seen_px(dot.mark);
    const double miss = truth ? (*truth - dot.centre_px).norm() : 1e9;
    const bool right = miss < 2;
    right ? ++look.right : ++look.wrong;
    if (right) look.worst_px = std::max(look.worst_px, miss);
  }
  return look;
}

Look look_at(const ClothPicture& picture, const Print& print) {
  return judged(detected(picture.draw(), print), picture);
}

std::string reason_at(const FrameDetections& frame, const Eigen::Vector2d& px) {
  std::string reason;
  double nearest = 10;
  for (const Rejection& rejection : frame.rejections) {
    if (!rejection.centre_px || (*rejection.centre_px - px).norm() > nearest) continue;
    nearest = (*rejection.centre_px - px).norm();
    reason = rejection.reason;
  }
  return reason;
}

bool has(const FrameDetections& frame, MarkId mark) {
  return std::any_of(frame.detections.begin(), frame.detections.end(),
                     [&](const Detection& d) { return d.mark == mark; });
}

}  // namespace drape::test
