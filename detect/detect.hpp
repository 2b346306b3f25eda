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
  int threads = 1;                ///< frames at a time; never changes a result
  bool previews = true;           ///< half-scale JPEG per frame of a cloth
  std::string
      preview_prefix;     ///< prefix of their names, so that two runs may write into one folder
  bool overlays = false;  ///< PNG per frame with what was found and what was rejected
  FrameLimits limits;

  /// Throws Error(usage) naming an option that makes no sense.
  void check() const;
};

/// A file to be written beside the detections.
struct Picture {
  std::string file_name;
  std::vector<unsigned char> bytes;
};

struct DetectReport {
  int frames = 0;
  int tags = 0;
  int marks = 0;                          ///< measured and labelled, over all frames
  int islands = 0;                        ///< measured, in pieces without a label
  std::optional<double> median_sigma_px;  ///< median over the marks, root of half the trace
  std::optional<double> dot_size_ratio;   ///< measured over stated diameter of the dots
  std::map<std::string, int> rejections_by_reason;  ///< reason without its figures
  std::map<std::string, int> not_in_rig;            ///< pictures of each camera that the rig lacks
  /// Pictures without marks that must show some: "set drape_A, camera cam1". A camera may not see a
  /// free pose.
  std::vector<std::string> frames_without_marks;
  std::string refused;                  ///< why a set of the recording is no measurement
  std::string other_print;              ///< why the pictures show another print, if they do
  std::vector<std::string> poor_views;  ///< dim or blurred, and what that costs
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

/// Called after each frame with the fraction done and its name, from one thread at a time.
using DetectProgress = std::function<void(double fraction, const std::string& what)>;

/// Finds, labels and measures the printed marks of the asked frame sets, each image decoded once
/// (paper section 5: "the location of the grid points on the images"). Throws Error(bad_input)
/// naming set, camera and file for an image that is missing, altered, no image, or of the wrong
/// size; a frame in which nothing is found is reported, not thrown, and so are pictures of a camera
/// that the rig does not name.
[[nodiscard]] DetectResult detect(const Recording& recording, const Rig& rig,
                                  const DetectOptions& options,
                                  const DetectProgress& progress = {});

/// The sets that show a surface when the user names none: stages and free poses of the target, or
/// the drapes of the rig's scenes.
[[nodiscard]] std::vector<std::string> default_sets(const Rig& rig, Surface surface);

}  // namespace drape::detect
