// SPDX-License-Identifier: Apache-2.0
#include "core/prints/face.hpp"

#include <cmath>
#include <cstdlib>

namespace drape {
namespace {

template <class Sheet>
void add_tags(const Sheet& sheet, int border_modules, Face& face) {
  if (sheet.tags.empty()) return;
  const TagFamily family(sheet.tag_family, border_modules);
  for (const PrintedTag& tag : sheet.tags)
    face.areas.push_back(family.boxes(tag.id, sheet.tag_edge_m, face_point(sheet, tag)));
}

void add_dots(const Print& print, Face& face) {
  for (int row = 0; row < print.rows; ++row)
    for (int col = 0; col < print.cols; ++col)
      face.discs.push_back({face_point(print, {row, col}), print.dot_diameter_m / 2, 1});
}

/// Adds dots; white ones are left blank in a black plate that ends half a pitch beyond them.
void add_dots(const Target& target, Face& face) {
  const double ink = target.dot_colour == DotColour::white ? -1 : 1;
  for (int row = 0; row < target.rows; ++row)
    for (int col = 0; col < target.cols; ++col)
      if (target.has({row, col}))
        face.discs.push_back({face_point(target, {row, col}), target.dot_diameter_m / 2, ink});
  for (const MarkId mark : target.hollow)
    face.discs.push_back({face_point(target, mark), target.hollow_diameter_m / 2, -ink});
  if (ink > 0) return;
  const FacePoint most =
      face_point(target, {0, target.cols - 1}) + FacePoint::Constant(target.pitch_m / 2);
  face.areas.push_back({{-most, most}});
}

/// Squares of a board: dark where the sum of row and column is even, with square (0, 0) between the
/// corners (0, 0) and (1, 1); on a board with tags, dark where there is no tag.
std::vector<FaceBox> squares_of(const Target& target) {
  std::vector<FaceBox> dark;
  // The square of the first tag, numbered as in the loops below.
  const FacePoint light = target.tags.empty() ? FacePoint(0, 1)
                                              : (target.tags.front().centre_m / target.pitch_m +
                                                 FacePoint(target.cols - 2, target.rows - 2) / 2);
  const int odd = std::abs(static_cast<int>(std::lround(light.x() + light.y())) + 1) % 2;
  for (int row = -1; row < target.rows; ++row) {
    for (int col = -1; col < target.cols; ++col) {
      if ((row + col + 2) % 2 != odd) continue;
      // Rows of a target count upwards on the face, so a square extends down from its corner.
      const FacePoint least = face_point(target, {row + 1, col});
      dark.push_back({least, least + FacePoint::Constant(target.pitch_m)});
    }
  }
  return dark;
}

/// Small black squares where the gaps between tags cross, so that two dark and two light quadrants
/// meet at every corner of a tag (Kalibr's AprilGrid).
std::vector<FaceBox> small_squares_of(const Target& target) {
  const double gap = target.pitch_m - target.tag_edge_m;
  const FacePoint first = face_point(target, {0, 0});
  std::vector<FaceBox> squares;
  for (int row = -1; row < target.rows; row += 2) {
    for (int col = -1; col < target.cols; col += 2) {
      const FacePoint middle = first + target.pitch_m / 2 * FacePoint(col + 1, -(row + 1)) -
                               FacePoint(1, -1) * (gap / 2);
      squares.push_back(
          {middle - FacePoint::Constant(gap / 2), middle + FacePoint::Constant(gap / 2)});
    }
  }
  return squares;
}

}  // namespace

FacePoint face_point(const Print& print, MarkId mark) {
  return print.material_m(mark).reverse();
}

FacePoint face_point(const Print&, const PrintedTag& tag) {
  return tag.centre_m.reverse();
}

FacePoint face_point(const Target&, const PrintedTag& tag) {
  return {tag.centre_m.x(), -tag.centre_m.y()};
}

FacePoint face_point(const Target& target, MarkId mark) {
  const Eigen::Vector3d point = target.point_in_target(mark);
  return {point.x(), -point.y()};
}

Face face_of(const Print& print) {
  Face face;
  add_dots(print, face);
  for (int row = 0; print.dot_classes && row < print.rows; ++row)
    for (int col = 0; col < print.cols; ++col)
      if (print.dot_classes->is_light({row, col}))
        face.discs.push_back(
            {face_point(print, {row, col}), print.dot_classes->light_centre_diameter_m / 2, -1});
  add_tags(print, 1, face);
  return face;
}

Face face_of(const Target& target) {
  Face face;
  if (target.kind == TargetKind::dot_grid) {
    add_dots(target, face);
  } else {
    face.areas.push_back(target.kind == TargetKind::aprilgrid ? small_squares_of(target)
                                                              : squares_of(target));
  }
  add_tags(target, target.tag_border, face);
  return face;
}

}  // namespace drape
