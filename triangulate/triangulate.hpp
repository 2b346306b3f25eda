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

namespace drape::triangulate {

struct TriangulateOptions {
  int min_marks = 10;     ///< verdict: fewer measured marks are NO-GO (paper: 10 to 36)
  double max_sigmas = 6;  ///< views that miss each other by more than this disagree
  double max_stretch =
      1.05;  ///< ratio of the distance between lattice neighbours along warp or weft
  double min_angle_deg = 2;       ///< between the two most different rays; below: not observable
  double floor_px = 0.02;         ///< error of a dot's centre that its detector cannot know of
  double doubt_mm = 0.05;         ///< marks stated less certain than this in space are doubtful
  double doubt_sigmas = 3;        ///< as are marks whose views miss each other by more than this
  bool correct_dot_shape = true;  ///< eccentricity and curvature of the dots
  bool merge_islands = true;      ///< pieces of lattice that detect could not label
  int threads = 1;                ///< never changes a result
  /// Scene that the cloth lies on. Moves no mark: the marks are only asked whether they contradict
  /// it.
  std::optional<Scene> scene = std::nullopt;
  std::vector<std::string> contradictions;  ///< contradictions of the scene, found elsewhere: NO-GO
};
/// All but threads, scene and contradictions.
void fields(Fields& f, TriangulateOptions& options);

/// A mark that is measured, with an honest covariance, but not as well as a mark should be.
struct Doubt {
  MarkId mark;
  std::optional<double> sigma_mm;  ///< in space, when that is why
  std::optional<double> sigmas;    ///< by which the views miss each other, when that is why
};

/// Miss of two cameras over the marks that both see (epipolar distance).
struct PairAgreement {
  std::string first, second;
  int marks = 0;
  double median_sigmas = 0;  ///< in stated standard deviations, the calibration's included
  double median_px = 0;

  /// Were all marks off together, as a wrong calibration has them, they would be beyond this in one
  /// of 1,000 good rigs (normal distribution); independent errors have their median at 0.67.
  static constexpr double max_sigmas = 3.29;
  [[nodiscard]] bool good() const { return median_sigmas <= max_sigmas; }
};

/// Errors that no mark would contradict.
struct Unseen {
  std::string of;  ///< "scale", "object 1"
  std::string limits;
};

struct TriangulateReport {
  int measured = 0;
  int gaps = 0;
  std::vector<int> marks_by_views;  ///< index: number of views used
  double median_reprojection_px = 0;
  double median_sigma_mm = 0;              ///< root mean of a mark's three variances
  double median_calibration_sigma_mm = 0;  ///< the calibration's part of it
  bool has_calibration_covariance = false;
  double hidden_bend_per_m = 0;   ///< curvature that no neighbour shows, as learned from the sheet
  double median_chi_per_dof = 0;  ///< agreement of the views; about 0.7 to 1 is right
  double largest_shape_shift_mm = 0;  ///< by the correction of the dots' shape
  double median_shape_shift_mm = 0;
  std::vector<std::string> dropped_views;  ///< mark, camera, reason
  int islands = 0;                         ///< pieces of lattice without labels, over all views
  int merged_islands = 0;
  int merged_dots = 0;                    ///< dots that got their label so
  std::vector<std::string> island_fates;  ///< camera, island, dots, what became of it and why
  std::vector<PairAgreement> pairs;       ///< pairs of cameras, by name
  std::vector<Doubt> doubts;              ///< by mark
  std::vector<std::string> no_go;         ///< why the sheet is no measurement; empty: it is one
  std::vector<Unseen> unseen;             ///< limits for the scale and each object
  std::vector<std::string> warnings;
};

struct TriangulateResult {
  Sheet sheet;
  TriangulateReport report;
};

/// Positions in the world frame of all marks that two or more calibrated cameras saw (paper
/// section 5): least squares on distorted pixels over all views, weighted by each detection's
/// covariance. Each mark of the lattice becomes a mark or a gap with a reason. Throws
/// Error(bad_input) when the set is not in the detections or fewer than two of its cameras are in
/// the calibration; rays that do not meet are gaps, never an exception.
[[nodiscard]] TriangulateResult triangulate(const Detections& detections,
                                            const Calibration& calibration, const std::string& set,
                                            const TriangulateOptions& options);

}  // namespace drape::triangulate
