// SPDX-License-Identifier: Apache-2.0
#include "calib/calib.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <set>

#include "core/camera_model.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

constexpr std::size_t kLeastPoints = 11;

const FrameDetections& frame_of(const Detections& detections, const std::string& set,
                                const std::string& camera) {
  const FrameDetections* found = find_frame(detections, set, camera);
  if (found == nullptr) {
    throw bad_input("the detections hold no frame of this target stage",
                    {.camera = camera, .set = set},
                    "run `drape detect --surface target` on all sets of [[calibration.stage]]");
  }
  return *found;
}

/// Dots seen by the camera on all target stages, ordered by stage, then dot. Throws
/// Error(bad_input) with camera and set if a stage is missing, image size or dot grid differ from
/// the rig's, or a number is not finite.
std::vector<Correspondence> stage_correspondences(const Detections& detections, const Rig& rig,
                                                  const Target& target, const std::string& camera) {
  check_lattice(detections, rig, target);
  std::vector<Correspondence> points;
  for (const TargetStage& stage : rig.stages) {
    const FrameDetections& frame = frame_of(detections, stage.set, camera);
    check_frame(frame, rig.camera(camera));
    for (const Detection& d : frame.detections) {
      check_detection(d, frame);
      const Eigen::Vector3d raised =
          target.point_in_target(d.mark) + stage.z_m * Eigen::Vector3d::UnitZ();
      points.push_back({raised, d.centre_px, d.covariance_px2, stage.set, d.mark});
    }
  }
  return points;
}

/// Throws Error(bad_input) naming the camera if its points cannot calibrate it: fewer than 11
/// (Willson 1995), collinear, or at nearly equal heights. Returns the number of different heights;
/// 1 is a single plane.
int check_correspondences(const std::vector<Correspondence>& points, const std::string& camera) {
  const Where where{.camera = camera};
  if (points.size() < kLeastPoints) {
    throw bad_input(fmt::format("{} target points; all parameters together need {} or more",
                                points.size(), kLeastPoints),
                    where, "light the target better or move it into the camera's view");
  }
  std::set<double> heights;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Correspondence& p : points) {
    if (!p.point_in_world.allFinite() || !p.px.allFinite()) {
      throw bad_input("a target point is not a finite number", where, "check target.toml");
    }
    heights.insert(p.point_in_world.z());
    mean += p.point_in_world / static_cast<double>(points.size());
  }
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Correspondence& p : points)
    spread += (p.point_in_world - mean) * (p.point_in_world - mean).transpose();
  const Eigen::Vector3d variances =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
  // A width below a thousandth of the length is print tolerance, not a second dimension.
  if (variances[1] <= 1e-6 * variances[2]) {
    throw bad_input("the target points lie on one line", where,
                    "show the camera more of the target");
  }
  if (variances[0] <= 1e-6 * variances[2] && heights.size() > 1) {
    throw bad_input("the heights of the target are as good as equal: no depth", where,
                    "record the target at heights that are apart by about its own size, or at one");
  }
  return static_cast<int>(heights.size());
}

using units::mm;
using Points = std::vector<Correspondence>;

/// Shifts pixels from the centroid of each dot's image to the image of its centre, as predicted by
/// the camera for level dots of this diameter (Heikkila 2000).
std::vector<Correspondence> without_eccentricity(const std::vector<Correspondence>& points,
                                                 const Camera& camera, double dot_diameter_m) {
  std::vector<Correspondence> corrected = points;
  const Eigen::Matrix3d& rotation = camera.cam_from_world.rotation;
  for (Correspondence& point : corrected) {
    if (const auto off =
            eccentricity_px(camera.model, {camera.cam_from_world * point.point_in_world,
                                           rotation.col(0), rotation.col(1), dot_diameter_m / 2}))
      point.px -= *off;
  }
  return corrected;
}

/// Largest distance (px) between the pixels of two lists of the same points.
double largest_shift_px(const std::vector<Correspondence>& a,
                        const std::vector<Correspondence>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, (a[i].px - b[i].px).norm());
  return largest;
}

