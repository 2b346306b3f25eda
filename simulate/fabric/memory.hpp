// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "simulate/fabric/curve.hpp"

namespace drape::simulate {

/// A spring in series with a slider (Jenkin 1922): it follows its strain up to the slider's limit,
/// then slips. The limit may grow with the magnitude of the strain, as in shear (KES 2HG5 above
/// 2HG). It is rate-independent. `x` is a strain, shear angle (rad) or curvature (1/m); `slip`, the
/// element's memory, is the x at which its force is zero.
///
/// If `stiffness` exceeds |growth| this is a generalised play operator (Visintin 1994): on a path
/// without reversal the result does not depend on the steps, inner loops close, and a reversal that
/// is passed again is forgotten.
struct SlipElement {
  double stiffness = 0;  ///< N/m per unit of x (N per unit for moments)
  double threshold = 0;  ///< limit of the slider at x = 0, N/m (N for moments)
  double growth = 0;     ///< growth of the limit with |x|

  [[nodiscard]] double limit(double x) const;
  /// Force after a path without reversal from the last settled `slip`.
  [[nodiscard]] double force(double x, double slip) const;
  [[nodiscard]] double tangent(double x, double slip) const;  ///< derivative of force() by x
  /// Integral of force() from `slip` to x: energy stored and dissipated by a step from a settled
  /// state; potential of an implicit step (Ortiz and Stainier 1999).
  [[nodiscard]] double potential(double x, double slip) const;
  /// Memory after that path. The force at x is unchanged.
  [[nodiscard]] double settled(double x, double slip) const;
  [[nodiscard]] double stored(double x, double slip) const;  ///< elastic energy after settling
};

/// Friction elements in parallel (Prandtl 1928, Ishlinskii 1944). Together with the elastic curve
/// in parallel they form the law; this class holds the friction part only.
struct FrictionStack {
  std::vector<SlipElement> elements;

  [[nodiscard]] bool empty() const { return elements.empty(); }
  [[nodiscard]] double stiffness() const;  ///< stiffness of all elements before any slips
  /// Total force; `slip` points to one number per element.
  [[nodiscard]] double force(double x, const double* slip) const;
  [[nodiscard]] double tangent(double x, const double* slip) const;
  [[nodiscard]] double potential(double x, const double* slip) const;
  /// Settles every element; returns the dissipated energy (J per unit of force times x).
  double settle(double x, double* slip) const;
};

/// Friction of bending and shear, in parallel with the elastic curves. Index 0 warp, 1 weft.
struct ClothFriction {
  FrictionStack bending[2];  ///< N as a function of curvature (1/m) along the normal of the sheet
  FrictionStack shear;       ///< N/m as a function of rad
};

/// Slips of all friction elements, grouped by place. Places are numbered by particle (triples by
/// their middle one, cells by their lowest), or by triangle.
struct ClothMemory {
  std::vector<double> bending[2];  ///< 1/m
  std::vector<double> shear;       ///< rad
};

/// Content of memory.csv. Reading throws Error(bad_input) for anything else.
[[nodiscard]] std::string memory_csv(const ClothMemory& memory);
[[nodiscard]] ClothMemory read_memory(const std::filesystem::path& file);

/// A friction stack fitted to a loop, and how well elastic curve and stack reproduce the loop.
struct FittedFriction {
  FrictionStack stack;
  double elastic_range = 0;  ///< below this the mean of the branches is unaffected by the reversal
  double rms_error = 0;      ///< error of the half width over the whole loop
  double largest_error = 0;
};

/// Half the width of a loop over |x|, mean of both signs of x, at increasing x >= 0.
struct HalfWidth {
  std::vector<double> x, h;
};

/// Fits one element to the straight line of width over |x| (least squares; exact for loops made
/// from KES numbers), slipping after at most `slip`, for a loop that is open at its ends.
[[nodiscard]] FittedFriction friction_of_numbers(const HalfWidth& loop, double slip);

/// Fits elements with constant and growing limits and slips of 1/2 .. 1/64 of the range: least
/// squares of their half widths with limits >= 0 (Lawson and Hanson 1974).
[[nodiscard]] FittedFriction friction_of_loop(const HalfWidth& loop);

}  // namespace drape::simulate
