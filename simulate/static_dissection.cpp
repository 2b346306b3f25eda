// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_dissection.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace drape::sim {
namespace {

constexpr int kLeaf = 16;      // particles of a region that is not cut further
constexpr int kSeparator = 2;  // lines

using Particles = std::vector<int>;

/// What grows by one from a line of particles to the next: row times warp plus col times weft.
struct Across {
  int row = 0, col = 0;
};
constexpr Across kWays[] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};

struct Cut {
  Particles separator;
  std::array<Particles, 2> halves, borders;
  double cost = std::numeric_limits<double>::infinity();
};

class Dissection {
 public:
  explicit Dissection(const GridMatrix& pattern);
  /// The regions of a part of the grid with that border; the last is the whole part.
  void dissect(const Particles& part, Particles border);

  std::vector<Region> regions;

 private:
  [[nodiscard]] int line(Across across, int particle) const {
    return across.row * (particle / cols_) + across.col * (particle % cols_);
  }
  [[nodiscard]] std::optional<Cut> cut(const Particles& part, const Particles& border,
                                       Across across);
  [[nodiscard]] Particles border_of(const Particles& half, const Cut& cut, const Particles& border);

  int cols_;
  std::vector<Particles> neighbours_;
  std::vector<bool> marked_;
};

Dissection::Dissection(const GridMatrix& pattern)
    : cols_(pattern.grid().cols),
      neighbours_(pattern.grid().count()),
      marked_(pattern.grid().count()) {
  for (int j = 0; j < pattern.grid().count(); ++j) {
    for (int s = 1; s < GridMatrix::slots; ++s) {
      if (!pattern.has(j, s)) continue;
      neighbours_[j].push_back(j + pattern.step(s));
      neighbours_[j + pattern.step(s)].push_back(j);
    }
  }
}

/// Which of the particles that can lie there meet one of the half.
Particles Dissection::border_of(const Particles& half, const Cut& cut, const Particles& border) {
  for (const int p : half) marked_[p] = true;
  Particles found;
  for (const Particles* from : {&cut.separator, &border}) {
    std::copy_if(from->begin(), from->end(), std::back_inserter(found), [&](int p) {
      return std::any_of(neighbours_[p].begin(), neighbours_[p].end(),
                         [&](int other) { return marked_[other]; });
    });
  }
  for (const int p : half) marked_[p] = false;
  return found;
}

/// Cuts where the halves have most nearly as many particles; nothing where one would have none.
std::optional<Cut> Dissection::cut(const Particles& part, const Particles& border, Across across) {
  const auto less = [&](int a, int b) { return line(across, a) < line(across, b); };
  const auto [low, high] = std::minmax_element(part.begin(), part.end(), less);
  const int first = line(across, *low);
  std::vector<int> on_line(line(across, *high) - first + 1);
  for (const int p : part) ++on_line[line(across, p) - first];
  const int all = static_cast<int>(part.size());
  int middle = 0, least = all, before = 0;
  for (int k = 1; k + kSeparator < static_cast<int>(on_line.size()); ++k) {
    before += on_line[k - 1];
    const int more = std::abs(all - 2 * before - on_line[k] - on_line[k + 1]);
    if (more < least) {
      least = more;
      middle = k;
    }
  }
  if (middle == 0) return std::nullopt;
  Cut cut;
  for (const int p : part) {
    const int k = line(across, p) - first - middle;
    (k < 0 ? cut.halves[0] : k < kSeparator ? cut.separator : cut.halves[1]).push_back(p);
  }
  // Along the lines, so that parts of the separator lie together in the borders of later regions.
  const Across along{across.col, -across.row};
  std::stable_sort(cut.separator.begin(), cut.separator.end(),
                   [&](int a, int b) { return line(along, a) < line(along, b); });
  cut.cost = 0;
  for (int h = 0; h < 2; ++h) {
    cut.borders[h] = border_of(cut.halves[h], cut, border);
    const double inside = std::sqrt(static_cast<double>(cut.halves[h].size()));
    const double outside = static_cast<double>(cut.borders[h].size());
    cut.cost += (inside + outside) * (inside + outside);
  }
  return cut;
}

void Dissection::dissect(const Particles& part, Particles border) {
  std::optional<Cut> best;
  for (const Across across : kWays) {
    if (static_cast<int>(part.size()) <= kLeaf) break;
    std::optional<Cut> next = cut(part, border, across);
    if (next && (!best || next->cost < best->cost)) best = std::move(next);
  }
  Region region;
  region.own = best ? best->separator : part;
  region.border = std::move(border);
  for (int h = 0; best && h < 2; ++h) {
    dissect(best->halves[h], std::move(best->borders[h]));
    region.children[h] = static_cast<int>(regions.size()) - 1;
  }
  regions.push_back(std::move(region));
}

}  // namespace

std::vector<int> elimination_order(const std::vector<Region>& regions, int count) {
  std::vector<int> order(count, -1);
  int next = 0;
  for (const Region& region : regions) {
    for (const int particle : region.own) order[particle] = next++;
  }
  return order;
}

std::vector<Region> dissect(const GridMatrix& pattern) {
  Particles all(pattern.grid().count());
  std::iota(all.begin(), all.end(), 0);
  Dissection dissection(pattern);
  dissection.dissect(all, {});
  const std::vector<int> order = elimination_order(dissection.regions, pattern.grid().count());
  for (Region& region : dissection.regions) {
    std::sort(region.border.begin(), region.border.end(),
              [&](int a, int b) { return order[a] < order[b]; });
  }
  return std::move(dissection.regions);
}

}  // namespace drape::sim
