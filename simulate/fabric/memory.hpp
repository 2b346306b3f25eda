// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "simulate/fabric/curve.hpp"

namespace drape::simulate {

/// A spring in series with a slider (Jenkin 1922): it follows its strain until the slider's limit,
/// then slips. The limit may grow with the size of the strain, as that of shear does (KES 2HG5
/// above 2HG). Rate does not matter. `x` is a strain, shear angle (rad) or curvature (1/m); `slip`,
/// the element's memory, is the x at which it is free of force.
///
/// Where `stiffness` exceeds |growth| this is a generalised play operator (Visintin 1994): a path
/// without reversal gives the same however it is cut into steps, inner loops close, and a reversal
/// that is passed again is forgotten.
struct SlipElement {
  double stiffness = 0;  ///< N/m per unit of x (moments: N per unit)
  double threshold = 0;  ///< the slider's limit at x = 0, N/m (moments: N)
  double growth = 0;     ///< growth of the limit with |x|

  [[nodiscard]] double limit(double x) const;
  /// After a path without reversal from wherever `slip` was settled.
  [[nodiscard]] double force(double x, double slip) const;
  [[nodiscard]] double tangent(double x, double slip) const;  ///< derivative of force() by x
  /// Integral of force() from `slip` to x: what the step from a settled state stores and
  /// dissipates; the potential of an implicit step (Ortiz and Stainier 1999).
  [[nodiscard]] double potential(double x, double slip) const;
  /// The memory after that path. The force at x stays what it was.
  [[nodiscard]] double settled(double x, double slip) const;
  [[nodiscard]] double stored(double x, double slip) const;  ///< energy of a settled element
};

/// Elements in parallel (Prandtl 1928, Ishlinskii 1944). With the elastic curve in parallel they
/// are the whole law; this class is what the elastic curve alone leaves out.
struct FrictionStack {
  std::vector<SlipElement> elements;

  [[nodiscard]] bool empty() const { return elements.empty(); }
  [[nodiscard]] double stiffness() const;  ///< stiffness of all, before any slips
  /// `slip` points to one number per element.
  [[nodiscard]] double force(double x, const double* slip) const;
  [[nodiscard]] double tangent(double x, const double* slip) const;
  [[nodiscard]] double potential(double x, const double* slip) const;
  /// Settles every element; returns what they have dissipated (J per what force times x is).
  double settle(double x, double* slip) const;
};

/// Friction of bending and shear, in parallel with the elastic curves. Index 0 warp, 1 weft.
struct ClothFriction {
  FrictionStack bending[2];  ///< N over 1/m, of the curvature along the sheet's normal
  FrictionStack shear;       ///< N/m over rad
};

/// The slips of all friction elements: those of one place together, places by particle (triples by
/// their middle one, cells by their lowest), or by triangle.
struct ClothMemory {
  std::vector<double> bending[2];  ///< 1/m
  std::vector<double> shear;       ///< rad
};

/// memory.csv of a simulation. Reading throws Error(bad_input) for what is not such a list.
[[nodiscard]] std::string memory_csv(const ClothMemory& memory);
[[nodiscard]] ClothMemory read_memory(const std::filesystem::path& file);

/// A friction stack found from a loop, and how well elastic curve and stack give the loop back.
struct FittedFriction {
  FrictionStack stack;
  double elastic_range = 0;  ///< up to here the mean of the branches is free of the reversal
  double rms_error = 0;      ///< error of the half width, over the whole loop
  double largest_error = 0;
};

/// Half the loop's width over |x|, mean of both signs of x, at increasing x >= 0.
struct HalfWidth {
  std::vector<double> x, h;
};

/// One element with the width's straight line in |x| (least squares; exact for loops made from
/// KES numbers) that slips after `slip` at most, for a loop that is not closed at its ends.
[[nodiscard]] FittedFriction friction_of_numbers(const HalfWidth& loop, double slip);

/// Elements of constant and of growing limit with slips of 1/2 .. 1/64 of the range; least squares
/// of their half widths against the measured ones under limits >= 0 (Lawson and Hanson 1974).
[[nodiscard]] FittedFriction friction_of_loop(const HalfWidth& loop);

}  // namespace drape::simulate
