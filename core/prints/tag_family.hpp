// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

struct apriltag_family;

namespace drape {

/// Coordinates on a printed face, metres: x to the right and y down, as one looks at the print.
/// Cloth: x along the weft, y along the warp, from the patch's corner beside mark (0, 0). Target:
/// (x, -y) of its frame.
using FacePoint = Eigen::Vector2d;

/// A printed rectangle along the axes of a face.
struct FaceBox {
  FacePoint least, most;
};

/// The tags of one AprilTag family or of one of OpenCV's dictionaries, with a black rim of one or
/// more modules around their bits: one is the library's own, Kalibr's grids have two (Olson 2011;
/// the AprilTag 3 library).
class TagFamily {
 public:
  /// Throws Error(bad_input) for a family that is not known or a rim outside 1 to 4 modules.
  explicit TagFamily(const std::string& name, int border_modules = 1);

  /// Names of the AprilTag families that are known, without OpenCV's dictionaries.
  [[nodiscard]] static std::vector<std::string> names();

  [[nodiscard]] int count() const;         ///< number of different tags
  [[nodiscard]] int edge_modules() const;  ///< along the black square
  /// Side of the square that black() covers: the black square and its white margin, or a family
  /// whose bits reach beyond its border.
  [[nodiscard]] int total_modules() const;
  /// A module of a tag standing upright, from its upper left.
  [[nodiscard]] bool black(int id, int x, int y) const;
  /// The black modules of an upright tag around a centre, row by row. Throws Error(bad_input) for
  /// an id that the family does not have.
  [[nodiscard]] std::vector<FaceBox> boxes(int id, double edge_m, const FacePoint& centre) const;
  /// The library's own description, for its detector; lives as long as the family.
  [[nodiscard]] apriltag_family* library() const { return family_.get(); }

 private:
  std::string name_;
  std::shared_ptr<apriltag_family> family_;
};

}  // namespace drape
