// SPDX-License-Identifier: Apache-2.0
#include "simulate/sparse/dissection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace drape::simulate {
namespace {

constexpr int kLeaf = 16;      // particles of a region that is not cut further
constexpr int kSeparator = 2;  // lines

using Particles = std::vector<int>;

/// What grows by one from a line of particles to the next: row times warp plus col times weft.
struct Across {
  int row = 0, col = 0;
};
constexpr Across kWays[] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};

/// Where a part is cut: in `line` and the next.
struct Cut {
  Across across;
  int line = 0;
};

/// Where a particle lies in the part that is being cut; bits, to be taken together.
enum Place { kOutside = 0, kFirst = 1, kSecond = 2, kBetween = 4 };

class Dissection {
 public:
  explicit Dissection(const GridMatrix& pattern);
  /// Lists the regions of a part of the grid with that border; the last is the whole part.
  void dissect(const Particles& part, Particles border);

  std::vector<Region> regions;

 private:
  [[nodiscard]] int line_of(Across across, int particle) const {
    return across.row * rows_[particle] + across.col * cols_[particle];
  }
  [[nodiscard]] int met_by(int particle) const {
    int places = 0;
    for (const int other : neighbours_[particle]) places |= places_[other];
    return places;
  }
  [[nodiscard]] std::optional<Cut> find_cut(const Particles& part, Across across) const;
  void place(const Particles& part, const Cut& cut);
  [[nodiscard]] double cost(const Particles& part, const Particles& border) const;
  void split(const Particles& part, const Cut& cut, Region& region);

  std::vector<int> rows_, cols_, places_;
  std::vector<Particles> neighbours_;
};

Dissection::Dissection(const GridMatrix& pattern)
    : rows_(pattern.grid().count()),
      cols_(rows_.size()),
      places_(rows_.size(), kOutside),
      neighbours_(rows_.size()) {
  for (int j = 0; j < pattern.grid().count(); ++j) {
    rows_[j] = j / pattern.grid().cols;
    cols_[j] = j % pattern.grid().cols;
    for (int s = 1; s < GridMatrix::slots; ++s) {
      if (!pattern.has(j, s)) continue;
      neighbours_[j].push_back(j + pattern.step(s));
      neighbours_[j + pattern.step(s)].push_back(j);
    }
  }
}

/// Where the halves have most nearly as many particles; nothing where one would have none.
std::optional<Cut> Dissection::find_cut(const Particles& part, Across across) const {
  int low = std::numeric_limits<int>::max(), high = std::numeric_limits<int>::min();
  for (const int p : part) {
    low = std::min(low, line_of(across, p));
    high = std::max(high, line_of(across, p));
  }
  std::vector<int> on_line(high - low + 1);
  for (const int p : part) ++on_line[line_of(across, p) - low];
  std::optional<Cut> cut;
  const int all = static_cast<int>(part.size());
  int least = all, first = 0;
  for (int k = 1; k + kSeparator < static_cast<int>(on_line.size()); ++k) {
    first += on_line[k - 1];
    const int more = std::abs(all - on_line[k] - on_line[k + 1] - 2 * first);
    if (more >= least) continue;
    least = more;
    cut = {across, low + k};
  }
  return cut;
}

void Dissection::place(const Particles& part, const Cut& cut) {
  for (const int p : part) {
    const int k = line_of(cut.across, p) - cut.line;
    places_[p] = k < 0 ? kFirst : k < kSeparator ? kBetween : kSecond;
  }
}

/// About what the halves will cost: the squares of the lengths across them and of their borders.
double Dissection::cost(const Particles& part, const Particles& border) const {
  int inside[2] = {}, outside[2] = {};
  const auto meet = [&](int p) {
    const int places = met_by(p);
    outside[0] += (places & kFirst) != 0;
    outside[1] += (places & kSecond) != 0;
  };
  for (const int p : part) {
    if (places_[p] == kBetween) {
      meet(p);
    } else {
      ++inside[places_[p] == kSecond];
    }
  }
  std::for_each(border.begin(), border.end(), meet);
  double sum = 0;
  for (const int half : {0, 1}) {
    const double length = std::sqrt(static_cast<double>(inside[half])) + outside[half];
    sum += length * length;
  }
  return sum;
}

/// Dissects both halves of a part as they are placed; what lies between is the region's own.
void Dissection::split(const Particles& part, const Cut& cut, Region& region) {
  Particles halves[2], borders[2];
  for (const int p : part) {
    if (places_[p] == kBetween) {
      region.own.push_back(p);
    } else {
      halves[places_[p] == kSecond].push_back(p);
    }
  }
  for (const Particles* from : {&region.own, &region.border}) {
    for (const int p : *from) {
      const int places = met_by(p);
      if ((places & kFirst) != 0) borders[0].push_back(p);
      if ((places & kSecond) != 0) borders[1].push_back(p);
    }
  }
  for (const int p : part) places_[p] = kOutside;
  // Along the lines, so that parts of the separator lie together in the borders of later regions.
  const Across along{cut.across.col, -cut.across.row};
  std::stable_sort(region.own.begin(), region.own.end(),
                   [&](int a, int b) { return line_of(along, a) < line_of(along, b); });
  for (const int half : {0, 1}) {
    dissect(halves[half], std::move(borders[half]));
    region.children[half] = static_cast<int>(regions.size()) - 1;
  }
}

void Dissection::dissect(const Particles& part, Particles border) {
  std::optional<Cut> best;
  double least = std::numeric_limits<double>::infinity();
  for (const Across across : kWays) {
    const std::optional<Cut> cut =
        static_cast<int>(part.size()) > kLeaf ? find_cut(part, across) : std::nullopt;
    if (!cut) continue;
    place(part, *cut);
    const double now = cost(part, border);
    if (now >= least) continue;
    least = now;
    best = cut;
  }
  Region region;
  region.border = std::move(border);
  if (best) {
    place(part, *best);
    split(part, *best, region);
  } else {
    region.own = part;
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

}  // namespace drape::simulate
