// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/fields/fields.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "triangulate/point.hpp"

namespace drape::triangulate {

struct TriangulateOptions {
  int min_marks = 10;     ///< verdict: fewer measured marks are NO-GO (the paper has 10 to 36)
  double max_sigmas = 6;  ///< views with a larger misfit disagree
  double max_stretch =
      1.05;  ///< largest ratio of a distance between lattice neighbours to the printed one
  double min_angle_deg = 2;       ///< smallest angle between the two most different rays
  double floor_px = 0.02;         ///< error of a dot's centre unknown to its detector
  double doubt_mm = 0.05;         ///< marks with a larger uncertainty in space are doubtful
  double doubt_sigmas = 3;        ///< marks whose views have a larger misfit are doubtful
  bool correct_dot_shape = true;  ///< correct for eccentricity and curvature of the dots
  bool merge_islands = true;      ///< label lattice pieces that detect could not label
  int threads = 1;                ///< never changes a result
  /// Scene of the cloth. It moves no mark; the marks are only tested against
  /// it.
  std::optional<Scene> scene = std::nullopt;
  std::vector<std::string> contradictions;  ///< contradictions of the scene, found elsewhere: NO-GO
};

/// Describes all options except threads, scene and contradictions.
void fields(Fields& f, TriangulateOptions& options);

/// A mark that is measured, with a valid covariance, but less accurately than it should be.
struct Doubt {
  MarkId mark;
  std::optional<double> sigma_mm;  ///< position uncertainty, if that is the reason
  std::optional<double> sigmas;    ///< misfit of the views, if that is the reason
};

/// Distance between the rays of two cameras over their common marks (epipolar distance).
struct PairAgreement {
  std::string first, second;
  int marks = 0;
  double median_sigmas = 0;  ///< in stated standard deviations, including those of the calibration
  double median_px = 0;

  /// Limit exceeded by one in 1,000 good rigs if the errors of all marks are equal, as with a wrong
  /// calibration (normal distribution); for independent errors the median is 0.67.
  static constexpr double max_sigmas = 3.29;
  [[nodiscard]] bool good() const { return median_sigmas <= max_sigmas; }
};

/// Size of an error that no mark would contradict.
struct Unseen {
  std::string of;  ///< "scale", "object 1"
  std::string limits;
};

struct TriangulateReport {
  int measured = 0;
  int gaps = 0;
  std::vector<int> marks_by_views;  ///< index is the number of views used
  double median_reprojection_px = 0;
  double median_sigma_mm = 0;              ///< square root of the sum of a mark's three variances
  double median_calibration_sigma_mm = 0;  ///< contribution of the calibration to it
  bool has_calibration_covariance = false;
  double median_chi_per_dof = 0;      ///< agreement of the views; should be about 0.7 to 1
  double largest_shape_shift_mm = 0;  ///< largest displacement by the correction of dot shapes
  double median_shape_shift_mm = 0;
  std::vector<std::string> dropped_views;  ///< mark, camera, reason
  int islands = 0;                         ///< lattice pieces without labels, over all views
  int merged_islands = 0;
  int merged_dots = 0;                    ///< dots labelled by merging islands
  std::vector<std::string> island_fates;  ///< camera, island, dots, outcome and reason
  std::vector<PairAgreement> pairs;       ///< pairs of cameras, sorted by name
  std::vector<Doubt> doubts;              ///< sorted by mark
  std::vector<std::string> no_go;         ///< why the sheet is no valid measurement; empty if it is
  std::vector<Unseen> unseen;             ///< undetectable errors of the scale and of each object
  std::vector<std::string> warnings;
};

struct TriangulateResult {
  Sheet sheet;
  TriangulateReport report;
};

/// Computes the world positions of all marks seen by at least two calibrated cameras (paper section
/// 5): least squares on distorted pixels over all views, weighted by each detection's covariance.
/// Each mark of the lattice becomes a mark or a gap with a reason. Throws Error(bad_input) if the
/// set is not in the detections or fewer than two of its cameras are calibrated; rays that do not
/// meet are gaps, never an exception.
[[nodiscard]] TriangulateResult triangulate(const Detections& detections,
                                            const Calibration& calibration, const std::string& set,
                                            const TriangulateOptions& options);

/// Records the scene that was used, with its table and objects, and the laying if it has a name.
/// The hash is that of the bytes that were read.
void note_scene(MeasuredSource& source, const Scene& scene, const RepeatId& repeat);

}  // namespace drape::triangulate
