// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

/// Units: SI in memory, people's units in files. `x * mm` converts x millimetres to metres; `x /
/// mm` converts metres to millimetres.
namespace drape::units {

inline constexpr double mm = 1e-3;                       ///< m
inline constexpr double um = 1e-6;                       ///< m
inline constexpr double deg = std::numbers::pi / 180.0;  ///< rad
inline constexpr double g_per_m2 = 1e-3;                 ///< kg/m^2
inline constexpr double percent = 1e-2;                  ///< 1

// Kawabata Evaluation System (KES-FB) units, g = 9.80665 m/s^2 (Kawabata 1980).
inline constexpr double gf = 9.80665e-3;                  ///< N
inline constexpr double gf_per_cm = 0.980665;             ///< N/m (tension, shear force per width)
inline constexpr double gf_per_cm_deg = gf_per_cm / deg;  ///< N/(m rad), shear stiffness G
inline constexpr double gf_cm2_per_cm = 9.80665e-5;       ///< N m, bending rigidity B
inline constexpr double gf_cm_per_cm = 9.80665e-3;        ///< N, moment per width M and 2HB
inline constexpr double gf_cm_per_cm2 = 0.980665;         ///< J/m^2, tensile energy WT
inline constexpr double per_cm = 100.0;                   ///< 1/m, curvature

}  // namespace drape::units
