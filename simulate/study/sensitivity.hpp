// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/sensitivity.hpp"
#include "core/sheet.hpp"
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
/// repeats within 5 % (one standard deviation). Both are stated, not derived.
inline constexpr double kStandInPart = 0.5, kMeasuredPart = 0.05;
/// True if the value was not measured; twist also if bending at 45 degrees was not.
[[nodiscard]] bool is_stand_in(const Fabric& fabric, FabricValue value);
/// Copies the laws with one value multiplied by `factor`.
[[nodiscard]] ClothLaws scaled(ClothLaws laws, FabricValue value, double factor);

/// Change of the forces on the unknowns of a rest per relative change of a value; exact, since
/// forces are proportional to it.
[[nodiscard]] MeshCloth::State force_change(const DrapeLevel& level, const ClothMoment& rest,
                                            FabricValue value);
/// Same, for a cloth with other laws.
[[nodiscard]] MeshCloth::State force_change(const DrapeLevel& level, const ClothMoment& rest,
                                            ClothLaws laws);

struct SensitivityOptions {
  SimulateOptions simulate;
  bool variants = false;  ///< also drape with parts of the model changed
};

/// First-order sensitivity of a drape's marks, and so of their mean distance from `reference`, to
/// each value at its rest, on its mesh and branch: fabric values, more segments per curve, place
/// and size of the objects, friction, places of pins and clamps, level of the bench. Pressed places
/// stay pressed, so that no response leads to another branch. A sliding place follows a change that
/// pulls it onward and sticks for one that pulls it back: the response to friction is the mean of
/// both. `options.simulate` must be those of the drape.
[[nodiscard]] SensitivityFile sensitivities_of(const SimulateResult& result, const Fabric& fabric,
                                               const Sheet& reference,
                                               const SensitivityOptions& options);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::FabricValue>[] = {
    "tensile_warp", "tensile_weft", "shear",        "bending_warp",
    "bending_weft", "twist",        "areal_density"};
