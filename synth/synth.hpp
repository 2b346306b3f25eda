// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "synth/predict.hpp"
#include "synth/render/grid_surface.hpp"
#include "synth/render/render.hpp"
#include "synth/truth.hpp"

namespace drape::synth {

struct SynthOptions {
  std::vector<std::string> sets;  ///< empty: all that the rig names
  /// Cloth of a frame set; the others are folded.
  std::map<std::string, std::filesystem::path> sheets;
  double folds_slope_deg = 30;
  double folds_wavelength_mm = 100;
  RenderOptions render;

  void check() const;  ///< throws Error(usage)
};

struct SetTruth {
  std::string set;
  std::string shows;  ///< "cloth" or "target"
  std::vector<TrueMark> marks;
};

struct SynthReport {
  int pictures = 0;
  int whole_views = 0;  ///< of marks, inside the picture and hidden by nothing
  int marks = 0;        ///< over all sets
  std::vector<std::string> not_over_objects;  ///< sets in folds whose scenes have objects or pins
};

/// Called after each set with the fraction done and its name.
using SynthProgress = std::function<void(double fraction, const std::string& what)>;

/// Renders the frame sets of a rig as its cameras would see them and writes a recording: PNG files,
/// truth.json (every mark: place in space, and in each camera its pixel, the centroid of its image,
/// its facing angle and how much of it is seen), true_calibration.json, and recording.json last.
/// Throws Error(bad_input) when the folder already holds a recording, a camera of the rig is not
/// among the cameras, or a sheet has gaps.
SynthReport write_synthetic_recording(const Rig& rig, const std::vector<Camera>& cameras,
                                      const std::filesystem::path& folder,
                                      const SynthOptions& options,
                                      const SynthProgress& progress = {});

/// Cameras that are only planned (TOML, schema drapebench/cameras-plan/1): for each of the rig's
/// cameras focal length, position and what it looks at. Throws Error(bad_input).
[[nodiscard]] std::vector<Camera> read_planned_cameras(const std::filesystem::path& file,
                                                       const Rig& rig);

/// The cameras of a calibration in the rig's order.
[[nodiscard]] std::vector<Camera> cameras_of(const Calibration& calibration, const Rig& rig);

}  // namespace drape::synth
