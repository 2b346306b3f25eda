// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "calib/acceptance/acceptance.hpp"
#include "calib/joint/fit.hpp"
#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// A measured point of the target, with the sources of its uncertainty.
struct MeasuredPoint {
  Eigen::Vector3d in_world_mm;
  Eigen::Matrix3d noise_mm2;           ///< contribution of the detections' covariances
  Eigen::Matrix3Xd by_calibration_mm;  ///< derivative by the cameras' parameters (joint_covariance)
};

/// Measures all points of a set seen by at least two calibrated cameras (least squares on distorted
/// pixels), with derivatives by the cameras' parameters in the calibration's order.
[[nodiscard]] std::map<MarkId, MeasuredPoint> measured_points(const Detections& detections,
                                                              const Calibration& calibration,
                                                              const std::string& set);

/// The measured plate as described by its target file and stated bow.
struct Plate {
  Target target;
  Board bow;

  /// `bow_mm`: height of its edges above its centre along x and y.
  Plate(Target described, const Eigen::Vector2d& bow_mm);
  [[nodiscard]] Eigen::Vector3d point(MarkId mark) const {
    return bow.bent(target.point_in_target(mark));
  }
};

/// Pose and points of the plate in one set.
struct Position {
  std::string set;
  std::map<MarkId, MeasuredPoint> points;
  WorldFromTarget pose;  ///< best fit to the points
};

/// Names of the sets in the order of the file.
[[nodiscard]] std::vector<std::string> sets_of(const Detections& detections);

/// Position of the plate in each set in which two calibrated cameras see at least four points.
[[nodiscard]] std::vector<Position> positions_of(const Detections& detections,
                                                 const Calibration& calibration,
                                                 const Plate& plate);

/// Counts distinct positions. A position closer to an earlier one than half the plate's pitch (mean
/// over its points) is a repetition: each point is still nearest to its earlier position, and no
/// other part of the volume is tested.
[[nodiscard]] int count_places(const std::vector<const Position*>& positions, const Plate& plate);

/// Copies detections, shifting each dot's centroid to the image of its centre (Heikkila 2000) at
/// the known positions; corners stay unchanged.
[[nodiscard]] Detections without_eccentricity(Detections detections, const Calibration& calibration,
                                              const Plate& plate,
                                              const std::vector<Position>& positions);

/// Detections used for calibration, as named by the run record beside calibration.json. `tested`:
/// the detections to be measured; recognises them by content as well.
[[nodiscard]] CalibrationEvidence detections_behind(const std::filesystem::path& calibration,
                                                    const std::filesystem::path& tested);

/// Draws of the effect of calibration error and noise on measured points (JCGM 101), shared by all
/// figures: one draw of the calibration error applies to all points of all positions. Fixed seeds.
class Draws {
 public:
  /// `covariance` is that of the cameras' parameters; empty if none is stated.
  Draws(const Eigen::MatrixXd& covariance, int count);
  [[nodiscard]] int count() const { return count_; }
  /// Root of the calibration's covariance, root() root()'; errors are drawn as root() z.
  [[nodiscard]] const Eigen::MatrixXd& root() const { return root_; }

  /// Errors (mm) of the points, three rows per point, one column per draw. `noise_variance` is that
  /// of the detections over the stated one. `seed` must differ between positions.
  [[nodiscard]] Eigen::MatrixXd errors_mm(const std::vector<const MeasuredPoint*>& points,
                                          double noise_variance, unsigned seed) const;
  /// Standard normal numbers, one per draw.
  [[nodiscard]] Eigen::RowVectorXd standard_normal(unsigned seed) const;

 private:
  int count_;
  Eigen::MatrixXd root_, unit_;
};

/// Changes since the calibration, estimated from all positions together.
struct Changes {
  /// Growth of the plate, its bow, motion of each camera: each as if it were the only change.
  std::vector<AcceptanceFigure> figures;
  std::string cause;  ///< the change beyond its limit that explains most; empty if there is none
  double noise_variance = 1;  ///< variance of the detections over the stated one, at least 1
};

/// Standard uncertainties of the plate.
struct PlateUncertainty {
  double scale = 0;                                  ///< relative uncertainty of its size (1)
  Eigen::Vector2d bow_mm = Eigen::Vector2d::Zero();  ///< stated bow along x and y
  [[nodiscard]] bool has_bow() const { return bow_mm.maxCoeff() > 0; }
};

/// Fits all points of all positions to the calibrated cameras by generalised least squares, with a
/// pose per position. The calibration's errors have its covariance (`root` root'), those of points
/// theirs, enlarged if the positions scatter more. `false_no_go` is the risk for one figure.
[[nodiscard]] Changes changes_since(const Detections& detections, const Calibration& calibration,
                                    const Plate& plate, const std::vector<Position>& positions,
                                    const Eigen::MatrixXd& root,
                                    const PlateUncertainty& plate_uncertainty, double false_no_go);

/// Inputs that all figures have in common.
struct FigureContext {
  const Draws* draws = nullptr;
  double noise_variance = 1;     ///< variance of the detections over the stated one
  double false_no_go = 0.001;    ///< probability of a false NO-GO for one figure
  double scale_uncertainty = 0;  ///< plate's size relative to the calibration's (1)
};

/// Point pairs of the measured lengths: two diagonals, the two longest edges and half a diagonal.
[[nodiscard]] std::vector<std::pair<MarkId, MarkId>> lengths_of(const Target& target);

/// Largest error of lengths_of() over all positions.
[[nodiscard]] AcceptanceFigure length_error(const std::vector<Position>& positions,
                                            const Plate& plate, const FigureContext& context,
                                            const AcceptanceOptions& options);

/// Range of the points' distances from their best-fit plane, after removal of the stated bow.
[[nodiscard]] AcceptanceFigure flatness(const std::vector<Position>& positions, const Plate& plate,
                                        const FigureContext& context,
                                        const AcceptanceOptions& options);

/// Distance between a stage and the first one along the plate's normal, compared with rig.toml.
[[nodiscard]] AcceptanceFigure shift_error(const std::vector<Position>& positions, const Rig& rig,
                                           const FigureContext& context,
                                           const AcceptanceOptions& options);

/// Range of the marks' distances from their best-fit sphere, and error of its diameter.
[[nodiscard]] std::vector<AcceptanceFigure> sphere_figures(const AcceptanceInput& input,
                                                           const Calibration& calibration,
                                                           const FigureContext& context,
                                                           const AcceptanceOptions& options);

/// Scatter of the target at rest relative to the detections' covariances.
[[nodiscard]] AcceptanceFigure noise_floor(const Detections& detections,
                                           const std::vector<std::string>& repeats,
                                           const AcceptanceOptions& options);

}  // namespace drape::calib
