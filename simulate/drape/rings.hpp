// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simulate/mesh/material_mesh.hpp"

namespace drape::simulate {

constexpr std::size_t kMostCorners =
    20000;                           ///< most corners of an outline, after its curves were cut
constexpr double kFarthest_m = 10;   ///< largest distance of a corner from the patch's own
constexpr double kSamePlace = 1e-3;  ///< share of the spacing: two places that are one

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
  /// True if the present point is where the ring began, within a thousandth of the spacing.
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

/// Numbers of SVG's attributes, parted by spaces and commas, or by nothing where a sign or a second
/// point begins the next (SVG 1.1, section 8.3.9). Independent of the locale.
class NumberReader {
 public:
  explicit NumberReader(std::string text) : text_(std::move(text)) {}

  /// Reads a number; absent, and the place stays, where no finite one is there.
  [[nodiscard]] std::optional<double> next();
  /// A flag of an arc: the single character 0 or 1.
  [[nodiscard]] std::optional<bool> flag();
  /// A letter; nothing where none stands.
  [[nodiscard]] std::optional<char> letter();
  [[nodiscard]] bool at_end();
  [[nodiscard]] std::size_t at() const { return at_; }

 private:
  void skip();

  std::string text_;
  std::size_t at_ = 0;
};

}  // namespace drape::simulate
