// SPDX-License-Identifier: Apache-2.0
#include "detect/dot_size.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "core/numbers/order.hpp"
#include "core/units.hpp"

namespace drape::detect {

using Eigen::Vector2d;
using units::mm;

std::optional<double> dot_size_ratio(const std::vector<FrameDetections>& frames,
                                     const MarkLattice& lattice) {
  constexpr std::size_t kFewest = 20;
  if (!(lattice.dot_diameter_m > 0)) return std::nullopt;
  std::vector<double> ratios;
  for (const FrameDetections& frame : frames) {
    std::map<std::pair<int, int>, const Detection*> at;
    for (const Detection& dot : frame.detections) at[{dot.mark.row, dot.mark.col}] = &dot;
    /// Half of what lies between the two neighbours of a dot; nothing where one is missing.
    const auto step = [&](const Detection& dot, int down, int right) -> std::optional<Vector2d> {
      const auto before = at.find({dot.mark.row - down, dot.mark.col - right}),
                 after = at.find({dot.mark.row + down, dot.mark.col + right});
      if (before == at.end() || after == at.end()) return std::nullopt;
      return Vector2d(0.5 * (after->second->centre_px - before->second->centre_px));
    };
    for (const Detection& dot : frame.detections) {
      const auto row = step(dot, 1, 0), col = step(dot, 0, 1);
      if (!row || !col) continue;
      const double cell_px2 = std::abs(row->x() * col->y() - row->y() * col->x());
      const double area_px2 = std::numbers::pi * dot.semi_axes_px.prod();
      const double stated = 0.25 * std::numbers::pi * std::pow(lattice.dot_diameter_m, 2);
      ratios.push_back(std::sqrt(area_px2 / cell_px2 * std::pow(lattice.pitch_m, 2) / stated));
    }
  }
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
