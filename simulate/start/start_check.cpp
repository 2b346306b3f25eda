// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/start_check.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/units.hpp"
#include "simulate/contact/piercing.hpp"
#include "simulate/contact/self_distance.hpp"

namespace drape::simulate {
namespace {

using units::mm;

constexpr double kPierced = 1e-4;  // m; less is a sheet that lies on an edge

}  // namespace

std::vector<std::string> faults_of_start(const GridSpec& grid, const Field& position,
                                         const Surroundings& surroundings) {
  std::vector<std::string> faults;
  const int crossings = self_distance(grid, position).crossings;
  if (crossings > 0) {
    faults.push_back(
        fmt::format("the start passes through itself in {} pairs of triangles", crossings));
  }
  const double through_m = std::max(pierced_m(grid, position, surroundings),
                                    rim_through_m(grid, position, surroundings));
  if (through_m > kPierced) {
    faults.push_back(fmt::format(
        "the start is pierced: an edge of an object stands {:.2g} mm through it", through_m / mm));
  }
  return faults;
}

std::string warning_of_lifted(int particles) {
  return fmt::format("{} particles started inside an object and were set on its surface",
                     particles);
}

}  // namespace drape::simulate