constexpr int kCorrectionRounds = 5;
constexpr double kCorrectionTolerancePx = 1e-7;

TsaiStep step_of(const Camera& camera, const Points& points) {
  return {std::get<TsaiLens>(camera.model.lens).focal_m / mm, residuals_of(camera, points).rms_px};
}

/// Result of stage 1 and of the linear part of stage 2.
struct LinearStart {
  std::optional<RadialAlignment> alignment;
  std::optional<FocalAndDepth> depth;
};

LinearStart start_from_heights(const Points& points, const TsaiSensor& sensor) {
  LinearStart start{align_non_coplanar(points, sensor), std::nullopt};
  if (start.alignment) start.depth = solve_focal_and_depth(points, sensor, *start.alignment);
  return start;
}

/// One plane determines the rotation up to a reflection, which the focal length's sign resolves.
LinearStart start_from_plane(Points points, const TsaiSensor& sensor) {
  const double height_m = points.front().point_in_world.z();
  for (Correspondence& point : points) point.point_in_world.z() = 0;
  LinearStart start{align_coplanar(points, sensor), std::nullopt};
  if (!start.alignment) return start;
  start.depth = solve_focal_and_depth(points, sensor, *start.alignment);
  if (start.depth && start.depth->focal_m < 0) {
    start.alignment = mirrored(*start.alignment);
    start.depth = solve_focal_and_depth(points, sensor, *start.alignment);
  }
  const Eigen::Vector3d back = height_m * start.alignment->rotation.col(2);
  start.alignment->tx_m -= back.x();
  start.alignment->ty_m -= back.y();
  if (start.depth) start.depth->tz_m -= back.z();
  return start;
}

void check_tilt(const Camera& camera) {
  constexpr double kLeastTiltDeg = 10;
  const double tilt_deg =
      std::acos(std::min(1.0, std::abs(camera.cam_from_world.rotation(2, 2)))) / units::deg;
  if (tilt_deg >= kLeastTiltDeg) return;
  throw bad_input(fmt::format("too little tilt: the only plane is {:.1f} deg off parallel to the "
                              "image, so focal length and distance cannot be separated",
                              tilt_deg),
                  {.camera = camera.name},
                  "tilt the camera by 30 degrees against the target, or record a second height");
}

/// Stages 1 and 2, with kappa1 = 0.
Camera basic_camera(const Points& points, const RigCamera& rig_camera, bool estimate_scale_x,
                    CameraReport& report) {
  const Where where{.camera = rig_camera.name};
  const TsaiSensor sensor{rig_camera.pixel_pitch_x_m, rig_camera.pixel_pitch_y_m,
                          (rig_camera.width_px - 1) / 2.0, (rig_camera.height_px - 1) / 2.0};
  const bool one_plane = report.planes == 1;
  auto [alignment, depth] =
      one_plane ? start_from_plane(points, sensor) : start_from_heights(points, sensor);
  if (!alignment) {
    throw bad_input("the target points do not determine the camera's rotation (Tsai's stage 1)",
                    where, "spread the target over the image and over several heights");
  }
  report.origin_shifted = alignment->origin_shifted;
  report.stage1_ty_mm = alignment->ty_m / mm;
  report.stage1_scale_x = alignment->scale_x;
  if (!estimate_scale_x && alignment->scale_x != 1) {
    alignment->scale_x = 1;
    depth = solve_focal_and_depth(points, sensor, *alignment);
  }
  if (!depth) {
    throw bad_input("the focal length and the distance cannot be separated", where,
                    "the target must not lie parallel to the image; tilt the camera");
  }
  if (depth->focal_m < 0) {
    throw bad_input("the target points are mirrored: their x, y, z are not right-handed", where,
                    "check the sign of z_mm in rig.toml (z points out of the printed face) and "
                    "that the images are not mirrored");
  }
  Camera camera = start_camera(sensor, *alignment, *depth);
  camera.name = rig_camera.name;
  camera.model.width_px = rig_camera.width_px;
  camera.model.height_px = rig_camera.height_px;
  if (one_plane) check_tilt(camera);
  return camera;
}

