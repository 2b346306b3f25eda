// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/fields/records.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "synth/predict.hpp"
#include "synth/render/grid_surface.hpp"
#include "synth/render/render.hpp"
#include "synth/truth.hpp"

namespace drape::synth {

struct SynthOptions {
  std::vector<std::string> sets;  ///< empty for all sets of the rig
  /// sheet file of a frame set; the other sets get folded cloth
  std::map<std::string, std::filesystem::path> sheets;
  Folds folds;  ///< slope and wavelength; position and phase are random
  RenderOptions render;
};
void fields(Fields& f, SynthOptions& options);

/// Planned but not yet calibrated cameras (cameras-plan.toml).
struct PlannedCamera {
  std::string name;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d look_at_m = Eigen::Vector3d::Zero();
  double focal_m = 0;
  double k1 = 0, k2 = 0;
};
void fields(Fields& f, PlannedCamera& camera);
struct CamerasPlan {
  std::vector<PlannedCamera> cameras;
};
void fields(Fields& f, CamerasPlan& plan);

struct SetTruth {
  std::string set;
  Surface shows = Surface::cloth;
  std::vector<TrueMark> marks;
};
void fields(Fields& f, SetTruth& set);
/// Ground truth of a recording (truth.json).
struct Truth {
  std::string rig;
  std::vector<SetTruth> sets;
};
void fields(Fields& f, Truth& truth);

struct SynthReport {
  int pictures = 0;
  int whole_views = 0;  ///< views of marks entirely inside the picture and unoccluded
  int marks = 0;        ///< over all sets
  std::vector<std::string> not_over_objects;  ///< folded sets whose scenes have objects or pins
};

/// Called after each set with the fraction done and the set's name.
using SynthProgress = std::function<void(double fraction, const std::string& what)>;

/// Renders the frame sets of a rig as seen by its cameras and writes a recording: PNG files,
/// truth.json (for every mark: position in space, and in each camera its pixel, the centroid of its
/// image, its facing angle and visible fraction), true_calibration.json, and finally
/// recording.json. Throws Error(bad_input) if the folder already holds a recording, a camera of the
/// rig is not among the cameras, or a sheet has gaps.
SynthReport write_synthetic_recording(const Rig& rig, const std::vector<Camera>& cameras,
                                      const std::filesystem::path& folder,
                                      const SynthOptions& options,
                                      const SynthProgress& progress = {});

/// Reads planned cameras, in the order of the rig. Throws Error(bad_input).
[[nodiscard]] std::vector<Camera> read_planned_cameras(const std::filesystem::path& file,
                                                       const Rig& rig);

/// The file formats of this stage, each with a valid example.
[[nodiscard]] std::vector<DescribedFormat> synth_formats();

/// Cameras of a calibration, in the order of the rig.
[[nodiscard]] std::vector<Camera> cameras_of(const Calibration& calibration, const Rig& rig);

}  // namespace drape::synth

namespace drape {
template <>
inline constexpr Format format_of<synth::CamerasPlan>{"cameras-plan", Syntax::toml, 1,
                                                      "planned cameras"};
template <>
inline constexpr Format format_of<synth::Truth>{
    "truth", Syntax::json, 1, "true positions of all marks of a synthetic recording"};
}  // namespace drape
