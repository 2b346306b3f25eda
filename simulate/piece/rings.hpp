// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "simulate/mesh/material_mesh.hpp"

namespace drape::simulate {

constexpr std::size_t kMostCorners = 20000;  ///< of an outline, after its curves were cut
constexpr double kFarthest_m = 10;           ///< of a corner from the patch's own
constexpr double kSamePlace = 1e-3;          ///< of the spacing: two places that are one

/// Collects closed rings of lines and curves as polygons (warp, weft) in metres. Curves are cut
/// into pieces of equal length, about the spacing; corners stay.
class RingBuilder {
 public:
  explicit RingBuilder(double spacing_m) : spacing_m_(spacing_m) {}

  /// The frame of what follows: metres of (weft, warp) from the file's own units.
  Eigen::Affine2d to_metres = Eigen::Affine2d::Identity();

  void begin(const Eigen::Vector2d& at);
  void line_to(const Eigen::Vector2d& to);
  /// `place`: the curve's points for 0 .. 1, from the present one on, in the file's own units.
  void curve(const std::function<Eigen::Vector2d(double)>& place);
  /// Closes the ring, of as many corners as stand apart from each other.
  void close();
  [[nodiscard]] bool is_open() const { return open_; }
  /// Whether the present point is where the ring began, within a thousandth of the spacing.
  [[nodiscard]] bool has_returned() const;

  /// More corners, or longer lines, than a piece of cloth has; what follows is then left out.
  [[nodiscard]] bool is_beyond_limits() const { return beyond_limits_; }

  [[nodiscard]] const std::vector<Polygon>& rings() const { return rings_; }

 private:
  void add(const Eigen::Vector2d& metres);

  double spacing_m_;
  bool open_ = false, beyond_limits_ = false;
  std::size_t corners_ = 0;
  Polygon ring_;
  std::vector<Polygon> rings_;
};

/// Adds the rings of an SVG's path data (SVG 1.1, section 8.3). `refuse` throws with its sentence
/// and the character at which the data are wrong, or a ring is left open.
void add_path(const std::string& data, RingBuilder& builder,
              const std::function<void(const std::string& why, std::size_t at)>& refuse);

/// Rings of all shapes of an SVG file. Throws as read_outline().
[[nodiscard]] std::vector<Polygon> rings_of_svg(const std::filesystem::path& file,
                                                double spacing_m);

}  // namespace drape::simulate
