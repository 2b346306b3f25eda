// SPDX-License-Identifier: Apache-2.0
#include "detect/test_views.hpp"

#include <algorithm>

#include "core/units.hpp"

namespace drape::test {

using namespace detect;
using units::mm;

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

FrameDetections detected(const GreyImage& image, const Print& print) {
  TagFinder finder(print.tag_family);
  return detect_frame(image, plane_of(print), finder, limits_of(DetectOptions{}));
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
