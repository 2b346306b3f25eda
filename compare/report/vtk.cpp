// SPDX-License-Identifier: Apache-2.0
#include "compare/report/vtk.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <map>

#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

std::string array_of(const std::string& name, const char* type, int components,
                     const std::vector<double>& values) {
  return fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">{}"
      "</DataArray>\n",
      type, name, components, fmt::join(values, " "));
}

/// Polygons or lines as indices of their points.
std::string cells_of(const char* tag, const std::vector<std::vector<double>>& cells) {
  std::vector<double> points, ends;
  for (const auto& cell : cells) {
    points.insert(points.end(), cell.begin(), cell.end());
    ends.push_back(static_cast<double>(points.size()));
  }
  return fmt::format("<{0}>\n{1}{2}</{0}>\n", tag, array_of("connectivity", "Int64", 1, points),
                     array_of("offsets", "Int64", 1, ends));
}

}  // namespace

std::string vtp_of(const ReportedDrape& drape, VtkPart part) {
  std::vector<const ReportedMark*> marks;
  std::map<std::pair<int, int>, std::size_t> index;
  for (const ReportedMark& mark : drape.marks) {
    if (!mark.distance_m || !mark.real_in_world || !mark.virtual_in_world) continue;
    index[{mark.row, mark.col}] = marks.size();
    marks.push_back(&mark);
  }
  std::vector<std::vector<double>> cells;
  for (const auto& [id, first] : index) {
    const auto [row, col] = id;
    std::vector<double> cell;
    for (const auto& corner :
         {std::pair{row, col}, {row + 1, col}, {row + 1, col + 1}, {row, col + 1}})
      if (const auto at = index.find(corner); at != index.end())
        cell.push_back(static_cast<double>(at->second));
    if (cell.size() == 4) cells.push_back(std::move(cell));
  }
  std::vector<bool> ends = {part == VtkPart::simulated};
  if (part == VtkPart::distance) {
    ends = {false, true};
    cells.clear();
    for (std::size_t i = 0; i < marks.size(); ++i)
      cells.push_back({static_cast<double>(i), static_cast<double>(i + marks.size())});
  }
  std::vector<double> points;
  for (const bool simulated : ends)
    for (const ReportedMark* mark : marks)
      for (const double x :
           Eigen::Vector3d((simulated ? *mark->virtual_in_world : *mark->real_in_world) / mm))
        points.push_back(x);
  const auto scalars = [&](const std::string& name,
                           const std::function<double(const ReportedMark&)>& of) {
    std::vector<double> values;
    for (std::size_t end = 0; end < ends.size(); ++end)
      for (const ReportedMark* mark : marks) values.push_back(of(*mark));
    return array_of(name, "Float64", 1, values);
  };
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  const auto length = [](const std::optional<double>& x) { return x ? *x / mm : unknown; };
  const bool lines = part == VtkPart::distance;
  return fmt::format(
             "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
             "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<Piece "
             "NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" "
             "NumberOfPolys=\"{}\">\n<PointData Scalars=\"distance_mm\">\n",
             points.size() / 3, lines ? cells.size() : 0, lines ? 0 : cells.size()) +
         scalars("distance_mm", [&](const auto& mark) { return length(mark.distance_m); }) +
         scalars("sigma_distance_mm",
                 [&](const auto& mark) { return length(mark.sigma_distance_m); }) +
         scalars("sigma_mm", [&](const auto& mark) { return length(mark.sigma_m); }) +
         scalars("row", [](const auto& mark) { return static_cast<double>(mark.row); }) +
         scalars("col", [](const auto& mark) { return static_cast<double>(mark.col); }) +
         "</PointData>\n<Points>\n" + array_of("Points", "Float64", 3, points) + "</Points>\n" +
         cells_of(lines ? "Lines" : "Polys", cells) + "</Piece>\n</PolyData>\n</VTKFile>\n";
}

}  // namespace drape::compare
