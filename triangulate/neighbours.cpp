// SPDX-License-Identifier: Apache-2.0
#include "triangulate/neighbours.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/units.hpp"

namespace drape::triangulate {
namespace {

using ByMark = std::map<MarkId, const SheetMark*>;

constexpr double kNeighbourSigmas = 4;

/// Largest possible distance of two marks `steps` apart, allowing for their uncertainty.
double limit_m(const SheetMark& a, const SheetMark& b, int steps, double pitch_m,
               double max_stretch) {
  const Eigen::Vector3d along = (a.point_in_world - b.point_in_world).normalized();
  const Eigen::Matrix3d covariance = a.covariance_m2.value_or(Eigen::Matrix3d::Zero()) +
                                     b.covariance_m2.value_or(Eigen::Matrix3d::Zero());
  return steps * pitch_m * max_stretch +
         kNeighbourSigmas * std::sqrt(along.dot(covariance * along));
}

/// Neighbours along warp and weft that are farther away than the cloth permits.
std::vector<MarkId> violations(const SheetMark& mark, const ByMark& all, double pitch_m,
                               double max_stretch) {
  constexpr std::array<std::array<int, 2>, 4> kDirections = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  std::vector<MarkId> found;
  for (const auto& direction : kDirections) {
    for (const int steps : {1, 2}) {
      const auto other =
          all.find({mark.mark.row + steps * direction[0], mark.mark.col + steps * direction[1]});
      if (other == all.end()) continue;
      const double distance = (mark.point_in_world - other->second->point_in_world).norm();
      if (distance > limit_m(mark, *other->second, steps, pitch_m, max_stretch))
        found.push_back(other->first);
    }
  }
  return found;
}

ByMark by_mark(const std::vector<SheetMark>& marks) {
  ByMark all;
  for (const SheetMark& mark : marks) all[mark.mark] = &mark;
  return all;
}

}  // namespace

std::map<MarkId, std::string> too_far_from_neighbours(const std::vector<SheetMark>& marks,
                                                      double pitch_m, double max_stretch) {
  ByMark all = by_mark(marks);
  std::map<MarkId, std::string> bad;
  for (;;) {
    MarkId worst;
    std::vector<MarkId> worst_pairs;
    for (const auto& [id, mark] : all) {
      auto pairs = violations(*mark, all, pitch_m, max_stretch);
      if (pairs.size() > worst_pairs.size()) {
        worst = id;
        worst_pairs = std::move(pairs);
      }
    }
    if (worst_pairs.size() < 2) return bad;
    bad[worst] = fmt::format(
        "views disagree with the cloth: farther from {} neighbours than {:g} times their distance "
        "on the print, first from ({}, {})",
        worst_pairs.size(), max_stretch, worst_pairs.front().row, worst_pairs.front().col);
    all.erase(worst);
  }
}

std::vector<std::string> suspicious_pairs(const std::vector<SheetMark>& marks, double pitch_m,
                                          double max_stretch) {
  const ByMark all = by_mark(marks);
  std::vector<std::string> pairs;
  for (const auto& [id, mark] : all) {
    for (const MarkId other : violations(*mark, all, pitch_m, max_stretch)) {
      if (!(id < other)) continue;
      const double distance = (mark->point_in_world - all.at(other)->point_in_world).norm();
      pairs.push_back(
          fmt::format("marks ({}, {}) and ({}, {}) are {:.2f} mm apart, more than {:g} "
                      "times their distance on the print",
                      id.row, id.col, other.row, other.col, distance / units::mm, max_stretch));
    }
  }
  return pairs;
}

}  // namespace drape::triangulate
