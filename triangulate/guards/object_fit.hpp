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

/// Change of an object: shift along x, y, z (mm), turn about z (deg), and growth of
/// its size (mm), with its foot where it is.
using Change = Eigen::Matrix<double, 5, 1>;

[[nodiscard]] Obstacle changed(const Obstacle& object, const Change& change);

/// Cloth rests on an object within its own thickness; woven cloth is thinner than this (KES-FB-3
/// at 0.5 gf/cm2, 0.3 to 0.6 mm in the four fabrics of Codim-IPC).
constexpr double kThickest_m = 1 * units::mm;

/// Marks lie outside an object within this many of their standard deviations.
constexpr double kObjectSigmas = 3;

/// Probability that an object as stated is contradicted: by chi-square, and by one direction alone.
constexpr double kObjectRisk = 0.005;

/// Marks on sharp creases lie off by more than they state, by up to 0.23 mm (README, limits).
constexpr double kCrease_m = 0.1 * units::mm;

/// Evidence of a measured sheet about the places of its objects.
struct SeenCloth {
  const Sheet& sheet;
  std::vector<ClothSpan> spans;
  /// Gaps of each mark to each object of the scene that is a mesh; empty for all others.
  std::vector<std::vector<double>> mesh_gaps_m = {};

  /// Signed distance of a mark from an object of the scene, negative inside.
  [[nodiscard]] double gap_m(const Scene& scene, std::size_t object, std::size_t mark) const;
};

/// Evidence against an object where it is: marks inside it, and cloth too short to pass outside.
struct Against {
  int inside = 0;
  const SheetMark* deepest = nullptr;
  double depth_m = 0;
  const ClothSpan* shortest = nullptr;
  double shortfall_m = 0;
  double chi2 = 0;  ///< sum of squares over the marks' standard deviations
};
[[nodiscard]] Against against(const SeenCloth& seen, const Obstacle& object);

/// The change with the least value by pattern search (Hooke and Jeeves 1961): few parameters, a
/// rough surface, no derivative. Only the `free` ones change; ends early below `enough`.
[[nodiscard]] Change least(const std::function<double(const Change&)>& value,
                           const std::vector<int>& free, double enough);

/// True where no object within the stated uncertainties would do: the least chi square of any
/// object near the stated one, what it takes to move there and what still speaks against it, is
/// above chi2_limit(), or its top would have to be lowered by more than most_lowered_m(). Where the
/// stated uncertainties are right the first is not above that of the true object, whose first part
/// has as many degrees of freedom as there are values; each is passed by it at most once in 200.
[[nodiscard]] bool is_contradicted(const SeenCloth& seen, const Obstacle& object,
                                   const ObjectUncertainty& stated);

/// Upper half per cent of chi square with as many degrees of freedom as the object has values.
[[nodiscard]] double chi2_limit(const Obstacle& object);

/// Upper half per cent of how much too high the top is stated: place and size in one direction.
[[nodiscard]] double most_lowered_m(const Obstacle& object, const ObjectUncertainty& stated);

/// The lowest mark, where it lies farther below a table at this height than three standard
/// deviations of the table's height and the mark.
[[nodiscard]] const SheetMark* below_table(const Sheet& sheet, const Scene& scene,
                                           double table_z_m);

/// The nearest mark over the top of any object (anywhere, where none lies over a top), when it lies
/// farther above than cloth that rests on it can.
struct Untouched {
  std::size_t object = 0;
  double nearest_m = 1;
  double allowed_m = 0;  ///< thickest cloth and three standard deviations of place, size and mark
};
[[nodiscard]] std::optional<Untouched> untouched(const SeenCloth& seen, const Scene& scene);

/// Three by three marks that lie level although nothing in the scene is below them. Cloth that
/// spans a length L without support sags by at least L^2 / (8 H), H the patch's longest side, for
/// its tension is at most the weight of the whole patch; level is a quarter of that. A single mark
/// says less: stiff cloth lifts a free edge above its support.
struct Floating {
  MarkId first;
  double z_m = 0;      ///< of the lowest of them
  double range_m = 0;  ///< from the lowest to the highest
  double spare_m = 0;  ///< by which they are too high for every support
};
/// The lowest of them; nothing where pins or clamps pull on the cloth.
[[nodiscard]] std::optional<Floating> floating(const SeenCloth& seen, const Scene& scene);

}  // namespace drape::triangulate
