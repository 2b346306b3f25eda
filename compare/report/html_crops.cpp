// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "compare/report/html.hpp"

namespace drape::compare {
namespace {

constexpr double kAroundDot = 2.6;  ///< half side of a crop over the dot's long semi-axis

const Detection* seen_in(const FrameDetections& frame, MarkId mark) {
  const auto found =
      std::lower_bound(frame.detections.begin(), frame.detections.end(), mark,
                       [](const Detection& detection, MarkId id) { return detection.mark < id; });
  return found != frame.detections.end() && found->mark == mark ? &*found : nullptr;
}

std::string crop_of(const std::string& photo, const std::string& camera,
                    const Detection& detection) {
  const double half = std::max(6.0, kAroundDot * detection.semi_axes_px.x());
  return fmt::format(
      "<svg viewBox=\"{} {} {} {}\" role=\"img\" aria-label=\"{}\"><title>{}</title><use "
      "href=\"#{}\"/></svg>",
      coordinate(detection.centre_px.x() - half), coordinate(detection.centre_px.y() - half),
      coordinate(2 * half), coordinate(2 * half), xml(camera), xml(camera), xml(photo));
}

}  // namespace

std::string crops_of_mark(const std::string& drape, const DrapeFiles& files, MarkId mark) {
  if (!files.detections) return {};
  const std::string& set = std::get<MeasuredSource>(files.input.measured.sheet.source).set;
  std::string crops;
  for (const FrameDetections& frame : files.detections->frames) {
    if (frame.set != set || !frame.preview_file) continue;
    if (const Detection* detection = seen_in(frame, mark))
      crops += crop_of(photo_id(drape, frame.camera), frame.camera, *detection);
  }
  return crops;
}

}  // namespace drape::compare
