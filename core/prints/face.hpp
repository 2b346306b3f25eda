// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/rig.hpp"

struct apriltag_family;

namespace drape {

/// Coordinates on a printed face, in metres: x to the right, y down, looking at the print. Cloth: x
/// along the weft, y along the warp, from the corner of the patch next to mark (0, 0). Target: (x,
/// -y) of its frame.
using FacePoint = Eigen::Vector2d;

/// A printed rectangle aligned with the axes of a face.
struct FaceBox {
  FacePoint least, most;
};

/// The tags of an AprilTag family or of an OpenCV dictionary, with a black border of one or more
/// modules around the bits: one in the AprilTag library, two in Kalibr's grids (Olson 2011;
/// AprilTag 3).
class TagFamily {
 public:
  /// Throws Error(bad_input) for an unknown family or a border outside 1 to 4 modules.
  explicit TagFamily(const std::string& name, int border_modules = 1);

  /// Names of the supported AprilTag families, without OpenCV's dictionaries.
  [[nodiscard]] static std::vector<std::string> names();

  [[nodiscard]] int count() const;         ///< number of distinct tags
  [[nodiscard]] int edge_modules() const;  ///< side of the black square, in modules
  /// Side of the square covered by black(): the black square with its white margin; larger for
  /// families with data bits outside the border.
  [[nodiscard]] int total_modules() const;
  /// True if a module of an upright tag is black; x and y count from the upper left.
  [[nodiscard]] bool black(int id, int x, int y) const;
  /// The black modules of an upright tag around a centre, row by row. Throws Error(bad_input) for
  /// an id that the family does not have.
  [[nodiscard]] std::vector<FaceBox> boxes(int id, double edge_m, const FacePoint& centre) const;
  /// The AprilTag library's own structure, for its detector; lives as long as the family.
  [[nodiscard]] apriltag_family* library() const { return family_.get(); }

 private:
  std::string name_;
  std::shared_ptr<apriltag_family> family_;
};

/// A disc on a printed face.
struct FaceDisc {
  FacePoint centre;
  double radius_m = 0;
  double ink = 1;  ///< +1 prints; -1 erases the print of discs and areas below it
};

/// Everything printed on a cloth or a calibration target.
struct Face {
  std::vector<FaceDisc> discs;  ///< dots first, then the light centres on them
  /// Plate or board squares in black, then the modules of each tag; all below the discs.
  std::vector<std::vector<FaceBox>> areas;
};

/// Throws Error(bad_input) if the print's tag family is unknown or lacks one of its tags.
[[nodiscard]] Face face_of(const Print& print);
[[nodiscard]] Face face_of(const Target& target);

/// Position of a mark, or of a tag's centre, on the face.
[[nodiscard]] FacePoint face_point(const Print& print, MarkId mark);
[[nodiscard]] FacePoint face_point(const Print& print, const PrintedTag& tag);
[[nodiscard]] FacePoint face_point(const Target& target, MarkId mark);
[[nodiscard]] FacePoint face_point(const Target& target, const PrintedTag& tag);

}  // namespace drape
