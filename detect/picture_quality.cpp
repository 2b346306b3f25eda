// SPDX-License-Identifier: Apache-2.0
#include "detect/picture_quality.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/error.hpp"
#include "core/statistics/sample.hpp"

namespace drape::detect {
namespace {

constexpr int kStride = 3;           ///< lines that are looked at; a picture has a thousand
constexpr double kPart = 0.5;        ///< of marks, of light, of sharpness, of what others have
constexpr std::size_t kFewTags = 3;  ///< tags that chance does not decode
constexpr double kLeastLight = 16;   ///< of 255: 4 of the bits are not used
constexpr double kSaturated = 0.02;  ///< more than highlights: the cloth itself, or a part of it

GreyImage mirrored(GreyImage image) {
  for (int y = 0; y < image.height_px; ++y) {
    const auto from = static_cast<std::ptrdiff_t>(y) * image.width_px;
    std::reverse(image.bytes.begin() + from, image.bytes.begin() + from + image.width_px);
    if (!image.levels.empty())
      std::reverse(image.levels.begin() + from, image.levels.begin() + from + image.width_px);
  }
  return image;
}

double saturated_part(const GreyImage& image) {
  const auto full = std::count(image.bytes.begin(), image.bytes.end(), 255);
  return static_cast<double>(full) / static_cast<double>(image.bytes.size());
}

std::string range_of(const std::vector<TagDetection>& tags) {
  const auto [least, most] =
      std::minmax_element(tags.begin(), tags.end(),
                          [](const TagDetection& a, const TagDetection& b) { return a.id < b.id; });
  return fmt::format("{} to {}", least->id, most->id);
}

}  // namespace

PictureQuality quality_of(const GreyImage& image) {
  PictureQuality quality;
  double steepest = 0;
  if (image.levels.empty()) {
    std::array<std::int64_t, 256> levels{}, doubled_slopes{};
    for (int y = 0; y < image.height_px; y += kStride) {
      const std::uint8_t* row = image.bytes.data() + static_cast<std::size_t>(y) * image.width_px;
      for (int x = 1; x + 1 < image.width_px; ++x) {
        ++levels[row[x]];
        ++doubled_slopes[static_cast<std::size_t>(std::abs(row[x + 1] - row[x - 1]))];
      }
    }
    quality.dark = counted_quantile(levels, 0.01);
    quality.light = counted_quantile(levels, 0.99);
    steepest = 0.5 * counted_quantile(doubled_slopes, 0.999);
  } else {
    quality.deep = true;
    std::vector<float> levels, slopes;
    for (int y = 0; y < image.height_px; y += kStride) {
      for (int x = 1; x + 1 < image.width_px; ++x) {
        levels.push_back(image.level(x, y));
        slopes.push_back(0.5F * std::abs(image.level(x + 1, y) - image.level(x - 1, y)));
      }
    }
    if (!levels.empty()) {
      quality.dark = quantile(levels, 0.01);
      quality.light = quantile(levels, 0.99);
      steepest = quantile(slopes, 0.999);
    }
  }
  // The slope of a step that a Gaussian blurs is its height over sqrt(2 pi) widths.
  if (steepest > 0)
    quality.edge_px = (quality.light - quality.dark) / (std::sqrt(2 * std::numbers::pi) * steepest);
  return quality;
}

std::vector<std::string> poor_views(const std::vector<FrameDetections>& frames,
                                    const std::vector<PictureQuality>& qualities) {
  std::vector<std::string> lines;
  if (frames.empty()) return lines;
  std::vector<double> spans, edges;
  std::map<std::string, std::size_t> best;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    spans.push_back(qualities[i].light - qualities[i].dark);
    edges.push_back(qualities[i].edge_px);
    std::size_t& most = best[frames[i].set];
    most = std::max(most, frames[i].detections.size());
  }
  const double usual_span = median(spans), usual_edge_px = median(edges);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t here = frames[i].detections.size(), most = best[frames[i].set];
    if (static_cast<double>(here) >= kPart * static_cast<double>(most) && here > 0) continue;
    const PictureQuality& q = qualities[i];
    std::string why;
    if (spans[i] < kPart * usual_span)
      why = fmt::format(
          "is {}: its grey levels are {:.0f} to {:.0f}, {:.0f} apart, in the others {:.0f}; change "
          "light or exposure",
          q.dark > 128 ? "washed out" : "dim", q.dark, q.light, spans[i], usual_span);
    else if (kPart * edges[i] > usual_edge_px)
      why = fmt::format(
          "is blurred: its sharpest edges are {:.1f} px wide, in the others {:.1f}; focus, or hold "
          "still",
          edges[i], usual_edge_px);
    if (why.empty()) continue;
    lines.push_back(
        fmt::format("set {}: camera {} {}; it shows {} marks, the best view of the set {}",
                    frames[i].set, frames[i].camera, why, here, most));
  }
  return lines;
}

