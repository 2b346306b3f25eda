// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/live_capture.hpp"
#include "capture/recording/motion.hpp"
#include "core/calibration.hpp"

namespace drape::capture {

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
  /// In at least one frame nothing could be tracked: the pictures have structure in one direction
  /// only, or none above their noise.
  bool not_judged = false;
  /// In at least one frame the background was not found again, so the shift is unknown.
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
