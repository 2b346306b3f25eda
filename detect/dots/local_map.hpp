// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace drape::detect {

/// Image of a printed point, and how the print maps to the image around it.
struct LocalMap {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d px_per_m;  ///< derivative of the pixel by the position on the print
};

/// The map at the middle of a quadrangle, from the homography of its four corners; nothing for
/// degenerate corners.
[[nodiscard]] std::optional<LocalMap> map_at_centre(const std::array<Eigen::Vector2d, 4>& print_m,
                                                    const Eigen::Matrix<double, 2, 4>& corners_px,
                                                    const Eigen::Vector2d& centre_m);

/// Map at a dot, from the symmetric root of its ellipse's shape divided by the dot's radius (px per
/// m): the ellipse J J^T fixes J up to a rotation within the print, and the rotation is taken that
/// brings J closest to a neighbour's map.
[[nodiscard]] Eigen::Matrix2d turned_root(const Eigen::Matrix2d& root_px_per_m,
                                          const Eigen::Matrix2d& neighbour_px_per_m);

/// Symmetric square root of a positive semi-definite matrix.
[[nodiscard]] Eigen::Matrix2d symmetric_root(const Eigen::Matrix2d& square);

/// Misfit of two neighbours: the distance between `to` and the place that the mean of
/// both maps predicts (the trapezoid rule, exact for constant curvature), measured in steps.
[[nodiscard]] double step_error(const LocalMap& from, const LocalMap& to,
                                const Eigen::Vector2d& step_m);

/// A dot to be labelled.
struct UnlabelledDot {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d shape_px2;
  bool sound = true;                      ///< only sound dots lead on to their neighbours
  std::optional<bool> light_centre = {};  ///< class, where the print has two and this dot shows it
};

/// Dots of a picture in square cells, so that a search near a place looks at few of them.
class DotCells {
 public:
  explicit DotCells(const std::vector<UnlabelledDot>& dots);

  /// Indices of the dots at most `reach_px` from a place, ascending.
  [[nodiscard]] std::vector<std::size_t> within(const Eigen::Vector2d& px, double reach_px) const;
  /// Dots that all searches have looked at so far: their cost.
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

/// The dot that fits a step from a known place best, and how clearly.
struct BestStep {
  double error = 1e9;   ///< see step_error(); large when no dot fits at all
  double second = 1e9;  ///< error of the next best dot
  std::size_t dot = 0;
  LocalMap to;  ///< the local map at that dot

  /// True when the step misses by little and no other dot fits nearly as well.
  [[nodiscard]] bool is_clear() const;
};

// A correct step misses by the change of curvature along it: a few per cent on gentle cloth, up to
// a quarter of a step where a fold begins. A wrong dot misses by about one step.
inline constexpr double most_step_error = 0.28;
inline constexpr double blind_step_error = 0.10;  ///< without support from what is around

/// Largest step error of a label that has this support from what is around it, 0 to 1.
[[nodiscard]] inline double step_tolerance(double support) {
  return blind_step_error + (most_step_error - blind_step_error) * support;
}

/// The dots of a frame as goals of steps. Keeps a reference to `dots`.
class DotSteps {
 public:
  DotSteps(const std::vector<UnlabelledDot>& dots, double dot_radius_m);

  /// Best of the dots that are not `taken` (same order as the dots).
  [[nodiscard]] BestStep best(const LocalMap& from, const Eigen::Vector2d& step_m,
                              const std::vector<char>& taken) const;

  /// Local map at a dot, turned as near to a neighbour's as its ellipse allows.
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
  std::vector<double> sizes_;  ///< by how much the roots lengthen a vector at most
  double largest_ = 0;         ///< largest of the sizes
};

}  // namespace drape::detect
