// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/cloth/cloth.hpp"

/// The checker's own mechanics of a sheet, in long double, without any code of Cloth.
namespace drape::simulate::checker {

using Real = long double;
using Point = std::array<Real, 3>;

/// Share of a particle's weight that may be left on any sheet at rest, whatever its certificate
/// allows.
constexpr double kMostResidual = 1e-3;

[[nodiscard]] inline Point minus(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] inline Real dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Half a triple at a clamp: from the particle `held` to `next`, along the threads of direction d.
/// The sheet leaves along `forward`, both units across the clamp.
struct HalfTriple {
  int held = 0, next = 0, d = 0;
  Point forward{}, normal{};
};

struct SheetSpec {
  int rows = 0, cols = 0;
  Real patch_warp_m = 0, patch_weft_m = 0;
  bool paper_model = false;
  bool paper_mass = false;
  ClothLaws laws;
  ClothMemory memory;  ///< where laws.friction is
  std::vector<HalfTriple> clamped;
};

struct Mechanics {
  Real stretch_j = 0, shear_j = 0, bending_j = 0, twist_j = 0;
  std::array<Real, 2> strain_least{}, strain_most{};  ///< warp, weft
  Real shear_most_rad = 0, curvature_most_per_m = 0;
  std::vector<Point> force;  ///< internal, N
  std::vector<Real> mass;    ///< kg
  bool memory_fits = true;   ///< as many slips as friction elements
  /// 1 and what |force| of a friction element has over its limit, in parts of its place's limit.
  Real friction_over_limit = 0;
};

/// Points by row, then column.
[[nodiscard]] Mechanics mechanics_of(const SheetSpec& spec, const std::vector<Point>& points);

/// A place of the sheet where an object or a pin may push: weights of up to four particles.
struct Support {
  std::array<int, 4> particle{};
  std::array<Real, 4> weight{};
  Point normal{};    ///< unit, out of the object
  bool pin = false;  ///< holds in every direction
};

struct Balance {
  Real largest = 0;  ///< largest force left on a particle, N
  int rounds = 0;    ///< steps of Newton's method
};
/// Looks for forces at the supports, in the friction cones, that leave at most `tolerance` N on any
/// particle, by an interior point method that ends at such forces wherever there are any (up to
/// rounding); given up after `most_rounds`.
[[nodiscard]] Balance balance(const std::vector<Point>& force, const std::vector<Support>& supports,
                              Real friction, Real tolerance, int most_rounds);

/// Effect of a scene's clamps on a sheet.
struct Clamps {
  std::vector<HalfTriple> halves;
  std::vector<Support> supports;  ///< each clamped particle once, held in every direction
  Real farthest_m = 0;            ///< largest distance of a clamped particle from its place
  Real turned_rad = 0;            ///< largest angle of a first edge, across the clamp, to `forward`
  std::vector<std::string> refusals;
};

/// Every particle of the sheet that lies on a clamp's line in the material. A line that is on no
/// row of particles is refused: the sheet's free length begins elsewhere.
[[nodiscard]] Clamps clamps_of(const Scene& scene, const Sheet& sheet,
                               const std::vector<Point>& points);

}  // namespace drape::simulate::checker
