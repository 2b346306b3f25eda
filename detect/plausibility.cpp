// SPDX-License-Identifier: Apache-2.0
#include "detect/plausibility.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::detect {

namespace {

constexpr int kStride = 3;           ///< distance of sampled lines; a picture has about a thousand
constexpr double kPart = 0.5;        ///< fraction of the others' marks, brightness or sharpness
constexpr std::size_t kFewTags = 3;  ///< number of tags that cannot be chance detections
constexpr double kLeastLight = 16;   ///< grey level below which 4 of 8 bits are unused
constexpr double kSaturated = 0.02;  ///< more than highlights: part of the cloth is saturated

constexpr double kSteps = 257;  ///< per grey level: exact for 8 and 16 bits

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
  quality.deep = !image.levels.empty();
  std::vector<std::int64_t> levels(65536), doubled_slopes(65536);
  std::vector<int> row(static_cast<std::size_t>(image.width_px));
  for (int y = 0; y < image.height_px; y += kStride) {
    for (int x = 0; x < image.width_px; ++x)
      row[x] = static_cast<int>(image.level(x, y) * kSteps + 0.5);
    for (int x = 1; x + 1 < image.width_px; ++x) {
      ++levels[row[x]];
      ++doubled_slopes[std::abs(row[x + 1] - row[x - 1])];
    }
  }
  quality.dark = counted_quantile(levels, 0.01) / kSteps;
  quality.light = counted_quantile(levels, 0.99) / kSteps;
  const double steepest = 0.5 * counted_quantile(doubled_slopes, 0.999) / kSteps;
  // A step blurred by a Gaussian has a slope of its height over sqrt(2 pi) widths.
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

namespace {

/// As why_no_mark(), for a print that is labelled by its dots alone.
std::string why_no_plate(const GreyImage& image, const PrintPlane& plane, const FrameLimits& limits,
                         const std::string& file) {
  constexpr std::size_t kFewDots = 9;
  if (!plane.stiff) return {};
  TagFinder no_tags("");
  const auto dots_of = [&](const PrintPlane& described) {
    const FrameDetections frame = detect_frame(image, described, no_tags, limits);
    return std::max(frame.detections.size(), frame.islands.size());
  };
  const std::size_t dots = dots_of(plane);
  PrintPlane other = plane;
  other.white_dots = !plane.white_dots;
  if (dots < kFewDots && dots_of(other) >= kFewDots)
    return fmt::format("it shows {} dots, {} has {} ones (dot_colour)",
                       other.white_dots ? "white" : "black", file,
                       plane.white_dots ? "white" : "black");
  if (dots < kFewDots || !plane.classes) return {};
  return fmt::format(
      "{} dots stand in a grid, but no place of it shows all hollow dots of {} (hollow, "
      "hollow_diameter_mm, rows, cols); all of them must be in the picture",
      dots, file);
}

}  // namespace

std::string why_no_mark(const GreyImage& image, const PrintPlane& plane, const FrameLimits& limits,
                        bool has_labels, const std::string& file) {
  constexpr double kNoise = 1;
  if (plane.tag_family.empty()) return why_no_plate(image, plane, limits, file);
  TagFinder finder(plane.tag_family);
  const std::vector<TagDetection> own = finder.find_all(image, kNoise);
  std::string best_family = plane.tag_family;
  std::vector<TagDetection> best = own;
  for (const std::string& family : TagFamily::names()) {
    // tag16h5 has only 16 bits, which are found in tags of any family, so it proves nothing.
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

using Eigen::Vector2d;
using units::mm;

std::optional<double> dot_size_ratio(const std::vector<FrameDetections>& frames,
                                     const std::vector<double>& blurs_px,
                                     const MarkLattice& lattice) {
  constexpr std::size_t kFewest = 20;
  if (!(lattice.dot_diameter_m > 0)) return std::nullopt;
  std::vector<double> inner, all;  // dots with four neighbours; dots with one along each axis
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameDetections& frame = frames[i];
    std::map<std::pair<int, int>, const Detection*> at;
    for (const Detection& dot : frame.detections) at[{dot.mark.row, dot.mark.col}] = &dot;
    for (const Detection& dot : frame.detections) {
      int around = 0;
      /// Offset to the next dot in a direction; nullopt if there is none.
      const auto step = [&](int down, int right) -> std::optional<Vector2d> {
        const auto before = at.find({dot.mark.row - down, dot.mark.col - right}),
                   after = at.find({dot.mark.row + down, dot.mark.col + right});
        const int found = int(before != at.end()) + int(after != at.end());
        around += found;
        if (found == 0) return std::nullopt;
        const Detection& from = before == at.end() ? dot : *before->second;
        const Detection& to = after == at.end() ? dot : *after->second;
        return Vector2d((to.centre_px - from.centre_px) / found);
      };
      auto row = step(1, 0), col = step(0, 1);
      double cells = 1;
      if (around == 0) {  // neighbours lie along the diagonals of a staggered grid
        row = step(1, 1);
        col = step(1, -1);
        cells = 2;
      }
      if (!row || !col) continue;
      const double cell_px2 = std::abs(cross(*row, *col)) / cells;
      const double area_px2 =
          std::numbers::pi * (dot.semi_axes_px.prod() + blurs_px[i] * blurs_px[i]);
      const double stated = 0.25 * std::numbers::pi * std::pow(lattice.dot_diameter_m, 2);
      all.push_back(std::sqrt(area_px2 / cell_px2 * std::pow(lattice.pitch_m, 2) / stated));
      if (around == 4) inner.push_back(all.back());
    }
  }
  std::vector<double>& ratios = inner.size() < kFewest ? all : inner;
  if (ratios.size() < kFewest) return std::nullopt;
  return median(std::move(ratios));
}

std::string other_dot_size(const std::optional<double>& ratio, const MarkLattice& lattice,
                           const std::string& file) {
  constexpr double kMost = 0.1;
  if (!ratio || std::abs(*ratio - 1) <= kMost) return {};
  return fmt::format(
      "the dots are {:.2f} mm wide where pitch_mm is {:g}, dot_diameter_mm in {} is {:g}",
      *ratio * lattice.dot_diameter_m / mm, lattice.pitch_m / mm, file,
      lattice.dot_diameter_m / mm);
}

namespace {

constexpr double kNearer = 1.2;         ///< largest ratio of scales between two tags
constexpr double kTurned_cos = 0.5;     ///< 60 degrees
constexpr std::size_t kLeastTags = 2;   ///< least number of contradicting tags: one may be misread
constexpr std::size_t kLeastPart = 10;  ///< smallest fraction of contradicting tags: one in so many

struct TagMap {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d px_per_m;     ///< derivative of the pixel by the position on the print
  double largest_px_per_m = 0;  ///< along edges and diagonals
};

TagMap map_of(const PrintPlane& plane, const TagDetection& tag) {
  const auto& c = tag.corners_px;
  TagMap map;
  map.centre_px = c.rowwise().mean();
  const double edge_m = plane.tag_edge_m;
  map.px_per_m.col(0) = (c.col(1) - c.col(0) + c.col(2) - c.col(3)) / (2 * edge_m);
  map.px_per_m.col(1) = plane.row_sign * (c.col(3) - c.col(0) + c.col(2) - c.col(1)) / (2 * edge_m);
  for (int k = 0; k < 4; ++k)
    map.largest_px_per_m =
        std::max(map.largest_px_per_m, (c.col((k + 1) % 4) - c.col(k)).norm() / edge_m);
  for (int k = 0; k < 2; ++k)
    map.largest_px_per_m = std::max(map.largest_px_per_m,
                                    (c.col(k + 2) - c.col(k)).norm() / (std::sqrt(2.0) * edge_m));
  return map;
}

}  // namespace

std::string tags_elsewhere(const PrintPlane& plane, const std::vector<TagDetection>& tags,
                           const std::string& file, const std::string& keys) {
  constexpr double kMm = 1000;
  std::vector<TagMap> maps;
  double px_per_m = 0;
  for (const TagDetection& tag : tags) {
    maps.push_back(map_of(plane, tag));
    px_per_m = std::max(px_per_m, maps.back().largest_px_per_m);
  }
  const std::size_t count = tags.size();
  std::vector<std::vector<char>> apart(count, std::vector<char>(count, 0));
  double largest = 0;
  std::size_t pairs = 0, turned = 0;
  std::string example;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < count; ++k) {
      if (i == k) continue;
      const Eigen::Vector2d step_m = plane.tags.at(tags[k].id) - plane.tags.at(tags[i].id);
      const Eigen::Vector2d step_px = maps[k].centre_px - maps[i].centre_px;
      const Eigen::Vector2d expected_px = maps[i].px_per_m * step_m;
      ++pairs;
      if (expected_px.dot(step_px) < kTurned_cos * expected_px.norm() * step_px.norm()) ++turned;
      const double seen_m = step_px.norm() / px_per_m;
      if (seen_m <= kNearer * step_m.norm()) continue;
      apart[i][k] = 1;
      if (seen_m <= largest * step_m.norm()) continue;
      largest = seen_m / step_m.norm();
      example =
          fmt::format("tags {} and {} lie {:.0f} mm apart at least, {} has them {:.0f} mm apart",
                      tags[i].id, tags[k].id, kMm * seen_m, file, kMm * step_m.norm());
    }
  // Removes the tag that contradicts most others until no contradiction is left; counts them.
  std::size_t out = 0;
  for (;; ++out) {
    std::size_t worst = 0;
    std::ptrdiff_t most = 0;
    for (std::size_t i = 0; i < count; ++i)
      if (const auto found = std::count(apart[i].begin(), apart[i].end(), 1); found > most) {
        most = found;
        worst = i;
      }
    if (most == 0) break;
    for (std::size_t i = 0; i < count; ++i) apart[i][worst] = apart[worst][i] = 0;
  }
  if (out >= kLeastTags && kLeastPart * out >= count)
    return fmt::format("{} of {} tags lie elsewhere on the print: {} ({})", out, count, example,
                       keys);
  // A plate shows all tags in one orientation, a folded cloth only most.
  const std::size_t part = plane.stiff ? kLeastPart : 2;
  if (count > kLeastTags && part * turned > pairs)
    return fmt::format(
        "its tags lie in other directions from each other than {} has them: are rows and columns, "
        "or the sign of an axis, exchanged ({})?",
        file, keys);
  return {};
}

}  // namespace drape::detect
