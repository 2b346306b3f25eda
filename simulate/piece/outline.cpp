// SPDX-License-Identifier: Apache-2.0
#include "simulate/piece/outline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/units.hpp"
#include "simulate/piece/rings.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using units::mm;

double area_of(const Polygon& ring) {
  double sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
    sum += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return std::abs(sum);
}

std::vector<Polygon> rings_of_csv(const std::filesystem::path& file) {
  const Csv csv = read_csv(file, {"ring", "warp_mm", "weft_mm"});
  std::vector<Polygon> rings;
  for (std::size_t row = 0; row < csv.lines.size(); ++row) {
    if (row == 0 || csv.columns[0][row] != csv.columns[0][row - 1]) rings.emplace_back();
    rings.back().emplace_back(mm * csv.columns[1][row], mm * csv.columns[2][row]);
  }
  for (Polygon& ring : rings)
    if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  return rings;
}

bool crosses(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto side = [](const Vector2d& p, const Vector2d& q, const Vector2d& r) {
    return (q.x() - p.x()) * (r.y() - p.y()) - (q.y() - p.y()) * (r.x() - p.x());
  };
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

/// Two lines of the rings that cross, as (ring, corner) each; nothing where none do.
std::string crossing_of(const std::vector<Polygon>& rings) {
  for (std::size_t r = 0; r < rings.size(); ++r)
    for (std::size_t i = 0; i < rings[r].size(); ++i)
      for (std::size_t s = r; s < rings.size(); ++s)
        for (std::size_t k = s == r ? i + 1 : 0; k < rings[s].size(); ++k) {
          const Polygon &one = rings[r], &other = rings[s];
          const Vector2d& at = one[i];
          if (crosses(at, one[(i + 1) % one.size()], other[k], other[(k + 1) % other.size()]))
            return fmt::format("near warp {:.1f}, weft {:.1f} mm", at.x() / mm, at.y() / mm);
        }
  return {};
}

}  // namespace

ClothOutline read_outline(const std::filesystem::path& file, double spacing_m) {
  const bool svg = file.extension() == ".svg";
  if (!svg && file.extension() != ".csv")
    throw bad_input("an outline is an .svg or a .csv file", {.file = file.string()},
                    "export the outline as SVG, or write its corners as ring,warp_mm,weft_mm");
  std::vector<Polygon> rings = svg ? rings_of_svg(file, spacing_m) : rings_of_csv(file);
  if (rings.empty())
    throw bad_input("the file has no closed outline", {.file = file.string()},
                    "draw one closed path, polygon, rectangle, circle or ellipse");
  std::size_t corners = 0;
  double farthest = 0;
  for (const Polygon& ring : rings) {
    corners += ring.size();
    for (const Vector2d& p : ring) farthest = std::max(farthest, p.cwiseAbs().maxCoeff());
  }
  if (corners > kMostCorners || !(farthest < kFarthest_m))
    throw bad_input(fmt::format("the outline reaches beyond {:g} m, or has more than {} corners",
                                kFarthest_m, kMostCorners),
                    {.file = file.string()}, "check its size and units");
  std::stable_sort(rings.begin(), rings.end(),
                   [](const Polygon& a, const Polygon& b) { return area_of(a) > area_of(b); });
  if (const std::string place = crossing_of(rings); !place.empty())
    throw bad_input("two lines of the outline cross " + place, {.file = file.string()},
                    "an outline must not cross itself, nor its holes");
  ClothOutline outline;
  outline.outer = std::move(rings.front());
  outline.holes.assign(std::make_move_iterator(rings.begin() + 1),
                       std::make_move_iterator(rings.end()));
  for (const Polygon& hole : outline.holes) {
    if (contains(outline.outer, hole.front())) continue;
    throw bad_input(fmt::format("the ring about warp {:.1f}, weft {:.1f} mm is not inside the "
                                "largest one",
                                hole.front().x() / mm, hole.front().y() / mm),
                    {.file = file.string()},
                    "a piece of cloth has one outer line; drape two apart");
  }
  return outline;
}

}  // namespace drape::simulate
