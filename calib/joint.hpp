// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/calib.hpp"
#include "calib/checks/inputs.hpp"
#include "calib/joint/fit.hpp"
#include "calib/joint/uncertainty.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Throws Error(bad_input) naming the camera if all its views lie in one corner of the image.
void check_places(const JointModel& views);

struct JointOptions {
  CalibOptions common;
  std::optional<LensTerms> lens;            ///< absent: selected by held-out error
  std::optional<BoardKind> board;           ///< absent: selected by held-out error
  int held_out_groups = 4;                  ///< number of groups of placements for cross-validation
  bool free_stages = false;                 ///< treats z stages other than the first as free poses
  std::optional<Calibration> known_lenses;  ///< previously calibrated lenses, by camera name
  double scale_uncertainty = 0;  ///< relative uncertainty of the print's scale (1), for all cameras
  double thickness_mm = 0;       ///< distance between the two prints of a two-sided target
};

/// Options of the joint method only, without `common`.
void fields(Fields& f, JointOptions& options);

struct JointCameraReport {
  std::string camera;
  int views = 0, points = 0;
  double rms_px = 0, object_rms_mm = 0;
  double focal_px = 0, focal_sd_px = 0;
  double centre_sd_px = 0;       ///< larger of the two coordinates of the principal point
  double position_sd_mm = 0;     ///< camera centre, all three axes together
  double image_sd_px = 0;        ///< due to the calibration, in the middle of the drape volume
  double image_sd_worst_px = 0;  ///< at the worst corner of the volume
  double covered_percent = 0;    ///< fraction of the image inside the box around all points
  double largest_tilt_deg = 0;
};

/// Results of a joint calibration: figures, reasons, and possible improvements.
struct JointReport {
  std::string status;  ///< "good", or why the result must not be used
  LensTerms lens = LensTerms::k1_k2;
  BoardKind board = BoardKind::bow;
  std::vector<HeldOut> held_out;  ///< error of each lens model on held-out views
  std::vector<HeldOut> boards;    ///< error of each board model on held-out views
  std::vector<double> alone_px;   ///< RMS by camera with a separate target pose per view
  double view_inflation = 1;  ///< variance between views over that expected from the points' noise
  std::vector<JointCameraReport> cameras;
  /// Bow along x and y (mm); stretch of x against y, shear and scale of the print (1).
  Eigen::Matrix<double, board_parameters, 1> print =
                                                 Eigen::Matrix<double, board_parameters, 1>::Zero(),
                                             print_sd = print;
  double print_rms_mm = 0;  ///< RMS shift of the free points
  int iterations = 0, points = 0;
  double rms_px = 0;        ///< RMS point distance over all cameras
  double chi2_per_dof = 0;  ///< relative to the points' covariances
  double max_eccentricity_px = 0;
  std::optional<double>
      volume_sd_mm;  ///< due to the calibration, of a measured point in the drape volume
  std::vector<std::string> rejected;  ///< rejected points and views, with reasons
  std::vector<std::string> warnings;
  std::optional<StageCheck> stages;    ///< motion of the target on its z stage
  std::string print_scale;             ///< sentence about the size of the target
  std::optional<MeasuredPlate> plate;  ///< measured board, for use in other calibrations
  std::string next_view;               ///< target pose that would improve the calibration most

  [[nodiscard]] bool good() const { return status == "good"; }
};

struct JointResult {
  Calibration calibration;
  JointReport report;
};

/// Calibrates all cameras of the rig together from every view of the target, z stages and free
/// poses: Brown lenses, the bow of the plate and the placements. A camera that never saw the
/// reference pose is located through the others. World: the target in its reference pose. Throws
/// Error(bad_input) naming camera and set if the data cannot calibrate (see start_joint,
/// check_views); an ill-conditioned or bad fit is a status in the Report.
[[nodiscard]] JointResult calibrate_joint(const Detections& detections, const Rig& rig,
                                          const Target& target, const JointOptions& options);

/// Same, from views detected elsewhere (corners of a chessboard). `model` must have passed
/// start_joint().
[[nodiscard]] JointResult calibrate_joint(const JointModel& model, double dot_diameter_m,
                                          const JointOptions& options);

}  // namespace drape::calib
