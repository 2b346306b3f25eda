// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/sheet.hpp"
#include "core/simulation_files.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// Fabric values that an equilibrium depends on. Each scales a whole constitutive law.
enum class FabricValue {
  tensile_warp,
  tensile_weft,
  shear,
  bending_warp,
  bending_weft,
  twist,
  areal_density
};

/// Assumed uncertainties: a stand-in lies within half of its value; a measured Kawabata value
/// repeats within 5 % (one standard deviation). Both are assumptions, not derived.
inline constexpr double kStandInPart = 0.5, kMeasuredPart = 0.05;
/// True if the value was not measured; twist also if bending at 45 degrees was not.
[[nodiscard]] bool is_stand_in(const Fabric& fabric, FabricValue value);
/// Copies the laws with one value multiplied by `factor`.
[[nodiscard]] ClothLaws scaled(ClothLaws laws, FabricValue value, double factor);

/// Derivative of the forces on the unknowns of an equilibrium by the relative change of a value;
/// exact, since forces are proportional to it.
[[nodiscard]] MeshCloth::State force_change(const DrapeLevel& level, const ClothMoment& rest,
                                            FabricValue value);
/// Same, for a cloth with other laws.
[[nodiscard]] MeshCloth::State force_change(const DrapeLevel& level, const ClothMoment& rest,
                                            ClothLaws laws);

struct SensitivityOptions {
  SimulateOptions simulate;
  bool variants = false;  ///< also drape with parts of the model changed
};

/// First-order sensitivity of a drape's marks, and of their mean distance from `reference`, to each
/// value, at its equilibrium on its mesh and branch. Values: fabric, more segments per curve,
/// position and size of the objects, friction, positions of pins and clamps, level of the bench.
/// Pressed points stay pressed, so that no response leads to another branch. A sliding point
/// follows a change that pulls it onward and sticks for one that pulls it back: the response to
/// friction is the mean of both. `options.simulate` must be those of the drape.
[[nodiscard]] SensitivityFile sensitivities_of(const SimulateResult& result, const Fabric& fabric,
                                               const Sheet& reference,
                                               const SensitivityOptions& options);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::FabricValue>[] = {
    "tensile_warp", "tensile_weft", "shear",        "bending_warp",
    "bending_weft", "twist",        "areal_density"};
