// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "detect/frame.hpp"

namespace drape::detect {

struct DetectOptions {
  Surface surface = Surface::cloth;
  std::vector<std::string> sets;  ///< frame sets, in the order of the output
  int threads = 1;                ///< frames processed in parallel; never changes a result
  bool previews = true;           ///< write a half-scale JPEG per frame of a cloth
  std::string preview_prefix;     ///< prefix of their names, so that two runs can share a folder
  bool overlays = false;          ///< write a PNG per frame that shows detections and rejections
  FrameLimits limits;

  /// Throws Error(usage) naming an invalid option.
  void check() const;
};

/// A file to write beside the detections.
struct Picture {
  std::string file_name;
  std::vector<unsigned char> bytes;
};

struct DetectReport {
  int frames = 0;
  int tags = 0;
  int marks = 0;                          ///< measured and labelled, over all frames
  int islands = 0;                        ///< measured, in lattice pieces without labels
  std::optional<double> median_sigma_px;  ///< median over the marks, root of half the trace
  std::optional<double> dot_size_ratio;   ///< median over the marks of sqrt(trace / 2)
  std::map<std::string, int> rejections_by_reason;  ///< counts by reason, without the figures in it
  std::map<std::string, int> not_in_rig;  ///< pictures of cameras missing from the rig, by camera
  /// Pictures in which marks are missing but required, such as "set drape_A, camera cam1". A free
  /// pose need not be visible to every camera.
  std::vector<std::string> frames_without_marks;
  std::string refused;      ///< why the recording declares a set no valid measurement
  std::string other_print;  ///< why the pictures seem to show another print; empty if not
  std::vector<std::string> poor_views;  ///< dim or blurred views, with the marks lost by that
  std::vector<std::string> warnings;

  [[nodiscard]] bool good() const {
    return frames_without_marks.empty() && refused.empty() && other_print.empty();
  }
};

struct DetectResult {
  Detections detections;
  std::vector<Picture> previews;
  std::vector<Picture> overlays;
  DetectReport report;
};

/// Called after each frame with the fraction done and the frame's name; calls do not overlap.
using DetectProgress = std::function<void(double fraction, const std::string& what)>;

/// Finds, labels and measures the printed marks of the requested frame sets, decoding each image
/// once (paper section 5: "the location of the grid points on the images"). Throws Error(bad_input)
/// naming set, camera and file for an image that is missing, altered, invalid or of the wrong size.
/// Frames without detections and pictures of cameras that the rig does not name are reported, not
/// thrown.
[[nodiscard]] DetectResult detect(const Recording& recording, const Rig& rig,
                                  const DetectOptions& options,
                                  const DetectProgress& progress = {});

/// Sets used by default: stages and free poses of the target, or the drapes of the rig's
/// scenes.
[[nodiscard]] std::vector<std::string> default_sets(const Rig& rig, Surface surface);

}  // namespace drape::detect
