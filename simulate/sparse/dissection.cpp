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

/// Number that grows by one from a line of particles to the next: row times warp plus col times
/// weft.
struct Across {
  int row = 0, col = 0;
};
constexpr Across kAcross[] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};

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
  for (const Across across : kAcross) {
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

/// Moves particles up until each coupling joins regions one of which is above the other, or the
/// same: of two that are not, the one with more such couplings. What else a particle meets lies in
/// its region, above or below, and so it stays.
class Ties {
 public:
  Ties(std::vector<Region>& regions, const GridMatrix& pattern)
      : regions_(regions), region_of_(pattern.grid().count()), parent_(regions.size(), -1) {
    for (std::size_t k = 0; k < regions.size(); ++k) {
      for (const int particle : regions[k].own) region_of_[particle] = static_cast<int>(k);
      for (const int child : regions[k].children) {
        if (child >= 0) parent_[child] = static_cast<int>(k);
      }
    }
    std::vector<int> ties(region_of_.size(), 0);
    for (const auto& [high, low] : pattern.couplings()) {
      if (common(region_of_[high], region_of_[low]) < 0) continue;
      ++ties[high];
      ++ties[low];
    }
    moved_.assign(region_of_.size(), false);
    for (const auto& [high, low] : pattern.couplings()) {
      const int above = common(region_of_[high], region_of_[low]);
      if (above < 0) continue;
      const int particle = ties[high] > ties[low] ? high : low;
      region_of_[particle] = above;
      moved_[particle] = true;
    }
    move();
  }

 private:
  /// The lowest region above both; -1 where that is one of them. Parents come after their children.
  [[nodiscard]] int common(int one, int two) const {
    const int lower = std::min(one, two), upper = std::max(one, two);
    int a = lower;
    while (a < upper) a = parent_[a];
    if (a == upper) return -1;
    int b = upper;
    while (a != b) (a < b ? a : b) = parent_[a < b ? a : b];
    return a;
  }

  void move() {
    for (Region& region : regions_) {
      region.own.erase(std::remove_if(region.own.begin(), region.own.end(),
                                      [&](int particle) { return moved_[particle]; }),
                       region.own.end());
    }
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      if (moved_[i]) regions_[region_of_[i]].own.push_back(static_cast<int>(i));
    }
  }

  std::vector<Region>& regions_;
  std::vector<int> region_of_, parent_;
  std::vector<bool> moved_;
};

/// Borders by elimination: what own particles meet and what the children's borders hold, without
/// what is eliminated before.
void find_borders(std::vector<Region>& regions, const GridMatrix& pattern) {
  const int count = pattern.grid().count();
  const std::vector<int> order = elimination_order(regions, count);
  std::vector<Particles> met(count);
  const auto meet = [&](int a, int b) {
    met[order[a] < order[b] ? a : b].push_back(std::max(order[a], order[b]));
  };
  for (int j = 0; j < count; ++j) {
    for (int s = 1; s < GridMatrix::slots; ++s) {
      if (pattern.has(j, s)) meet(j, j + pattern.step(s));
    }
  }
  for (const auto& [high, low] : pattern.couplings()) meet(high, low);
  std::vector<int> particle(count);
  for (int i = 0; i < count; ++i) particle[order[i]] = i;
  int next = 0;
  for (Region& region : regions) {
    Particles places;
    for (const int own : region.own) places.insert(places.end(), met[own].begin(), met[own].end());
    for (const int child : region.children) {
      if (child < 0) continue;
      for (const int p : regions[child].border) places.push_back(order[p]);
    }
    next += static_cast<int>(region.own.size());
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    region.border.clear();
    for (const int place : places) {
      if (place >= next) region.border.push_back(particle[place]);
    }
  }
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
  if (!pattern.couplings().empty()) {
    const Ties joined(dissection.regions, pattern);
    find_borders(dissection.regions, pattern);
    return std::move(dissection.regions);
  }
  const std::vector<int> order = elimination_order(dissection.regions, pattern.grid().count());
  for (Region& region : dissection.regions) {
    std::sort(region.border.begin(), region.border.end(),
              [&](int a, int b) { return order[a] < order[b]; });
  }
  return std::move(dissection.regions);
}

}  // namespace drape::simulate
