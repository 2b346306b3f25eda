// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/error.hpp"
#include "core/fields/fields.hpp"

namespace drape::simulate {

struct KawabataCurve;

// Numbers that a KES sheet lists for one direction, in its units, for use without the plots. Each
// is checked against those of textiles; a fault names the likely mistake in units.

/// Two of EMT, LT and WT, or all three if consistent within 3 %.
struct TensileNumbers {
  std::optional<double> emt_percent, lt, wt_gf_cm_per_cm2, rt_percent;
};
struct ShearNumbers {
  double g_gf_per_cm_deg = 0;
  std::optional<double> hg2_gf_per_cm, hg5_gf_per_cm;  ///< full widths at 0.5 and 5 degrees
  std::optional<double> slip_angle_deg;
};
struct BendingNumbers {
  double b_gf_cm2_per_cm = 0;
  std::optional<double> hb2_gf_cm_per_cm, slip_curvature_per_cm;
};
void fields(Fields& f, TensileNumbers& numbers);
void fields(Fields& f, ShearNumbers& numbers);
void fields(Fields& f, BendingNumbers& numbers);

// Curves derived from these numbers, with `file` as their file.

/// f = A (exp(b strain) - 1) through the origin and 500 gf/cm at EMT, with b from LT = 2 (1/x -
/// 1/(exp(x) - 1)), x = b EMT (LT above 1 gives a concave curve). Unloading is the same with LT RT;
/// RT defaults to 60 %.
[[nodiscard]] KawabataCurve curve_of(const TensileNumbers& numbers,
                                     const std::filesystem::path& file);
/// Shear curve up to 8 degrees.
[[nodiscard]] KawabataCurve curve_of(const ShearNumbers& numbers,
                                     const std::filesystem::path& file);
/// Bending curve up to 2.5 1/cm.
[[nodiscard]] KawabataCurve curve_of(const BendingNumbers& numbers,
                                     const std::filesystem::path& file);

/// G (gf/(cm deg)) from the extension EB5 of a strip at 45 degrees under T = 5 gf/cm: G = T / (4
/// EB5). Throws for a value that no textile has.
[[nodiscard]] double shear_from_bias_extension(double eb5_percent, const Where& where);

/// Typical woven cloth, for fabrics of which only B and G are known.
inline const TensileNumbers kUsualTensile = {3, 0.7, {}, 60};

}  // namespace drape::simulate
