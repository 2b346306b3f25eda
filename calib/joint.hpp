// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/calib.hpp"
#include "calib/checks/stage_check.hpp"
#include "calib/joint/fit.hpp"
#include "calib/joint/uncertainty.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

struct JointOptions {
  CalibOptions common;
  std::optional<LensTerms> lens;            ///< absent: the held-out error chooses
  std::optional<BoardKind> board;           ///< absent: the held-out error chooses
  bool estimate_skew = false;               ///< a library option: calibration.json has no skew
  int held_out_groups = 4;                  ///< groups of placements, for the lens and the report
  bool free_stages = false;                 ///< z stages but the first are free poses
  std::optional<Calibration> known_lenses;  ///< lenses calibrated before, by camera name
  double scale_uncertainty = 0;             ///< relative, of the print (1), common to all cameras
  double thickness_mm = 0;                  ///< between the two prints of a two-sided target
};
/// The options of the joint method alone, without `common`.
void fields(Fields& f, JointOptions& options);

struct JointCameraReport {
  std::string camera;
  int views = 0, points = 0;
  double rms_px = 0, object_rms_mm = 0;
  double focal_px = 0, focal_sd_px = 0;
  double centre_sd_px = 0;    ///< larger of the two coordinates of the principal point
  double position_sd_mm = 0;  ///< camera centre, all three axes together
  double skew_px = 0;
  double image_sd_px = 0;        ///< calibration's part, in the middle of the drape volume
  double image_sd_worst_px = 0;  ///< at the volume's worst corner
  double covered_percent = 0;    ///< part of the image, by the box around all points
  double largest_tilt_deg = 0;
};

struct ViewReport {
  std::string set, camera;
  int points = 0;
  double rms_px = 0;
  bool suspicious = false;  ///< above twice the median of all views
};

/// Ends of a joint calibration: figures, reasons, and what would help next.
struct JointReport {
  std::string status;  ///< "good", or why the result must not be used
  LensTerms lens = LensTerms::k1_k2;
  BoardKind board = BoardKind::bow;
  std::vector<HeldOut> held_out;  ///< each lens on views it never saw
  std::vector<HeldOut> boards;    ///< each board on views it never saw
  std::vector<double> alone_px;   ///< RMS by camera with each view's own pose of the target
  double view_inflation = 1;      ///< variance of the views over that of their points' noise
  std::vector<JointCameraReport> cameras;
  std::vector<ViewReport> views;
  /// Bow along x and y (mm), stretch of x against y, shear and scale of the print (1).
  Eigen::Matrix<double, board_parameters, 1> print =
                                                 Eigen::Matrix<double, board_parameters, 1>::Zero(),
                                             print_sd = print;
  double print_rms_mm = 0;  ///< shifts of free points
  int iterations = 0, points = 0;
  double rms_px = 0;        ///< point distance, all cameras
  double chi2_per_dof = 0;  ///< against the points' covariances
  double max_eccentricity_px = 0;
  std::optional<double>
      volume_sd_mm;  ///< calibration's part of a measured point in the drape volume
  std::vector<std::string> rejected;  ///< points and views, with reasons
  std::vector<std::string> warnings;
  std::optional<StageCheck> stages;    ///< motion of the target on its z stage
  std::string print_scale;             ///< sentence about the target's size
  std::optional<MeasuredPlate> plate;  ///< the board, for other calibrations
  std::string next_view;               ///< the target pose that would help most

  [[nodiscard]] bool good() const { return status == "good"; }
};

struct JointResult {
  Calibration calibration;
  JointReport report;
};

/// Calibrates all cameras of the rig together from every view of the target, z stages and free
/// poses: Brown's lens, the plate's bow and the placements (a camera that never saw the reference
/// pose is placed through the others). World: the target in its reference pose.
/// Throws Error(bad_input) naming camera and set where the data cannot calibrate (see start_joint,
/// check_views); an ill-conditioned or bad fit is a status in the Report.
[[nodiscard]] JointResult calibrate_joint(const Detections& detections, const Rig& rig,
                                          const Target& target, const JointOptions& options);

/// The same from views made elsewhere (corners of a chessboard). `model` must have passed
/// start_joint().
[[nodiscard]] JointResult calibrate_joint(const JointModel& model, double dot_diameter_m,
                                          const JointOptions& options);

}  // namespace drape::calib
