// SPDX-License-Identifier: Apache-2.0
#pragma once

// Contradictions of a measured sheet although each of its marks looks right: a wrong pitch, object
// or camera. Each check has a limit that follows from stated uncertainties, and its sentence names
// file and key, and the value that the marks speak for. Nothing here moves a mark.

#include <optional>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "triangulate/guards/object_fit.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// Throws Error(bad_input) where the scene's print is not the one that the marks were detected
/// with: their material coordinates are that one's.
void require_detected_print(const MarkLattice& lattice, const Scene& scene);

/// Why the print's pitch cannot be right: the length along the cloth between neighbouring marks,
/// from chords and the turns at both ends, must be the pitch but for `most_strain` (of woven cloth
/// under its own weight) and four standard uncertainties. Warp and weft are judged each by itself.
/// `scale_sd` is the relative standard uncertainty that all marks have in common.
[[nodiscard]] std::vector<std::string> contradictions_of_pitch(const std::vector<SheetMark>& marks,
                                                               double pitch_m, double most_strain,
                                                               double scale_sd,
                                                               const std::string& print_file);

/// Relative errors of scale, common to all lengths of this sheet, with which the print still
/// agrees: zero is among them where contradictions_of_pitch() finds nothing. Nothing where too few
/// marks lie in a line on cloth that is smooth enough.
struct UnseenScale {
  std::optional<double> least, most;
};
[[nodiscard]] UnseenScale unseen_scale(const std::vector<SheetMark>& marks, double pitch_m,
                                       double most_strain, double scale_sd);
[[nodiscard]] std::string scale_text(const UnseenScale& unseen);

/// Largest strain along warp or weft of the scene's fabric when the whole patch hangs from one
/// edge, by the first points of its tensile curves. Curves that the fabric file calls stand-ins may
/// be wrong by a factor of 10. Throws Error(bad_input) for a fabric that cannot be read.
[[nodiscard]] double most_strain_of(const Scene& scene, const Eigen::Vector2d& patch_m);

/// Why the objects and the table cannot be where and as large as the scene says: marks inside them,
/// cloth too short to pass outside them (a string pulled taut over the object between neighbouring
/// marks is not longer than the cloth), marks seen by one camera that they hide, or no mark near
/// the top of any. Contradicted is an object when none within its stated uncertainties would do.
/// What the marks speak for is fitted and named.
[[nodiscard]] std::vector<std::string> contradictions_of_objects(const SeenCloth& seen,
                                                                 const Scene& scene);

/// Level cloth that neither table nor any object of the scene holds up (floating()).
[[nodiscard]] std::vector<std::string> contradictions_of_support(const SeenCloth& seen,
                                                                 const Scene& scene);

/// By how much the views of marks miss each other: the median in standard deviations, over all
/// marks with two or more views, whether they became a point or a gap.
struct Misses {
  double median_sigmas = 0;
  std::size_t marks = 0;
};

/// Why most views miss each other: cameras exchanged in this set, or one that moved after the
/// calibration. Empty when half of the marks agree within three sigma. `now` is after the
/// correction of the dots' shape.
[[nodiscard]] std::vector<std::string> contradictions_of_cameras(const Detections& detections,
                                                                 const Calibration& calibration,
                                                                 const std::string& set,
                                                                 const TriangulateOptions& options,
                                                                 const Misses& now);

/// All of these for one set; `placed` holds every mark that has a point, before neighbours judge.
[[nodiscard]] std::vector<std::string> contradictions_of(
    const Detections& detections, const Calibration& calibration, const std::string& set,
    const TriangulateOptions& options, const Misses& misses, const std::vector<SheetMark>& placed,
    const Sheet& sheet);

/// Errors of scale (unseen_scale()) and of the scene's objects (detection_limits()) that this
/// sheet would not contradict.
[[nodiscard]] std::vector<Unseen> unseen_errors_of(const Detections& detections,
                                                   const TriangulateOptions& options,
                                                   const Sheet& sheet);

}  // namespace drape::triangulate
