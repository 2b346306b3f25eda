// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "triangulate/guards/objects.hpp"
#include "triangulate/triangulate.hpp"

// Tests of a measured sheet for faults that leave each single mark plausible: a wrong pitch, object
// or camera. Each limit follows from stated uncertainties; each message names file and key, and the
// value that the marks indicate. No test moves a mark.

namespace drape::triangulate {

/// Throws Error(bad_input) unless the scene's print is the one used for detection, which defines
/// the marks' material coordinates.
void require_detected_print(const MarkLattice& lattice, const Scene& scene);

/// Explains why the print's pitch is wrong. The length along the cloth between neighbouring marks,
/// from chords and the turns at both ends, must equal the pitch within `most_strain` (of woven
/// cloth under its own weight) and four standard uncertainties. Warp and weft are tested
/// separately. `scale_sd` is the relative standard uncertainty common to all marks.
[[nodiscard]] std::vector<std::string> contradictions_of_pitch(const std::vector<SheetMark>& marks,
                                                               double pitch_m, double most_strain,
                                                               double scale_sd,
                                                               const std::string& print_file);

/// Range of relative scale errors common to all lengths of the sheet that the print does not
/// contradict; it contains zero if contradictions_of_pitch() finds nothing. nullopt if too few
/// marks are collinear on sufficiently smooth cloth.
struct UnseenScale {
  std::optional<double> least, most;
};

[[nodiscard]] UnseenScale unseen_scale(const std::vector<SheetMark>& marks, double pitch_m,
                                       double most_strain, double scale_sd);

[[nodiscard]] std::string scale_text(const UnseenScale& unseen);

/// Explains why objects and table cannot have the stated position and size: marks inside them,
/// cloth too short to pass outside (a string pulled taut over the object between neighbouring marks
/// is not longer than the cloth), marks hidden from the one camera that saw them, or no mark near
/// any top. An object is contradicted if no position and size within its uncertainties passes. The
/// message names the values that fit the marks.
[[nodiscard]] std::vector<std::string> contradictions_of_objects(const SeenCloth& seen,
                                                                 const Scene& scene);

/// Explains level cloth without support by the table or any object of the scene (floating()).
[[nodiscard]] std::vector<std::string> contradictions_of_support(const SeenCloth& seen,
                                                                 const Scene& scene);

/// Misfit of the marks' views: median in standard deviations over all marks with at least two
/// views, whether a point or a gap.
struct Misses {
  double median_sigmas = 0;
  std::size_t marks = 0;
};

/// Runs all these tests on one set; `placed` has every mark with a point, rejected ones included.
[[nodiscard]] std::vector<std::string> contradictions_of(
    const Detections& detections, const Calibration& calibration, const std::string& set,
    const TriangulateOptions& options, const Misses& misses, const std::vector<SheetMark>& placed,
    const Sheet& sheet);

/// Same, for a sheet from another instrument, without camera views.
[[nodiscard]] std::vector<std::string> contradictions_of_sheet(const MarkLattice& lattice,
                                                               const TriangulateOptions& options,
                                                               const std::vector<SheetMark>& placed,
                                                               const Sheet& sheet);

/// Errors of the scale (unseen_scale()) and of the scene's objects (detection_limits()) that this
/// sheet would not reveal.
[[nodiscard]] std::vector<Unseen> unseen_errors_of(const Detections& detections,
                                                   const TriangulateOptions& options,
                                                   const Sheet& sheet);

}  // namespace drape::triangulate
