// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/strain.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "compare/metrics/surface.hpp"

namespace drape::compare {
namespace {

/// One mark of the lattice on the print, on the real and on the virtual sheet.
struct Place {
  MarkId mark;
  Eigen::Vector2d material_m;
  Eigen::Vector3d real, simulated;
};

std::optional<Place> place_of(const Sheet& measured, const Surface& surface, MarkId mark) {
  const SheetMark* found = measured.find(mark);
  if (found == nullptr) return std::nullopt;
  const auto point = surface.at(found->material_m);
  if (!point) return std::nullopt;
  return Place{mark, found->material_m, found->point_in_world, point->point_in_world};
}

double area_of(const std::array<Eigen::Vector3d, 4>& p) {
  return 0.5 * ((p[1] - p[0]).cross(p[2] - p[0]).norm() + (p[2] - p[0]).cross(p[3] - p[0]).norm());
}

EdgeStrain edge_of(const Place& a, const Place& b, bool along_warp) {
  const double rest = (b.material_m - a.material_m).norm();
  return {a.mark, b.mark, along_warp, (b.real - a.real).norm() / rest - 1,
          (b.simulated - a.simulated).norm() / rest - 1};
}

AreaStrain cell_of(const Place& a, const Place& b, const Place& c, const Place& d) {
  const double rest = std::abs((c.material_m - a.material_m).prod());
  return {a.mark, area_of({a.real, b.real, c.real, d.real}) / rest - 1,
          area_of({a.simulated, b.simulated, c.simulated, d.simulated}) / rest - 1};
}

/// Accumulates a root mean square.
struct Squares {
  double sum = 0;
  int count = 0;

  void add(double value) {
    sum += value * value;
    ++count;
  }
  [[nodiscard]] std::optional<double> root() const {
    return count > 0 ? std::optional(std::sqrt(sum / count)) : std::nullopt;
  }
};

StrainSummary summary_of(const StrainMaps& maps) {
  Squares warp, weft, area;
  for (const EdgeStrain& edge : maps.edges)
    (edge.along_warp ? warp : weft).add(edge.real - edge.simulated);
  for (const AreaStrain& cell : maps.cells) area.add(cell.real - cell.simulated);
  return {warp.root(), weft.root(), area.root()};
}

}  // namespace

StrainMaps strain_maps(const Sheet& measured, const Surface& virtual_sheet) {
  StrainMaps maps;
  for (const SheetMark& mark : measured.marks) {
    const auto [row, col] = mark.mark;
    const auto a = place_of(measured, virtual_sheet, {row, col});
    if (!a) continue;
    const auto b = place_of(measured, virtual_sheet, {row + 1, col});
    const auto c = place_of(measured, virtual_sheet, {row + 1, col + 1});
    const auto d = place_of(measured, virtual_sheet, {row, col + 1});
    if (b) maps.edges.push_back(edge_of(*a, *b, true));
    if (d) maps.edges.push_back(edge_of(*a, *d, false));
    if (b && c && d) maps.cells.push_back(cell_of(*a, *b, *c, *d));
  }
  maps.difference = summary_of(maps);
  return maps;
}

}  // namespace drape::compare
