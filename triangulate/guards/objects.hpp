// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "core/units.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// Two neighbours along warp or weft, with the cloth between them.
struct ClothSpan {
  const SheetMark* from = nullptr;
  const SheetMark* to = nullptr;
  double cloth_m = 0;  ///< longest length along the cloth: material distance plus strain
  double sigma_m = 0;  ///< standard deviation of the distance due to both marks
};

/// Pairs of adjacent measured marks. `most_strain` as in contradictions_of_pitch().
[[nodiscard]] std::vector<ClothSpan> spans_of(const Sheet& sheet, double most_strain);

/// Length (m) of the shortest path between two points outside a sphere or over an edge of a box,
/// like a string pulled taut. Exact; falls back to the chord if that is free, near a box's corners,
/// and for other objects, so it never exceeds the true length.
[[nodiscard]] double taut_path_m(const Obstacle& object, const Eigen::Vector3d& from,
                                 const Eigen::Vector3d& to);

/// Change of an object: shift along x, y, z (mm), rotation about z (deg), and increase of size (mm)
/// with its foot fixed.
using Change = Eigen::Matrix<double, 5, 1>;

[[nodiscard]] Obstacle changed(const Obstacle& object, const Change& change);

/// Largest distance of resting cloth from an object: its thickness. Woven cloth is thinner
/// (KES-FB-3 at 0.5 gf/cm2, 0.3 to 0.6 mm for the four fabrics of Codim-IPC).
constexpr double kThickest_m = 1 * units::mm;

/// Limit for marks inside an object, in standard deviations.
constexpr double kObjectSigmas = 3;

/// A measured sheet as evidence about the positions of objects.
struct SeenCloth {
  const Sheet& sheet;
  std::vector<ClothSpan> spans;
  /// Distance of each mark from each mesh object of the scene; empty for other objects.
  std::vector<std::vector<double>> mesh_gaps_m = {};

  /// Signed distance of a mark from an object of the scene, negative inside.
  [[nodiscard]] double gap_m(const Scene& scene, std::size_t object, std::size_t mark) const;
};

/// Signed distance (m) of each mark from a closed mesh, negative inside. Throws Error(bad_input) if
/// the file cannot be read or is not a closed mesh.
[[nodiscard]] std::vector<double> gaps_to_mesh(const Sheet& sheet, const MeshObject& object,
                                               int threads);

/// An object that passes the tests failed by the stated one.
struct SuggestedObject {
  Obstacle object;   ///< with the values printed in the text
  std::string text;  ///< "yaw_deg = 20.0 (with the other sign)"
  /// Expanded uncertainty (k = 2) of each fitted value, over all passing objects with equal weight.
  Change within = Change::Zero();
};

/// Suggestion for a contradicted object, or the reason why there is none.
struct ObjectSuggestion {
  std::optional<SuggestedObject> one;
  std::string why_not;
};

/// Tries typing errors (signs, axes, units, radius for diameter, a corner for the centre), then
/// fits position and rotation from many starts, then size as well, each by the tests that the
/// stated object failed. All passing objects must form one connected range, sampled by a random
/// walk (hit-and-run, Smith 1984). If two separate ranges pass, nothing is suggested unless only
/// one contains a typing error.
[[nodiscard]] ObjectSuggestion suggested_object(const SeenCloth& seen, const Scene& scene,
                                                std::size_t object);

/// Detection limit of each box and sphere: the smallest error of its height, diameter or width, or
/// rotation that the marks of this drape would contradict (contradictions_of_objects()), in the
/// least visible direction. The stated object is changed until it is contradicted, by up to half of
/// its width, or 45 degrees.
[[nodiscard]] std::vector<Unseen> detection_limits(const SeenCloth& seen, const Scene& scene);

}  // namespace drape::triangulate