bool all_project(const Camera& camera, const Points& points) {
  return std::all_of(points.begin(), points.end(), [&](const Correspondence& point) {
    return std::isfinite(distance_px(camera, point));
  });
}

struct Fit {
  Refinement refinement;
  Points points;  ///< with the pixels used in the fit
};

/// Runs stage 3, with the eccentricity of the dots predicted by the resulting camera.
Fit fit_all(const Camera& start, const Points& measured, double dot_diameter_m, TsaiFree free,
            const CalibOptions& options) {
  Fit fit{{start, false, 0, 0}, measured};
  for (int round = 0; round < kCorrectionRounds; ++round) {
    fit.refinement = refine_tsai(fit.refinement.camera, fit.points, free, options.max_iterations);
    if (!options.correct_eccentricity || !fit.refinement.converged) break;
    Points corrected = without_eccentricity(measured, fit.refinement.camera, dot_diameter_m);
    const bool settled = largest_shift_px(corrected, fit.points) < kCorrectionTolerancePx;
    fit.points = std::move(corrected);
    if (settled) break;
  }
  return fit;
}

/// Robust standard deviation per coordinate of the point distances, from their median.
double robust_sigma_px(const Camera& camera, const Points& points) {
  std::vector<double> distances;
  for (const Correspondence& point : points) distances.push_back(distance_px(camera, point));
  return median(std::move(distances)) / kRayleighMedian;
}

/// Removes outliers; returns the rest. Counts in `gross` those that are farther off at the target
/// than the RMS limit of a camera.
Points without_outliers(const Points& measured, const Fit& fit, const CalibOptions& options,
                        CameraReport& report, std::size_t& gross) {
  const Camera& camera = fit.refinement.camera;
  const double limit = options.outlier_sigmas * robust_sigma_px(camera, fit.points);
  Points kept;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const double distance = distance_px(camera, fit.points[i]);
    const auto miss = miss_m(camera, fit.points[i]);
    if (distance <= limit || (miss && *miss <= harmless_m)) {
      kept.push_back(measured[i]);
      continue;
    }
    if (!miss || *miss > options.max_rms_mm * mm) ++gross;
    report.rejected.push_back(fmt::format("set {}, dot ({}, {}): {:.3f} px off, limit {:.3f} px",
                                          measured[i].set, measured[i].dot.row, measured[i].dot.col,
                                          distance, limit));
  }
  return kept;
}

/// Reason why the camera must not be used, or "good".
std::string status_of(const CameraReport& report, const Fit& fit, bool has_covariance,
                      std::size_t gross, std::size_t measured, const CalibOptions& options) {
  if (!fit.refinement.converged)
    return fmt::format("not converged after {} iterations", fit.refinement.iterations);
  if (std::string too_many = too_many_gross(gross, measured, options); !too_many.empty())
    return too_many;
  if (report.object_rms_mm > options.max_rms_mm) {
    return fmt::format("RMS {:.3f} mm at the target ({:.3f} px), above the limit of {:g} mm",
                       report.object_rms_mm, report.full.rms_px, options.max_rms_mm);
  }
  if (!has_covariance) return "ill-conditioned: the parameters cannot be separated";
  const double focal_px = report.full.focal_mm * mm /
                          std::get<TsaiLens>(fit.refinement.camera.model.lens).pixel_pitch_x_m;
  if (100 * report.centre_sd_px > options.max_centre_sd_percent * focal_px) {
    return fmt::format(
        "ill-conditioned: image centre known to {:.1f} px only (limit {:g} % of the focal length)",
        report.centre_sd_px, options.max_centre_sd_percent);
  }
  if (100 * report.focal_sd_mm > options.max_focal_sd_percent * report.full.focal_mm) {
    return fmt::format("ill-conditioned: focal length known to {:.1f} % only (limit {:g} %)",
                       100 * report.focal_sd_mm / report.full.focal_mm,
                       options.max_focal_sd_percent);
  }
  return "good";
}

