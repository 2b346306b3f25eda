// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

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

}  // namespace drape
