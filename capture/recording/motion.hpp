// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
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

/// Motion of one block's content, px of the picture.
struct BlockMotion {
  double x_px = 0, y_px = 0;     ///< the block's centre
  double dx_px = 0, dy_px = 0;   ///< place in the second picture minus that in the first
  double sd_px = 0;              ///< from the noise left after matching; infinite while it iterates
  double residual_variance = 0;  ///< variance of the grey values left after matching
};

struct MotionResult {
  std::vector<BlockMotion> blocks;
  int textured = 0;  ///< blocks that have something to follow, above their noise
  int lost = 0;      ///< blocks among these that are found nowhere near; others are too uncertain
  /// Lost blocks that noise as in the found ones, whose variance grows with the grey level,
  /// cannot have hidden.
  int gone = 0;

  /// Largest length of a block's motion, less three of its standard deviations; 0 without blocks.
  [[nodiscard]] double largest_px() const;
  /// Something moved out of reach: a block is gone for certain, or more than a tenth are lost.
  [[nodiscard]] bool is_lost() const { return gone > 0 || 10 * lost > textured; }
};

/// Follows every textured block of one picture into others of the same size: least squares on the
/// grey values with an unknown offset of brightness, iterated to sub-pixel convergence (Lucas and
/// Kanade, 1981). What depends on the first picture alone is computed once: four bytes a pixel.
class BlockFollower {
 public:
  BlockFollower(const GreyView& from, const MotionOptions& options);

  /// Throws Error(usage) when the pictures differ in size.
  [[nodiscard]] MotionResult motion_to(const GreyView& to) const;
  /// Blocks with structure in one direction only, which motion_to() leaves out: how far they moved
  /// across it, which is the least that they moved. Gone are those that the noise, as it is in each
  /// block, cannot have hidden.
  [[nodiscard]] MotionResult motion_across_edges_to(const GreyView& to) const;
  [[nodiscard]] int textured() const;
  /// The blocks among these that noise as in the first picture, `from`, lets find again as well as
  /// the options ask.
  [[nodiscard]] int findable(const GreyView& from) const;
  [[nodiscard]] bool has_size_of(const GreyView& other) const;

 private:
  struct First;
  std::shared_ptr<const First> first_;
};

/// The static background behind a cloth, as the reference set shows it.
class Background {
 public:
  explicit Background(const GreyView& reference);

  /// Median of the blocks' motions in each quarter of the picture and in the whole of it, of which
  /// the largest counts, so that a turn about the axis shows, too. Blocks that the cloth covers
  /// match nothing or are outvoted. Nothing when fewer than `kLeastBlocks` match in each of these:
  /// then the camera moved out of reach, or the cloth covers what could be found again. Nothing
  /// of a picture of another size either.
  [[nodiscard]] std::optional<double> shift_px(const GreyView& now) const;
  /// True where the reference has enough texture above its noise to show a shift at all.
  [[nodiscard]] bool is_textured() const { return findable_ >= kLeastBlocks; }
  /// Farthest shift that is followed.
  [[nodiscard]] double reach_px() const { return options_.shrink * options_.largest_px; }

 private:
  /// By chance hardly one is found: none of 9,168 blocks of bench1 in another camera's pictures.
  static constexpr int kLeastBlocks = 8;

  MotionOptions options_;
  BlockFollower blocks_;
  int findable_;
};

}  // namespace drape::capture
