// SPDX-License-Identifier: Apache-2.0
#include "detect/labels/print_plane.hpp"

#include <cmath>

namespace drape::detect {

Eigen::Vector2d PrintPlane::point_m(MarkId mark) const {
  return first_m + pitch_m * Eigen::Vector2d(mark.col, mark.row);
}

bool PrintPlane::contains(MarkId mark) const {
  return mark.row >= 0 && mark.row < rows && mark.col >= 0 && mark.col < cols &&
         (!staggered || (mark.row + mark.col) % 2 == 0);
}

std::array<Eigen::Vector2d, 4> PrintPlane::tag_corners_m(int id) const {
  const Eigen::Vector2d centre = tags.at(id);
  const double right = tag_edge_m / 2;
  const double down = row_sign * tag_edge_m / 2;
  return {centre + Eigen::Vector2d(-right, -down), centre + Eigen::Vector2d(right, -down),
          centre + Eigen::Vector2d(right, down), centre + Eigen::Vector2d(-right, down)};
}

std::vector<MarkId> PrintPlane::marks_around(int id) const {
  const Eigen::Vector2d in_pitches = (tags.at(id) - first_m) / pitch_m;
  const int row = static_cast<int>(std::floor(in_pitches.y()));
  const int col = static_cast<int>(std::floor(in_pitches.x()));
  std::vector<MarkId> marks;
  for (const MarkId mark :
       {MarkId{row, col}, MarkId{row, col + 1}, MarkId{row + 1, col}, MarkId{row + 1, col + 1}}) {
    const Eigen::Vector2d away = (point_m(mark) - tags.at(id)) / pitch_m;
    if (contains(mark) && away.cwiseAbs().maxCoeff() <= 0.75) marks.push_back(mark);
  }
  return marks;
}

bool PrintPlane::has_tag_in_cell(MarkId upper_left) const {
  for (const auto& [id, centre] : tags) {
    const Eigen::Vector2d in_cell = (centre - point_m(upper_left)) / pitch_m;
    if (in_cell.minCoeff() > 0 && in_cell.maxCoeff() < 1) return true;
  }
  return false;
}

double PrintPlane::light_centre_fraction() const {
  return classes ? 0.5 * classes->light_centre_diameter_m / dot_radius_m : 0.0;
}

namespace {

/// Copies the values that cloth and target have in common.
template <class Sheet>
PrintPlane common_plane(const Sheet& sheet) {
  PrintPlane plane;
  plane.rows = sheet.rows;
  plane.cols = sheet.cols;
  plane.pitch_m = sheet.pitch_m;
  plane.dot_radius_m = sheet.dot_diameter_m / 2;
  plane.tag_family = sheet.tag_family;
  plane.tag_edge_m = sheet.tag_edge_m;
  return plane;
}

}  // namespace

PrintPlane plane_of(const Target& target) {
  PrintPlane plane = common_plane(target);
  plane.first_m = target.point_in_target({0, 0}).head<2>();
  plane.row_sign = -1;
  plane.stiff = true;
  plane.white_dots = target.dot_colour == DotColour::white;
  plane.staggered = target.arrangement == DotArrangement::staggered;
  if (!target.hollow.empty()) {
    const std::vector<std::string> full(target.rows, std::string(target.cols, '#'));
    plane.classes = DotClasses{target.hollow_diameter_m, full};
    for (const MarkId mark : target.hollow) plane.classes->rows[mark.row][mark.col] = 'o';
  }
  for (const PrintedTag& tag : target.tags) plane.tags[tag.id] = tag.centre_m;
  return plane;
}

PrintPlane plane_of(const Print& print) {
  PrintPlane plane = common_plane(print);
  plane.first_m = print.margin_m.reverse();
  plane.classes = print.dot_classes;
  for (const PrintedTag& tag : print.tags) plane.tags[tag.id] = tag.centre_m.reverse();
  return plane;
}

}  // namespace drape::detect
