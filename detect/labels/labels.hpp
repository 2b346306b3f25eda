// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/marks.hpp"
#include "core/rig.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// Print on a flat surface, cloth or target, in one plane frame: x along the columns, y along the
/// rows, metres. Seen from the printed side the frame is right-handed for a target (y up) and
/// left-handed for a cloth (y down).
struct PrintPlane {
  int rows = 0, cols = 0;
  double pitch_m = 0;
  double dot_radius_m = 0;
  Eigen::Vector2d first_m = Eigen::Vector2d::Zero();  ///< position of mark (0, 0)
  std::string tag_family;
  double tag_edge_m = 0;
  double row_sign = 1;  ///< +1 if rows run down with upright tags (cloth), -1 if up (target)
  std::optional<DotClasses> classes = {};
  bool stiff = false;                        ///< a plate rather than cloth
  bool white_dots = false;                   ///< on a black plate
  bool staggered = false;                    ///< dots only where row + col is even
  std::map<int, Eigen::Vector2d> tags = {};  ///< centre by id

  [[nodiscard]] Eigen::Vector2d point_m(MarkId mark) const;
  /// Centre of the cell between a mark and the one in the next row and column.
  [[nodiscard]] Eigen::Vector2d cell_centre_m(MarkId upper_left) const {
    return point_m(upper_left) + 0.5 * pitch_m * Eigen::Vector2d::Ones();
  }
  [[nodiscard]] bool contains(MarkId mark) const;
  /// Corners of an upright tag: upper left, upper right, lower right, lower left.
  [[nodiscard]] std::array<Eigen::Vector2d, 4> tag_corners_m(int id) const;
  /// Marks around a tag: at most 0.75 pitch away along both axes.
  [[nodiscard]] std::vector<MarkId> marks_around(int id) const;
  /// True if the centre of a tag lies in the cell between (row, col) and (row + 1, col + 1).
  [[nodiscard]] bool has_tag_in_cell(MarkId upper_left) const;
  /// Radius of the light centre that some dots have, in radii of the dot; 0 if none has.
  [[nodiscard]] double light_centre_fraction() const;
};

[[nodiscard]] PrintPlane plane_of(const Target& target);
[[nodiscard]] PrintPlane plane_of(const Print& print);

/// Image of a printed point, with the derivative of the map from print to image there.
struct LocalMap {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d px_per_m;  ///< derivative of the pixel by the position on the print
};

/// Local map at the centre of a quadrilateral, from the homography of its four corners; nullopt for
/// degenerate corners.
[[nodiscard]] std::optional<LocalMap> map_at_centre(const std::array<Eigen::Vector2d, 4>& print_m,
                                                    const Eigen::Matrix<double, 2, 4>& corners_px,
                                                    const Eigen::Vector2d& centre_m);

/// Local map at a dot, given the symmetric root of its ellipse's shape over the dot's radius (px
/// per m). The ellipse J J^T determines J up to a rotation within the print; the rotation that
/// brings J closest to a neighbour's map is used.
[[nodiscard]] Eigen::Matrix2d turned_root(const Eigen::Matrix2d& root_px_per_m,
                                          const Eigen::Matrix2d& neighbour_px_per_m);

/// Symmetric square root of a positive semi-definite matrix.
[[nodiscard]] Eigen::Matrix2d symmetric_root(const Eigen::Matrix2d& square);

/// Prediction error of a step between neighbours: distance from `to` to the position predicted by
/// the mean of both maps (trapezoidal rule, exact for constant curvature), relative to the step.
[[nodiscard]] double step_error(const LocalMap& from, const LocalMap& to,
                                const Eigen::Vector2d& step_m);

/// A dot that needs a label.
struct UnlabelledDot {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d shape_px2;
  bool sound = true;                      ///< only sound dots lead to their neighbours
  std::optional<bool> light_centre = {};  ///< class, if the print has two and this dot shows it
};

/// Dots of a picture in a grid of cells, so that a local search examines few of them.
class DotCells {
 public:
  explicit DotCells(const std::vector<UnlabelledDot>& dots);

  /// Indices of the dots within `reach_px` of a position, ascending.
  [[nodiscard]] std::vector<std::size_t> within(const Eigen::Vector2d& px, double reach_px) const;
  /// Number of dots examined by all searches so far, a measure of cost.
  [[nodiscard]] std::size_t looked_at() const { return looked_at_; }

 private:
  [[nodiscard]] Eigen::Array2i cell_of(const Eigen::Array2d& px) const;

  const std::vector<UnlabelledDot>& dots_;
  Eigen::Array2d first_px_ = Eigen::Array2d::Zero();
  double side_px_ = 1;
  Eigen::Array2i size_ = Eigen::Array2i::Ones();
  std::vector<std::vector<std::size_t>> cells_;
  mutable std::size_t looked_at_ = 0;
};

