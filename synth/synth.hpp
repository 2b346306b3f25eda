// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/camera_model.hpp"
#include "core/detections.hpp"
#include "core/fields/records.hpp"
#include "core/marks.hpp"
#include "core/parallel.hpp"
#include "core/recording.hpp"
#include "core/rig.hpp"
#include "synth/render/render.hpp"

namespace drape::synth {

/// Ground truth of one mark in one camera's picture.
struct TrueMarkView {
  std::string camera;
  std::optional<Eigen::Vector2d> px;  ///< image of the centre; absent if not in front of the camera
  std::optional<Eigen::Vector2d> centroid_px;  ///< centroid of the dot's whole area in the image
  double facing_rad = 0;  ///< angle between the printed side's normal and the ray to the camera
  double visible_fraction = 0;  ///< fraction of the dot inside the picture and unoccluded
  [[nodiscard]] bool is_whole() const { return visible_fraction == 1; }
};

struct TrueMark {
  MarkId mark;
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d normal_in_world;
  std::vector<TrueMarkView> views;  ///< one per camera
};

void fields(Fields& f, TrueMarkView& view);
void fields(Fields& f, TrueMark& mark);

/// Marks on the face: centres, and the dots' radius (0 for corners, which are tested as points).
struct MarkOnFace {
  MarkId mark;
  FacePoint centre;
  double radius_m = 0;
};
template <class Sheet>  // Print or Target
[[nodiscard]] std::vector<MarkOnFace> marks_of(const Sheet& sheet) {
  std::vector<MarkOnFace> marks;
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col < sheet.cols; ++col)
      marks.push_back({{row, col}, face_point(sheet, {row, col}), sheet.dot_diameter_m / 2});
  }
  return marks;
}

/// Ground truth of all marks. Throws Error(bad_input) if a mark lies outside the surface.
[[nodiscard]] std::vector<TrueMark> truth_of(const SyntheticScene& scene,
                                             const std::vector<MarkOnFace>& marks,
                                             const std::vector<const SceneView*>& views);

/// Centroid (px) of the image area of a disc on the face, from its outline; nullopt if part of it
/// does not project or lies outside the surface.
[[nodiscard]] std::optional<Eigen::Vector2d> disc_centroid_px(const GridSurface& surface,
                                                              const Camera& camera,
                                                              const FacePoint& centre,
                                                              double radius_m);

struct PredictOptions {
  double height_m = 0.1;         ///< height of the drape volume above the world's origin
  double floor_px = 0.02;        ///< additional error of a centre, as in drape triangulate
  double most_facing_deg = 60;   ///< a dot seen at a larger angle counts as not seen
  double asked_sigma_m = 5e-5;   ///< in space, root of the sum of the three variances
  double asked_fraction = 0.95;  ///< fraction of the marks that must achieve it
  RenderOptions render;          ///< brightness, blur and noise of the pictures
};
/// Describes the options without those of `render`.
void fields(Fields& f, PredictOptions& options);

/// Prediction for marks of one slope over the volume.
struct PredictedSlope {
  double slope_deg = 0;
  int marks = 0;
  int seen_by_two = 0;             ///< marks seen by at least two cameras
  double median_m = 0, p95_m = 0;  ///< standard deviation in space of these marks
  double median_height_m = 0;      ///< the same for their height only
  double median_px = 0;  ///< median standard deviation of a centre in a picture, without the floor
};

struct Prediction {
  std::vector<PredictedSlope> slopes;  ///< slopes of 0, 30, 45, 60 degrees in eight directions
  double reached_fraction =
      0;  ///< fraction of the marks seen by two cameras that meet the required accuracy
  double seen_fraction = 0;  ///< fraction of all marks seen by at least two cameras
  bool go = false;           ///< true if both fractions suffice for slopes up to 45 degrees
};

/// Smallest covariance (px^2) of any unbiased estimate of a dot's centre: Cramer-Rao bound for an
/// edge of contrast C with blur s and white noise, integrated along the elliptical outline of the
/// dot, with known brightness and shape.
[[nodiscard]] std::optional<Eigen::Matrix2d> centre_bound_px2(const Camera& camera,
                                                              const Eigen::Vector3d& in_world,
                                                              const Eigen::Vector3d& normal,
                                                              double radius_m,
                                                              const RenderOptions& render);

/// Predicts the accuracy of these cameras over the volume of the drape from the noise of the marks
/// alone, without errors of the calibration and of dots on curved cloth.
[[nodiscard]] Prediction predict(const std::vector<Camera>& cameras, const Print& print,
                                 const PredictOptions& options);

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

/// Renders the frame sets of a rig as seen by its cameras and writes a recording: PNG files,
/// truth.json, true_calibration.json, and finally recording.json. truth.json holds every mark's
/// position in space and, for each camera, its pixel, the centroid of its image, its facing angle
/// and visible fraction. Throws Error(bad_input) if the folder already holds a recording, a camera
/// of the rig is not among the cameras, or a sheet has gaps. `progress` hears of each set.
SynthReport write_synthetic_recording(const Rig& rig, const std::vector<Camera>& cameras,
                                      const std::filesystem::path& folder,
                                      const SynthOptions& options, const PartDone& progress = {});

/// Reads planned cameras, in the order of the rig. Throws Error(bad_input).
[[nodiscard]] std::vector<Camera> read_planned_cameras(const std::filesystem::path& file,
                                                       const Rig& rig);

/// The file formats of this stage, each with a valid example.
[[nodiscard]] std::vector<DescribedFormat> synth_formats();

/// Cameras of a calibration, in the order of the rig.
[[nodiscard]] std::vector<Camera> cameras_of(const Calibration& calibration, const Rig& rig);

}  // namespace drape::synth

template <>
inline constexpr drape::Format drape::format_of<drape::synth::CamerasPlan>{
    "cameras-plan", drape::Syntax::toml, 1, "planned cameras"};
template <>
inline constexpr drape::Format drape::format_of<drape::synth::Truth>{
    "truth", drape::Syntax::json, 1, "true positions of all marks of a synthetic recording"};
