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
  double largest_motion_px = 0.05;  ///< largest motion of the cloth during a burst
  double largest_shift_px =
      0.5;  ///< largest shift of a camera's background against the reference set
  std::optional<std::filesystem::path> calibration;  ///< calibration.json; gives speeds in mm
};

struct CameraStill {
  std::string name;
  /// Largest of a block between two frames of the burst; absent when it moved out of reach.
  std::optional<double> motion_px;
  std::optional<double> speed_mm_per_s;  ///< speed of that block, at the depth of the target
  std::optional<double> background_shift_px;
  bool lost = false;  ///< blocks moved out of reach
  /// In one frame at least nothing could be followed: the pictures have structure in one direction
  /// only, or none above their noise.
  bool not_judged = false;
  /// In one frame at least the background was not found again: the shift is not known.
  bool background_lost = false;
};

/// Stillness of the cloth during a burst, and the cameras where they were when the reference
/// set of cameras.toml was recorded. Nothing is known without a second frame or a reference.
struct StillReport {
  std::vector<CameraStill> cameras;
  /// Largest of all cameras; absent where that of one is beyond reach.
  std::optional<double> motion_px, speed_mm_per_s, background_shift_px;
  std::optional<double> sync_error_mm;  ///< speed times the largest spread of a set
  bool cloth_moved = false;
  std::vector<LiveFault> moved_cameras;
  std::optional<std::string> calibration_no_go;  ///< why no speed is given

  [[nodiscard]] std::optional<LiveFault> cloth_fault() const;
  /// Cameras in which nobody knows whether the cloth was still, unless it moved in another one.
  [[nodiscard]] std::vector<std::string> not_judged() const;
};

/// Looks at the sets of a burst as they come: each against the first, and against the reference
/// set of cameras.toml. Memory is four bytes for each pixel of the first set.
class StillWatch {
 public:
  /// Throws Error(bad_input) when the reference set lacks a camera, shows it in another size, or
  /// has no texture that would tell whether it moved.
  StillWatch(const CamerasFile& cameras, const StillOptions& options);
  void look(const LiveSet& set);
  [[nodiscard]] const StillReport& report() const { return report_; }

 private:
  /// The first frame of a camera: blocks of the full picture, and outlines, which a repeating
  /// pattern cannot deceive.
  struct First {
    BlockFollower fine, coarse;
    std::optional<double> time_s;
  };
  /// Comparison of one frame with the first one and the reference.
  struct Sight {
    std::optional<First> first;  ///< in the first set
    MotionResult fine, coarse;   ///< in the others
    MotionResult edges;          ///< where nothing else can be followed
    std::optional<double> background_shift_px;
  };

  [[nodiscard]] Sight see(std::size_t c, const LiveFrame& now) const;
  void add_motion(std::size_t c, const LiveFrame& now, const Sight& sight);
  void add_place(std::size_t c, const Sight& sight);

  StillOptions options_;
  std::optional<Calibration> calibration_;
  std::vector<Background> backgrounds_;  ///< by camera; empty without a reference
  std::vector<First> first_;             ///< by camera
  double spread_s_ = 0;
  StillReport report_;
};

/// Looks at all sets of `live`, in order, as one burst.
[[nodiscard]] StillReport look_still(const LiveResult& live, const CamerasFile& cameras,
                                     const StillOptions& options);

}  // namespace drape::capture