/// The dot that best matches a step from a known position, and how clearly.
struct BestStep {
  double error = 1e9;   ///< see step_error(); large if no dot matches
  double second = 1e9;  ///< error of the second-best dot
  std::size_t dot = 0;
  LocalMap to;  ///< local map at that dot

  /// True if the error is small and no other dot matches nearly as well.
  [[nodiscard]] bool is_clear() const;
};

// Largest error of a correct step, due to the change of curvature along it: a few per cent on
// gentle cloth, up to a quarter at the onset of a fold. A wrong dot is off by about one step.
inline constexpr double most_step_error = 0.28;
inline constexpr double blind_step_error = 0.10;  ///< without support from the surroundings

/// Largest allowed step error of a label with this support from its surroundings, 0 to 1.
[[nodiscard]] inline double step_tolerance(double support) {
  return blind_step_error + (most_step_error - blind_step_error) * support;
}

/// Finds the dots of a frame at the ends of steps. Keeps a reference to `dots`.
class DotSteps {
 public:
  DotSteps(const std::vector<UnlabelledDot>& dots, double dot_radius_m);

  /// Best match among the dots that are not `taken` (same order as the dots).
  [[nodiscard]] BestStep best(const LocalMap& from, const Eigen::Vector2d& step_m,
                              const std::vector<char>& taken) const;

  /// Local map at a dot, rotated as close to a neighbour's as its ellipse allows.
  [[nodiscard]] LocalMap map_at(std::size_t dot, const LocalMap& neighbour) const {
    return {dots_[dot].centre_px, turned_root(roots_[dot], neighbour.px_per_m)};
  }

  /// Symmetric root of a dot's ellipse, px per m of the print.
  [[nodiscard]] const Eigen::Matrix2d& root(std::size_t dot) const { return roots_[dot]; }
  [[nodiscard]] const DotCells& cells() const { return cells_; }

 private:
  const std::vector<UnlabelledDot>& dots_;
  DotCells cells_;
  std::vector<Eigen::Matrix2d> roots_;
  std::vector<double> sizes_;  ///< largest stretch by each root
  double largest_ = 0;         ///< maximum of `sizes_`
};

/// Dots that form a piece of the print's lattice. Rows and columns start at 0 within the piece and
/// are correct up to a shift and quarter turns, never a reflection, since only one side of a print
/// is visible.
using LatticePiece = std::map<MarkId, std::size_t>;  ///< position in the piece -> index of the dot

/// Grows pieces from the dots that are not `taken`, without tags or labels. A piece starts at a dot
/// whose neighbours lie where its own ellipse predicts them; each clear step must agree with all
/// neighbours already in the piece. Largest piece first; pieces with fewer than four dots are
/// dropped.
[[nodiscard]] std::vector<LatticePiece> grow_pieces(const PrintPlane& plane,
                                                    const std::vector<UnlabelledDot>& dots,
                                                    const std::vector<char>& taken);

/// Extends a piece of a flat, stiff print across holes: the homography through its dots predicts
/// the positions of the others, up to a fifth of a pitch for lens distortion.
void fill_flat_piece(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                     LatticePiece& piece);

/// Locates a piece by the classes of its dots, unique in every 3 x 3 window: at the only position
/// where they agree. nullopt if too few dots show their class or two positions match nearly as
/// well. If few dots of the print have a light centre, the piece must show all of them. Drops dots
/// that disagree.
[[nodiscard]] std::optional<LatticePiece> place_by_classes(const PrintPlane& plane,
                                                           const std::vector<UnlabelledDot>& dots,
                                                           const LatticePiece& piece);

/// Locates a piece that spans the whole print, up to the print's own symmetry: half a turn, or
/// quarter turns if rows equal columns. Chooses the orientation whose columns run to the right in
/// the picture. nullopt for a piece that could also lie elsewhere on the print.
[[nodiscard]] std::optional<LatticePiece> place_whole_piece(const PrintPlane& plane,
                                                            const std::vector<UnlabelledDot>& dots,
                                                            const LatticePiece& piece);

/// Finds dots of a plate more than a quarter of a pitch from the position interpolated from both
/// sides, or else extrapolated from two dots on one side: no lens distorts a plate that much.
[[nodiscard]] std::vector<std::size_t> off_the_plate(const std::vector<UnlabelledDot>& dots,
                                                     const LatticePiece& labelled);

/// Label of a dot, or the reason why it has none; both for a label that was
/// withdrawn.
struct DotLabel {
  std::optional<MarkId> mark;
  std::string reason;  ///< empty if the label is valid
};

/// Labels dots, best match first, from adjacent tags and from labelled neighbours. A step is
/// accepted only if it satisfies the trapezoidal rule with both local maps and no other dot matches
/// nearly as well. A label must agree with labelled neighbours and with the tags present or absent
/// around it. The result is in the order of `dots`.
[[nodiscard]] std::vector<DotLabel> label_dots(const PrintPlane& plane,
                                               const std::vector<TagDetection>& tags,
                                               const std::vector<UnlabelledDot>& dots,
                                               const DarkMap& map);

}  // namespace drape::detect
