// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace drape::capture {

/// An 8-bit grey picture owned by the caller.
struct GreyView {
  std::span<const std::uint8_t> pixels;
  int width_px = 0, height_px = 0;
};

struct MotionOptions {
  int block_px = 48;  ///< side of the tracked blocks, px of the picture
  int shrink = 1;     ///< pixels per side averaged first, which brings faint texture out of noise
  double largest_px = 3;  ///< a block that moved farther is lost; px of the reduced picture
  double largest_sd_px =
      0.015;  ///< blocks with a larger uncertainty are ignored; px of the picture
  double least_correlation = 0.7;  ///< a block with less no longer shows the same content

  void check() const;  ///< throws Error(usage)
};

/// Motion of one block's content, px of the picture.
struct BlockMotion {
  double x_px = 0, y_px = 0;     ///< centre of the block
  double dx_px = 0, dy_px = 0;   ///< position in the second picture minus position in the first
  double sd_px = 0;              ///< from the residual noise; infinite during the iteration
  double residual_variance = 0;  ///< variance of the grey residuals after matching
};

struct MotionResult {
  std::vector<BlockMotion> blocks;
  int textured = 0;  ///< blocks with texture above their noise
  int lost = 0;      ///< textured blocks without a match nearby; others are too uncertain
  /// Lost blocks whose loss noise cannot explain, given the noise of matched blocks scaled with the
  /// grey level.
  int gone = 0;

  /// Largest motion of a block minus three standard deviations; 0 without blocks.
  [[nodiscard]] double largest_px() const;
  /// True if something moved out of range: a block is certainly gone, or over a tenth are lost.
  [[nodiscard]] bool is_lost() const { return gone > 0 || 10 * lost > textured; }
};

/// Tracks every textured block of one picture in others of the same size: least squares on the grey
/// values with an unknown brightness offset, iterated to sub-pixel convergence (Lucas and Kanade,
/// 1981). Data of the first picture are computed once and take four bytes per pixel.
class BlockFollower {
 public:
  BlockFollower(const GreyView& from, const MotionOptions& options);

  /// Throws Error(usage) if the pictures differ in size.
  [[nodiscard]] MotionResult motion_to(const GreyView& to) const;
  /// Motion across their edges of blocks with structure in one direction only, which motion_to()
  /// leaves out: a lower bound of their true motion. `gone` counts those whose loss the block's own
  /// noise cannot explain.
  [[nodiscard]] MotionResult motion_across_edges_to(const GreyView& to) const;
  [[nodiscard]] int textured() const;
  /// Number of blocks that could be matched with the required uncertainty, given noise as in the
  /// first picture, `from`.
  [[nodiscard]] int findable(const GreyView& from) const;
  [[nodiscard]] bool has_size_of(const GreyView& other) const;

 private:
  struct First;
  std::shared_ptr<const First> first_;
};

/// The static background behind a cloth, as shown in the reference set.
class Background {
 public:
  explicit Background(const GreyView& reference);

  /// Largest of five medians of block motion: over each quarter of the picture and all of it,
  /// so that a rotation about the axis shows too. Blocks covered by the cloth match nothing
  /// or are outvoted. nullopt if fewer than `kLeastBlocks` match in each region (the camera
  /// moved out of range or the cloth covers the background), or if the picture has another
  /// size.
  [[nodiscard]] std::optional<double> shift_px(const GreyView& now) const;
  /// True if the reference has enough texture above its noise to reveal a shift.
  [[nodiscard]] bool is_textured() const { return findable_ >= kLeastBlocks; }
  /// Largest shift that can be tracked.
  [[nodiscard]] double reach_px() const { return options_.shrink * options_.largest_px; }

 private:
  /// Chance matches are rare: none in 9,168 blocks of bench1 in another camera's pictures.
  static constexpr int kLeastBlocks = 8;

  MotionOptions options_;
  BlockFollower blocks_;
  int findable_;
};

}  // namespace drape::capture
