// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/outline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"
#include "simulate/drape/rings.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using units::mm;

double area_of(const Polygon& ring) {
  return std::abs(signed_area(ring));
}

[[noreturn]] void refuse_size(const std::filesystem::path& file) {
  throw bad_input(fmt::format("the outline reaches beyond {:g} m, or has more than {} corners",
                              kFarthest_m, kMostCorners),
                  {.file = file.string()}, "check its size and units");
}

std::vector<Polygon> rings_of_csv(const std::filesystem::path& file, double spacing_m) {
  const Csv csv = read_csv(file, {"ring", "warp_mm", "weft_mm"});
  RingBuilder builder(spacing_m);
  builder.to_metres.linear() *= mm;
  std::set<double> begun;
  for (std::size_t row = 0; row < csv.lines.size(); ++row) {
    const double ring = csv.columns[0][row];
    const Vector2d drawn(csv.columns[2][row], csv.columns[1][row]);
    if (row > 0 && ring == csv.columns[0][row - 1]) {
      builder.line_to(drawn);
      continue;
    }
    if (row > 0) builder.close();
    if (!begun.insert(ring).second)
      throw bad_input(fmt::format("ring {:g} goes on after another one", ring),
                      {.file = file.string(), .line = csv.lines[row], .field = "ring"},
                      "let the corners of a ring stand together, or give it a number of its own");
    builder.begin(drawn);
  }
  if (builder.is_open()) builder.close();
  if (builder.is_beyond_limits()) refuse_size(file);
  return builder.rings();
}

bool crosses(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  const auto side = [](const Vector2d& p, const Vector2d& q, const Vector2d& r) {
    return cross(q - p, r - p);
  };
  return side(a, b, c) * side(a, b, d) < 0 && side(c, d, a) * side(c, d, b) < 0;
}

std::string place_of(const Vector2d& at) {
  return fmt::format("warp {:.1f}, weft {:.1f} mm", at.x() / mm, at.y() / mm);
}

bool runs_along(const Polygon& one, const Polygon& other, double same_m) {
  return std::all_of(one.begin(), one.end(),
                     [&](const Vector2d& corner) { return distance_m(other, corner) < same_m; });
}

/// Refuses lines that cross or come closer to each other than `same_m`: each must have cloth on one
/// side only.
class LinesApart {
 public:
  LinesApart(const std::vector<Polygon>& rings, double same_m, const std::filesystem::path& file)
      : rings_(rings), same_m_(same_m), file_(file) {
    for (std::size_t r = 0; r < rings.size(); ++r)
      for (std::size_t i = 0; i < rings[r].size(); ++i)
        lines_.push_back({rings[r][i], rings[r][(i + 1) % rings[r].size()], r, i});
    std::sort(lines_.begin(), lines_.end(), [](const Line& a, const Line& b) {
      return std::pair(a.low(), std::pair(a.ring, a.corner)) <
             std::pair(b.low(), std::pair(b.ring, b.corner));
    });
  }

  void check() const {
    for (const Polygon& ring : rings_)
      for (std::size_t i = 0; i < ring.size(); ++i)
        check_corner(ring[i], ring[(i + 1) % ring.size()], ring[(i + 2) % ring.size()]);
    for (std::size_t i = 0; i < lines_.size(); ++i)
      for (std::size_t k = i + 1; k < lines_.size() && lines_[k].low() < lines_[i].high() + same_m_;
           ++k)
        check_pair(lines_[i], lines_[k]);
  }

 private:
  struct Line {
    Vector2d from, to;
    std::size_t ring = 0, corner = 0;
    [[nodiscard]] double low() const { return std::min(from.x(), to.x()); }
    [[nodiscard]] double high() const { return std::max(from.x(), to.x()); }
  };

  [[noreturn]] void refuse(const std::string& what, const std::string& remedy) const {
    throw bad_input(what, {.file = file_.string()}, remedy);
  }
  [[nodiscard]] bool is_near(const Line& line, const Vector2d& p) const {
    return distance_m({line.from, line.to}, p) < same_m_;
  }
  [[nodiscard]] bool follows(const Line& a, const Line& b) const {
    return a.ring == b.ring && b.corner == (a.corner + 1) % rings_[a.ring].size();
  }

