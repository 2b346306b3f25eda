// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/live_capture.hpp"
#include "core/calibration.hpp"
#include "core/recording.hpp"

namespace drape::capture {

struct StillOptions {
  double largest_motion_px = 0.05;  ///< of the cloth during a burst
  double largest_shift_px = 0.5;    ///< of a camera's background against the reference set
  std::optional<std::filesystem::path> calibration;  ///< calibration.json; gives speeds in mm
};

struct CameraStill {
  std::string name;
  /// Largest of a block between two frames of the burst; absent when it moved out of reach.
  std::optional<double> motion_px;
  std::optional<double> speed_mm_per_s;  ///< of that block, at the depth of the target
  std::optional<double> background_shift_px;
  bool lost = false;  ///< more than a tenth of the blocks moved out of reach
};

/// Whether the cloth was still during a burst, and the cameras where they were when the reference
/// set of cameras.toml was recorded. Nothing is known without a second frame or a reference.
struct StillReport {
  std::vector<CameraStill> cameras;
  std::optional<double> motion_px, speed_mm_per_s, background_shift_px;  ///< largest of all
  std::optional<double> sync_error_mm;  ///< that speed times the largest spread of a set
  bool cloth_moved = false;
  std::vector<LiveFault> moved_cameras;

  [[nodiscard]] std::optional<LiveFault> cloth_fault() const;
};

/// Looks at the sets of a burst as they come: each against the first. Of a long burst the first
/// eight others, then ever fewer. Memory is that of the first set.
class StillWatch {
 public:
  StillWatch(const CamerasFile& cameras, const StillOptions& options);
  void look(const LiveSet& set);
  [[nodiscard]] const StillReport& report() const { return report_; }

 private:
  void look_at_motion(std::size_t c, const LiveFrame& now);
  void look_at_place(std::size_t c, const LiveFrame& now);

  const CamerasFile& cameras_;
  StillOptions options_;
  std::optional<Calibration> calibration_;
  std::optional<Recording> reference_;
  std::vector<LiveFrame> first_;
  std::size_t seen_ = 0;
  double spread_s_ = 0;
  StillReport report_;
};

/// Looks at all sets of `live`, in order, as one burst.
[[nodiscard]] StillReport look_still(const LiveResult& live, const CamerasFile& cameras,
                                     const StillOptions& options);

}  // namespace drape::capture
