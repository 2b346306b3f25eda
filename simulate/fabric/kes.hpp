// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/files/toml_file.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {

/// Curves from the numbers that a KES sheet lists, where the plots are not at hand. Each reads one
/// table of fabric.toml, checks every number against what textiles have, and names the likely
/// mistake in units. The curves' file is the fabric file.

/// emt_percent, lt, wt_gf_cm_per_cm2 (two of the three; all three must agree within 3 %) and
/// rt_percent: f = A (exp(b strain) - 1) through the origin and 500 gf/cm at EMT, with b from LT =
/// 2 (1/x - 1/(exp(x) - 1)), x = b EMT (LT above 1: a curve that bends down); unloading the same
/// with LT RT.
[[nodiscard]] KawabataCurve tensile_from_kes(const TomlTable& table);

/// g_gf_per_cm_deg and, where known, hg2_gf_per_cm at 0.5 degrees and hg5_gf_per_cm at 5 degrees
/// (KES 2HG, 2HG5: full widths of the loop), to 8 degrees.
[[nodiscard]] KawabataCurve shear_from_kes(const TomlTable& table);

/// G (gf/(cm deg)) of the extension EB5 of a strip at 45 degrees under T = 5 gf/cm: G = T / (4
/// EB5). Refuses one that no textile has.
[[nodiscard]] double shear_from_bias_extension(double eb5_percent, const Where& where);

/// b_gf_cm2_per_cm and, where known, hb2_gf_cm_per_cm (KES 2HB), to 2.5 1/cm.
[[nodiscard]] KawabataCurve bending_from_kes(const TomlTable& table);

/// EMT 3 %, LT 0.7, RT 60 %: a woven cloth, for fabrics of which only B and G are known.
[[nodiscard]] KawabataCurve usual_tensile(const std::filesystem::path& file);

/// A unit somebody may have used instead, and the number it makes of 1 in the right one.
struct LikelyUnit {
  double factor;
  const char* unit;
};
/// Refuses a value outside least .. most; names a unit in which it would be usual.
void check_usual(const TomlTable& table, const std::string& key, double value, double least,
                 double most, const std::vector<LikelyUnit>& units);

}  // namespace drape::simulate
