// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace drape::capture {

/// An 8-bit grey picture that somebody else keeps.
struct GreyView {
  std::span<const std::uint8_t> pixels;
  int width_px = 0, height_px = 0;
};

struct MotionOptions {
  int block_px = 48;      ///< side of the blocks that are followed, in px of the picture
  int shrink = 1;         ///< pixels per side averaged first: faint texture rises from the noise
  double largest_px = 3;  ///< a block that moved farther is lost; px of the shrunk picture
  double largest_sd_px =
      0.015;  ///< blocks that are known less well tell nothing; px of the picture
  double least_correlation = 0.7;  ///< below, the block does not show the same thing any more

  void check() const;  ///< throws Error(usage)
};

/// How far the content of one block moved, px of the picture.
struct BlockMotion {
  double x_px = 0, y_px = 0;    ///< the block's centre
  double dx_px = 0, dy_px = 0;  ///< where it is in the second picture, minus where it was
  double sd_px = 0;             ///< from the noise left after matching
};

struct MotionResult {
  std::vector<BlockMotion> blocks;
  int textured = 0;  ///< blocks that have something to follow
  int lost = 0;      ///< of these, blocks that are found nowhere near; the rest is too uncertain

  /// Largest length of a block's motion, less three of its standard deviations; 0 without blocks.
  [[nodiscard]] double largest_px() const;
};

/// Follows every textured block from one picture to another of the same size: least squares on the
/// grey values with an unknown offset of brightness, iterated to sub-pixel convergence (Lucas and
/// Kanade, 1981). Throws Error(usage) when the pictures differ in size.
[[nodiscard]] MotionResult block_motion(const GreyView& from, const GreyView& to,
                                        const MotionOptions& options);

/// Shift of a static background behind a cloth: the median of the blocks' motions in each quarter
/// of the picture, of which the largest counts, so that a turn about the axis shows, too. Blocks
/// that the cloth covers match nothing or are outvoted. Nothing when fewer than `least_blocks`
/// match in every quarter: then the background has no texture, or is another one.
[[nodiscard]] std::optional<double> background_shift_px(const GreyView& reference,
                                                        const GreyView& now,
                                                        std::size_t least_blocks = 8);

}  // namespace drape::capture
