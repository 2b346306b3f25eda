// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/live/live_capture.hpp"
#include "core/calibration.hpp"

namespace drape::capture {

/// An 8-bit grey picture owned by the caller.
struct GreyView {
  std::span<const std::uint8_t> pixels;
  int width_px = 0, height_px = 0;
};

struct MotionOptions {
  int block_px = 48;  ///< side of the tracked blocks, px of the picture
  int shrink = 1;     ///< pixels per side averaged first, which lifts faint texture above the noise
  double largest_px = 3;  ///< a block that moves farther is lost; px of the reduced picture
  double largest_sd_px =
      0.015;  ///< blocks with a larger uncertainty are ignored; px of the picture
  double least_correlation = 0.7;  ///< below, a block no longer shows the same content
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
  /// omits: a lower bound of their true motion. `gone` counts those whose loss the block's own
  /// noise cannot explain.
  [[nodiscard]] MotionResult motion_across_edges_to(const GreyView& to) const;
  [[nodiscard]] int textured() const;
  /// Number of blocks that can be matched with the required uncertainty, at the noise of the first
  /// picture, `from`.
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

struct StillOptions {
  double largest_motion_px = 0.05;  ///< largest allowed motion of the cloth during a burst
  double largest_shift_px =
      0.5;  ///< largest allowed shift of a background against the reference set
  std::optional<std::filesystem::path> calibration;  ///< calibration.json, for speeds in mm
};

struct CameraStill {
  std::string name;
  /// Largest motion of a block between two frames of the burst; absent if it went out of range.
  std::optional<double> motion_px;
  std::optional<double> speed_mm_per_s;  ///< speed of that block at the distance of the target
  std::optional<double> background_shift_px;
  bool lost = false;  ///< blocks moved out of range
  /// True if nothing could be tracked in at least one frame: structure in one direction only, or
  /// none above the noise.
  bool not_judged = false;
  /// True if the background was not found in at least one frame, so the shift is unknown.
  bool background_lost = false;
};

/// Motion of the cloth during a burst, and shift of the cameras since the reference set of
/// cameras.toml. Unknown without a second frame or a reference.
struct StillReport {
  std::vector<CameraStill> cameras;
  /// Largest over all cameras; absent if that of one camera is out of range.
  std::optional<double> motion_px, speed_mm_per_s, background_shift_px;
  std::optional<double> sync_error_mm;  ///< speed times largest spread of a set
  bool cloth_moved = false;
  std::vector<LiveFault> moved_cameras;
  std::optional<std::string> calibration_no_go;  ///< why no speed is given

  [[nodiscard]] std::optional<LiveFault> cloth_fault() const;
  /// Cameras for which it is unknown whether the cloth was still, unless another saw it move.
  [[nodiscard]] std::vector<std::string> not_judged() const;
};

/// Compares the sets of a burst as they arrive with the first one and with the reference set of
/// cameras.toml. Takes four bytes of memory per pixel of the first set.
class StillWatch {
 public:
  /// Throws Error(bad_input) if the reference set lacks a camera, has another image size, or has
  /// too little texture to reveal a shift.
  StillWatch(const CamerasFile& cameras, const StillOptions& options);
  void look(const LiveSet& set);
  [[nodiscard]] const StillReport& report() const { return report_; }

 private:
  /// First frame of a camera: blocks of the full picture, and of a reduced one, in which a
  /// repeating pattern cannot cause a false match.
  struct First {
    BlockFollower fine, coarse;
    std::optional<double> time_s;
  };
  /// Comparison of a frame with the first one and with the reference.
  struct Sight {
    std::optional<First> first;  ///< for the first set
    MotionResult fine, coarse;   ///< for later sets
    MotionResult edges;          ///< used if nothing else can be tracked
    std::optional<double> background_shift_px;
  };

  [[nodiscard]] Sight see(std::size_t c, const LiveFrame& now) const;
  void add_motion(std::size_t c, const LiveFrame& now, const Sight& sight);
  void add_place(std::size_t c, const Sight& sight);

  StillOptions options_;
  std::optional<Calibration> calibration_;
  std::vector<Background> backgrounds_;  ///< per camera; empty without a reference
  std::vector<First> first_;             ///< per camera
  double spread_s_ = 0;
  StillReport report_;
};

/// Examines all sets of `live` in order as one burst.
[[nodiscard]] StillReport look_still(const LiveResult& live, const CamerasFile& cameras,
                                     const StillOptions& options);

}  // namespace drape::capture
