// SPDX-License-Identifier: Apache-2.0
#include "detect/dot_size.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::detect {

using Eigen::Vector2d;
using units::mm;

std::optional<double> dot_size_ratio(const std::vector<FrameDetections>& frames,
                                     const std::vector<double>& blurs_px,
                                     const MarkLattice& lattice) {
  constexpr std::size_t kFewest = 20;
  if (!(lattice.dot_diameter_m > 0)) return std::nullopt;
  std::vector<double> inner, all;  // of dots between neighbours, and beside any
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameDetections& frame = frames[i];
    std::map<std::pair<int, int>, const Detection*> at;
    for (const Detection& dot : frame.detections) at[{dot.mark.row, dot.mark.col}] = &dot;
    for (const Detection& dot : frame.detections) {
      int neighbours = 0;
      /// From one dot to the next; nothing where the dot has no neighbour in this direction.
      const auto step = [&](int down, int right) -> std::optional<Vector2d> {
        const auto before = at.find({dot.mark.row - down, dot.mark.col - right}),
                   after = at.find({dot.mark.row + down, dot.mark.col + right});
        const int found = int(before != at.end()) + int(after != at.end());
        neighbours += found;
        if (found == 0) return std::nullopt;
        const Detection& from = before == at.end() ? dot : *before->second;
        const Detection& to = after == at.end() ? dot : *after->second;
        return Vector2d((to.centre_px - from.centre_px) / found);
      };
      const auto row = step(1, 0), col = step(0, 1);
      if (!row || !col) continue;
      const double cell_px2 = std::abs(row->x() * col->y() - row->y() * col->x());
      const double area_px2 =
          std::numbers::pi * (dot.semi_axes_px.prod() + blurs_px[i] * blurs_px[i]);
      const double stated = 0.25 * std::numbers::pi * std::pow(lattice.dot_diameter_m, 2);
      all.push_back(std::sqrt(area_px2 / cell_px2 * std::pow(lattice.pitch_m, 2) / stated));
      if (neighbours == 4) inner.push_back(all.back());
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

}  // namespace drape::detect