/// Covariance from the marks' own noise, enlarged if residuals exceed it, since errors of the lens
/// model act like noise of that size.
Eigen::MatrixXd scaled_covariance(const Fit& fit, TsaiFree free, CameraReport& report) {
  Eigen::MatrixXd covariance = tsai_covariance(fit.refinement.camera, fit.points, free);
  const double dof = 2.0 * static_cast<double>(fit.points.size()) - free_parameters(free);
  report.chi2_per_dof = fit.refinement.chi2 / dof;
  if (covariance.size() == 0) return covariance;
  covariance *= std::max(1.0, report.chi2_per_dof);
  report.focal_sd_mm = std::sqrt(covariance(0, 0));
  report.centre_sd_px = std::sqrt(std::max(covariance(2, 2), covariance(3, 3)));
  return covariance;
}

void note_one_plane(bool estimate_scale_x, CameraReport& report) {
  if (report.planes > 1) return;
  report.notes.emplace_back(
      "one view of one plane: a bent or wrongly printed target and a lens with more than one "
      "radial term do not show in its residuals, and places off the plane rest on the lens alone; "
      "record a second height, or free poses for --method joint");
  if (estimate_scale_x)
    report.notes.emplace_back("s_x kept at 1: one plane cannot tell it from the rotation");
}

struct CameraResult {
  std::optional<CalibratedCamera> calibrated;  ///< absent if there is no result
  CameraReport report;
};

/// Runs all stages of Tsai's method for one camera.
CameraResult calibrate_camera(const Points& measured, const RigCamera& rig_camera,
                              double dot_diameter_m, bool estimate_scale_x,
                              const CalibOptions& options) {
  CameraResult result;
  CameraReport& report = result.report;
  report.camera = rig_camera.name;
  report.planes = check_correspondences(measured, rig_camera.name);
  const bool free_scale_x = estimate_scale_x && report.planes > 1;
  const TsaiFree free = free_scale_x ? TsaiFree::all : TsaiFree::all_but_scale_x;
  note_one_plane(estimate_scale_x, report);
  const Camera start = basic_camera(measured, rig_camera, free_scale_x, report);
  if (!all_project(start, measured)) {
    report.status = "stage 2 puts target points behind the camera";
    return result;
  }
  const Refinement basic =
      refine_tsai(start, measured, TsaiFree::focal_depth_kappa, options.max_iterations);
  report.basic = step_of(basic.camera, measured);
  Fit fit = fit_all(basic.camera, measured, dot_diameter_m, free, options);
  std::size_t gross = 0;
  const Points kept = without_outliers(measured, fit, options, report, gross);
  if (kept.size() < measured.size() && kept.size() >= 11)
    fit = fit_all(fit.refinement.camera, kept, dot_diameter_m, free, options);
  report.iterations = fit.refinement.iterations;
  report.points = static_cast<int>(fit.points.size());
  report.full = step_of(fit.refinement.camera, fit.points);
  report.errors = classical_errors(fit.refinement.camera, fit.points);
  report.object_rms_mm = residuals_of(fit.refinement.camera, fit.points).object_rms_mm;
  if (fit.points.size() == kept.size())
    report.max_eccentricity_px = largest_shift_px(fit.points, kept);
  const Eigen::MatrixXd covariance = scaled_covariance(fit, free, report);
  if (covariance.size() > 0) {
    const double dof = 2.0 * static_cast<double>(fit.points.size()) - free_parameters(free);
    report.stages = check_stages_far_off(fit.refinement.camera, fit.points, free,
                                         dof * report.chi2_per_dof, options.max_iterations);
  }
  report.status = status_of(report, fit, covariance.size() > 0, gross, measured.size(), options);
  if (report.stages && !report.stages->contradiction.empty()) {
    report.status = report.good() ? report.stages->contradiction
                                  : report.stages->contradiction + "; " + report.status;
  }
  result.calibrated = calibrated_of(fit.refinement.camera, fit.points, covariance);
  result.calibrated->valid_region_px = covered_region_px(measured);
  return result;
}

}  // namespace

