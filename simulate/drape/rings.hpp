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
    20000;                           ///< limit on the corners of an outline, after dividing curves
constexpr double kFarthest_m = 10;   ///< largest distance of a corner from that of the patch
constexpr double kSamePlace = 1e-3;  ///< fraction of the spacing; closer points are the same

/// Collects closed rings of lines and curves as polygons (warp, weft) in metres. Curves are divided
/// into pieces of equal length, about the spacing; corners are kept.
class RingBuilder {
 public:
  explicit RingBuilder(double spacing_m) : spacing_m_(spacing_m) {}

  /// Transform of the following points: from the file's units to (weft, warp) in metres.
  Eigen::Affine2d to_metres = Eigen::Affine2d::Identity();

  void begin(const Eigen::Vector2d& at);
  void line_to(const Eigen::Vector2d& to);
  /// Adds a curve: `place` gives its points for 0 .. 1, starting at the current one, in file units.
  void curve(const std::function<Eigen::Vector2d(double)>& place);
  /// Closes the ring; merges corners that coincide.
  void close();
  [[nodiscard]] bool is_open() const { return open_; }
  /// True if the current point is the start of the ring, within a thousandth of the spacing.
  [[nodiscard]] bool has_returned() const;

  /// True if there are more corners, or longer lines, than in any cloth; later input is ignored.
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

/// Adds the rings of an SVG's path data (SVG 1.1, section 8.3). `refuse` throws with its message
/// and the position of the character at which the data are wrong or a ring is left open.
void add_path(const std::string& data, RingBuilder& builder,
              const std::function<void(const std::string& why, std::size_t at)>& refuse);

/// Rings of all shapes of an SVG file. Throws like read_outline().
[[nodiscard]] std::vector<Polygon> rings_of_svg(const std::filesystem::path& file,
                                                double spacing_m);

/// Reads numbers from SVG attributes, separated by spaces and commas, or by nothing if a sign or a
/// second decimal point starts the next (SVG 1.1, section 8.3.9). Locale-independent.
class NumberReader {
 public:
  explicit NumberReader(std::string text) : text_(std::move(text)) {}

  /// Reads a number; nullopt, without advancing, if there is no finite one.
  [[nodiscard]] std::optional<double> next();
  /// Reads a flag of an arc: the single character 0 or 1.
  [[nodiscard]] std::optional<bool> flag();
  /// Reads a letter; nullopt if there is none.
  [[nodiscard]] std::optional<char> letter();
  [[nodiscard]] bool at_end();
  [[nodiscard]] std::size_t at() const { return at_; }

 private:
  void skip();

  std::string text_;
  std::size_t at_ = 0;
};

}  // namespace drape::simulate