  /// Intersection of the infinite lines through both.
  static Vector2d crossing(const Line& a, const Line& b) {
    const Vector2d along = a.to - a.from, other = b.to - b.from, apart = b.from - a.from;
    return a.from + cross(apart, other) / cross(along, other) * along;
  }

  void check_corner(const Vector2d& before, const Vector2d& corner, const Vector2d& after) const {
    if (distance_m({before, corner}, after) < same_m_ ||
        distance_m({corner, after}, before) < same_m_)
      refuse("the outline runs back on itself at " + place_of(corner),
             "draw a cut as a slit with a width, and leave out what is drawn by mistake");
  }

  void check_pair(const Line& a, const Line& b) const {
    if (follows(a, b) || follows(b, a)) return;
    if (std::min(a.from.y(), a.to.y()) > std::max(b.from.y(), b.to.y()) + same_m_ ||
        std::min(b.from.y(), b.to.y()) > std::max(a.from.y(), a.to.y()) + same_m_)
      return;
    if (crosses(a.from, a.to, b.from, b.to))
      refuse("two lines of the outline cross near " + place_of(crossing(a, b)),
             "an outline must not cross itself, nor its holes");
    if (!is_near(a, b.from) && !is_near(a, b.to) && !is_near(b, a.from) && !is_near(b, a.to))
      return;
    const Polygon &one = rings_[a.ring], &other = rings_[b.ring];
    if (a.ring != b.ring && runs_along(one, other, same_m_) && runs_along(other, one, same_m_))
      refuse("the ring about " + place_of(a.from) + " stands there twice", "keep one of the two");
    const Vector2d at = is_near(a, b.from)   ? b.from
                        : is_near(a, b.to)   ? b.to
                        : is_near(b, a.from) ? a.from
                                             : a.to;
    refuse("two lines of the outline touch near " + place_of(at),
           "an outline must not touch itself, nor its holes: leave cloth between them");
  }

  const std::vector<Polygon>& rings_;
  double same_m_;
  const std::filesystem::path& file_;
  std::vector<Line> lines_;
};

void check_holes(const ClothOutline& outline) {
  const auto refuse = [&](const Polygon& ring, const char* what, const char* remedy) {
    throw bad_input("the ring about " + place_of(ring.front()) + what,
                    {.file = outline.file.string()}, remedy);
  };
  for (const Polygon& hole : outline.holes) {
    if (!contains(outline.outer, hole.front()))
      refuse(hole, " is not inside the largest one",
             "a piece of cloth has one outer line; drape two apart");
    for (const Polygon& other : outline.holes)
      if (&other != &hole && contains(other, hole.front()))
        refuse(hole, " is inside a hole", "an island is a piece of its own: drape it apart");
  }
}

}  // namespace

ClothOutline read_outline(const std::filesystem::path& file, double spacing_m) {
  const bool svg = file.extension() == ".svg";
  if (!svg && file.extension() != ".csv")
    throw bad_input("an outline is an .svg or a .csv file", {.file = file.string()},
                    "export the outline as SVG, or write its corners as ring,warp_mm,weft_mm");
  std::vector<Polygon> rings = svg ? rings_of_svg(file, spacing_m) : rings_of_csv(file, spacing_m);
  if (rings.empty())
    throw bad_input("the file has no closed outline", {.file = file.string()},
                    "draw one closed path, polygon, rectangle, circle or ellipse");
  for (const Polygon& ring : rings)
    if (ring.size() < 3)
      throw bad_input("the ring about " + place_of(ring.front()) +
                          " has fewer than three corners in different places",
                      {.file = file.string()}, "draw a cut as a slit with a width");
  std::stable_sort(rings.begin(), rings.end(),
                   [](const Polygon& a, const Polygon& b) { return area_of(a) > area_of(b); });
  LinesApart(rings, kSamePlace * spacing_m, file).check();
  ClothOutline outline;
  outline.outer = std::move(rings.front());
  outline.holes.assign(std::make_move_iterator(rings.begin() + 1),
                       std::make_move_iterator(rings.end()));
  outline.file = file;
  check_holes(outline);
  return outline;
}

}  // namespace drape::simulate
