// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "core/units.hpp"
#include "triangulate/guards/taut.hpp"

namespace drape::triangulate {

/// Change of an object: shift along x, y, z (mm), rotation about z (deg), and increase of size (mm)
/// with its foot fixed.
using Change = Eigen::Matrix<double, 5, 1>;

[[nodiscard]] Obstacle changed(const Obstacle& object, const Change& change);

/// Largest distance of resting cloth from an object: its thickness. Woven cloth is thinner than
/// this (KES-FB-3 at 0.5 gf/cm2, 0.3 to 0.6 mm for the four fabrics of Codim-IPC).
constexpr double kThickest_m = 1 * units::mm;

/// Limit for marks inside an object, in standard deviations.
constexpr double kObjectSigmas = 3;

/// Probability of contradicting a correct object: by chi-square, and by one direction alone.
constexpr double kObjectRisk = 0.005;

/// Additional error of marks on sharp creases, which can reach 0.23 mm (README, limits).
constexpr double kCrease_m = 0.1 * units::mm;

/// A measured sheet as evidence about the positions of objects.
struct SeenCloth {
  const Sheet& sheet;
  std::vector<ClothSpan> spans;
  /// Distance of each mark from each mesh object of the scene; empty for other objects.
  std::vector<std::vector<double>> mesh_gaps_m = {};

  /// Signed distance of a mark from an object of the scene, negative inside.
  [[nodiscard]] double gap_m(const Scene& scene, std::size_t object, std::size_t mark) const;
};

/// Evidence against an object: marks inside it, and cloth too short to pass outside.
struct Against {
  int inside = 0;
  const SheetMark* deepest = nullptr;
  double depth_m = 0;
  const ClothSpan* shortest = nullptr;
  double shortfall_m = 0;
  double chi2 = 0;  ///< sum of squares in units of the marks' standard deviations
};
[[nodiscard]] Against against(const SeenCloth& seen, const Obstacle& object);

/// Minimises `value` by pattern search (Hooke and Jeeves 1961), for few parameters and a rough
/// function without derivatives. Varies only the `free` components; stops early below `enough`.
[[nodiscard]] Change least(const std::function<double(const Change&)>& value,
                           const std::vector<int>& free, double enough);

/// True if no object within the stated uncertainties is consistent: either the least chi square of
/// any object near the stated one, for the move plus the remaining contradiction, exceeds
/// chi2_limit(), or its top would have to be lowered by more than most_lowered_m(). If the stated
/// uncertainties are right, the former does not exceed that of the true object, whose first part
/// has as many degrees of freedom as there are values; each false alarm rate is at most 1 in 200.
[[nodiscard]] bool is_contradicted(const SeenCloth& seen, const Obstacle& object,
                                   const ObjectUncertainty& stated);

/// 99.5 % quantile of chi square with the object's number of values as degrees of freedom.
[[nodiscard]] double chi2_limit(const Obstacle& object);

/// 99.5 % quantile of the error by which the top is stated too high: position plus size.
[[nodiscard]] double most_lowered_m(const Obstacle& object, const ObjectUncertainty& stated);

/// The lowest mark, if it is below a table at this height by more than three standard deviations of
/// table height and mark.
[[nodiscard]] const SheetMark* below_table(const Sheet& sheet, const Scene& scene,
                                           double table_z_m);

/// The mark nearest above the top of any object (anywhere, if there is none above a top), if it is
/// higher than resting cloth can be.
struct Untouched {
  std::size_t object = 0;
  double nearest_m = 1;
  double allowed_m = 0;  ///< thickest cloth and three standard deviations of place, size, mark
};
[[nodiscard]] std::optional<Untouched> untouched(const SeenCloth& seen, const Scene& scene);

/// 3 x 3 marks that lie level although nothing in the scene supports them. Cloth that spans a
/// length L without support sags by at least L^2 / (8 H), with H the longest side of the patch,
/// since its tension is at most the weight of the whole patch; level means a quarter of that. A
/// single mark proves less: stiff cloth can lift a free edge above its support.
struct Floating {
  MarkId first;
  double z_m = 0;      ///< height of the lowest mark
  double range_m = 0;  ///< lowest to highest mark
  double spare_m = 0;  ///< distance above what any support allows
};
/// The lowest such marks; nullopt if pins or clamps pull on the cloth.
[[nodiscard]] std::optional<Floating> floating(const SeenCloth& seen, const Scene& scene);

}  // namespace drape::triangulate
