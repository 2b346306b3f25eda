// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "compare/html.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

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

std::string html_crops(const std::string& drape, const DrapeFiles& files, const RealVirtual& best) {
  if (!files.detections) return {};
  const std::string& set = std::get<MeasuredSource>(files.input.measured.sheet.source).set;
  std::string text;
  for (const MarkError& mark : best.marks.marks) {
    std::string crops;
    for (const FrameDetections& frame : files.detections->frames) {
      if (frame.set != set || !frame.preview_file) continue;
      if (const Detection* detection = seen_in(frame, mark.mark))
        crops += crop_of(photo_id(drape, frame.camera), frame.camera, *detection);
    }
    if (!crops.empty())
      text += fmt::format("<div>{}<span>{}, {}: {:.2f} mm</span></div>\n", crops, mark.mark.row,
                          mark.mark.col, mark.distance_m / mm);
  }
  if (text.empty()) return {};
  return "<p class=\"soft\">Each mark as the cameras saw it (row, col: distance).</p>\n<div "
         "class=\"crops\">\n" +
         text + "</div>\n";
}

}  // namespace drape::compare
