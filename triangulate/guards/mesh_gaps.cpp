// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/mesh_gaps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/geometry/closed_mesh.hpp"
#include "core/parallel.hpp"
#include "core/statistics/distributions.hpp"
#include "core/units.hpp"
#include "triangulate/guards/object_fit.hpp"

namespace drape::triangulate {

using units::mm;

std::vector<double> gaps_to_mesh(const Sheet& sheet, const MeshObject& object, int threads) {
  const ClosedMesh mesh = ClosedMesh::read(object.file);
  const auto mesh_from_world = object.world_from_mesh.inverse();
  std::vector<double> gaps(sheet.marks.size());
  parallel_for(gaps.size(), threads, [&](std::size_t i) {
    gaps[i] = mesh.distance(mesh_from_world * sheet.marks[i].point_in_world).gap_m;
  });
  return gaps;
}

double most_inside_m(const ObjectUncertainty& stated, const SheetMark& mark) {
  return std::sqrt(chi_square_beyond(kObjectRisk, 4)) *
             std::hypot(stated.place_m(), stated.size_m()) +
         kObjectSigmas * std::hypot(sigma_m(mark), kCrease_m);
}

std::string contradiction_of_mesh(const Sheet& sheet, const std::vector<double>& gaps,
                                  const MeshObject& object, const ObjectUncertainty& stated) {
  int inside = 0;
  std::size_t deepest = 0;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    inside += -gaps[i] > most_inside_m(stated, sheet.marks[i]);
    if (gaps[i] < gaps[deepest]) deepest = i;
  }
  if (inside == 0) return {};
  const SheetMark& mark = sheet.marks[deepest];
  return fmt::format(
      "{} mark{} deep inside {}, ({}, {}) by {:.2f} mm, and where place ({:.2f} mm) and size "
      "({:.2f} mm) are as uncertain as stated no mark lies deeper than {:.2f}; compare the file's "
      "unit and size, origin_mm and yaw_deg with the object, or measure it with a plate of tags "
      "(drape object)",
      inside, inside == 1 ? " lies" : "s lie", object.file.string(), mark.mark.row, mark.mark.col,
      -gaps[deepest] / mm, stated.place_m() / mm, stated.size_m() / mm,
      most_inside_m(stated, mark) / mm);
}

}  // namespace drape::triangulate