std::string too_many_gross(std::size_t gross, std::size_t measured, const CalibOptions& options) {
  if (100 * static_cast<double>(gross) <=
      options.max_outliers_percent * static_cast<double>(measured))
    return "";
  return fmt::format(
      "{} of {} points rejected that lie more than {:g} mm off, more than {:g} %: check labels, "
      "heights and whether a camera moved",
      gross, measured, options.max_rms_mm, options.max_outliers_percent);
}

void fields(Fields& f, CalibOptions& o) {
  f.otherwise(
      {"max_rms_mm", "NO-GO above this RMS distance of the target points from a camera's rays, mm",
       1, above_zero},
      o.max_rms_mm);
  f.otherwise({"max_centre_sd_percent",
               "NO-GO above this standard deviation of the image centre, % of the focal length", 1,
               above_zero},
              o.max_centre_sd_percent);
  f.otherwise({"max_focal_sd_percent", "NO-GO above this standard deviation of the focal length, %",
               1, above_zero},
              o.max_focal_sd_percent);
  f.otherwise(
      {"outlier_sigmas", "reject dots with residuals above this many robust standard deviations", 1,
       above_zero},
      o.outlier_sigmas);
  f.otherwise({"max_outliers_percent", "NO-GO above this fraction of rejected dots, %", 1, 0},
              o.max_outliers_percent);
  f.otherwise({"max_iterations", "largest number of iterations of each refinement", 1, 1},
              o.max_iterations);
  bool no_eccentricity = !o.correct_eccentricity;
  f.otherwise({"no_eccentricity", "treat the centroid of a dot's image as the image of its centre"},
              no_eccentricity);
  o.correct_eccentricity = !no_eccentricity;
}

bool CalibReport::good() const {
  return std::all_of(cameras.begin(), cameras.end(),
                     [](const CameraReport& camera) { return camera.good(); });
}

CalibResult calibrate_tsai(const Detections& detections, const Rig& rig, const Target& target,
                           const CalibOptions& options) {
  check_record(options);
  check_known_lengths(target, 0);
  refuse_sets_twice(rig);
  if (rig.stages.empty())
    throw bad_input(
        "there are no z stages, on which Tsai's method rests", {.field = "calibration.stage"},
        "calibrate with --method joint, or add [[calibration.stage]] with set and z_mm");
  CalibResult result;
  result.calibration.method = "tsai";
  result.calibration.rig = rig.name;
  for (const TargetStage& stage : rig.stages) result.calibration.sets.push_back(stage.set);
  refuse_pictures_twice({detections, "", result.calibration.sets});
  for (const RigCamera& rig_camera : rig.cameras) {
    const auto points = stage_correspondences(detections, rig, target, rig_camera.name);
    CameraResult camera =
        calibrate_camera(points, rig_camera, target.dot_diameter_m, rig.estimate_scale_x, options);
    if (!camera.report.good()) {
      result.calibration.warnings.push_back(
          fmt::format("{}: {}", camera.report.camera, camera.report.status));
    }
    for (const std::string& note : camera.report.notes)
      result.calibration.warnings.push_back(fmt::format("{}: {}", camera.report.camera, note));
    if (camera.report.stages) {
      for (const std::string& finding : camera.report.stages->findings)
        result.calibration.warnings.push_back(fmt::format("{}: {}", camera.report.camera, finding));
    }
    for (const std::string& rejected : camera.report.rejected) {
      result.calibration.warnings.push_back(
          fmt::format("{}: rejected {}", camera.report.camera, rejected));
    }
    if (camera.calibrated) result.calibration.cameras.push_back(*camera.calibrated);
    result.report.cameras.push_back(std::move(camera.report));
  }
  return result;
}

}  // namespace drape::calib