std::string unused_levels(const std::vector<FrameDetections>& frames,
                          const std::vector<PictureQuality>& qualities) {
  std::size_t first = frames.size(), count = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (qualities[i].light >= kLeastLight) continue;
    first = std::min(first, i);
    ++count;
  }
  if (count == 0) return {};
  const std::string what = "hardly a pixel is above 1/16 of the largest grey level";
  const std::string more = count > 1 ? fmt::format(" and {} more pictures", count - 1) : "";
  if (qualities[first].deep)
    throw bad_input(what + (count > 1 ? ", as in" + more.substr(4) : ""),
                    {.camera = frames[first].camera, .set = frames[first].set},
                    "are these 12 bits in the low bits of 16? Multiply them by 16, or change light "
                    "or exposure");
  return fmt::format("set {}, camera {}{}: {}; change light or exposure", frames[first].set,
                     frames[first].camera, more, what);
}

std::string why_no_mark(const GreyImage& image, const PrintPlane& plane, const FrameLimits& limits,
                        bool has_labels, const std::string& file) {
  constexpr double kNoise = 1;
  if (plane.tag_family.empty()) return {};
  TagFinder finder(plane.tag_family);
  const std::vector<TagDetection> own = finder.find_all(image, kNoise);
  std::string best_family = plane.tag_family;
  std::vector<TagDetection> best = own;
  for (const std::string& family : tag_families()) {
    // Sixteen bits are read into the tags of any other family, so they tell nothing.
    if (family == plane.tag_family || family == "tag16h5") continue;
    std::vector<TagDetection> found = TagFinder(family).find_all(image, kNoise);
    if (found.size() < kFewTags || found.size() <= best.size()) continue;
    best = std::move(found);
    best_family = family;
  }
  const std::size_t turned = finder.find_all(mirrored(image), kNoise).size();
  if (turned >= kFewTags && turned > best.size())
    return fmt::format("picture or print is mirrored: mirrored, it shows the tags of {}", file);
  if (best_family != plane.tag_family)
    return fmt::format("it shows tags {} of {}, tags.family in {} is {}", range_of(best),
                       best_family, file, plane.tag_family);
  if (own.size() >= kFewTags) {
    const bool known = std::any_of(own.begin(), own.end(), [&](const TagDetection& tag) {
      return plane.tags.count(tag.id) != 0;
    });
    if (!known)
      return fmt::format(
          "it shows tags {} of {}, {} has tags {} to {} (tags.first_id, tags.tag.id)",
          range_of(own), plane.tag_family, file, plane.tags.begin()->first,
          plane.tags.rbegin()->first);
    if (has_labels) return {};
    for (const double factor : {2.0, 0.5}) {
      PrintPlane other = plane;
      other.dot_radius_m *= factor;
      const std::size_t found = detect_frame(image, other, finder, limits).detections.size();
      if (found < kFewTags) continue;
      return fmt::format(
          "with dots of {:g} mm {} are found, dot_diameter_mm in {} is {:g}: is it "
          "the radius?",
          2000 * other.dot_radius_m, found, file, 2000 * plane.dot_radius_m);
    }
    const double part = saturated_part(image);
    const std::string light = part <= kSaturated
                                  ? std::string()
                                  : fmt::format(
                                        "; {:.0f} % of its pixels are at the largest grey level: "
                                        "less exposure, gain or light shows dots again",
                                        100 * part);
    return fmt::format(
        "it shows {} tags of {}, but no dots of its size and pitch beside them "
        "(dot_diameter_mm, pitch_mm, rows, cols){}",
        own.size(), file, light);
  }
  return {};
}

}  // namespace drape::detect
