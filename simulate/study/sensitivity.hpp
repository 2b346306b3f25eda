// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/sensitivity.hpp"
#include "core/sheet.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// The values of a fabric that an equilibrium depends on. Each scales a whole law.
enum class FabricValue {
  tensile_warp,
  tensile_weft,
  shear,
  bending_warp,
  bending_weft,
  twist,
  areal_density
};

/// A value that nobody measured lies within half of what was put in its place; a measured Kawabata
/// value repeats within 5 % (one standard deviation). Both are stated, not derived.
inline constexpr double kStandInPart = 0.5, kMeasuredPart = 0.05;
/// Twist is one where no bending at 45 degrees was measured.
[[nodiscard]] bool is_stand_in(const Fabric& fabric, FabricValue value);
/// The laws with one value times `factor`.
[[nodiscard]] ClothLaws scaled(ClothLaws laws, FabricValue value, double factor);

/// Change of the forces on the unknowns of a rest per relative change of a value: exact, for forces
/// are proportional to it.
[[nodiscard]] MeshCloth::State force_change(const DrapeLevel& level, const ClothMoment& rest,
                                            FabricValue value);
/// The same where the cloth has other laws.
[[nodiscard]] MeshCloth::State force_change(const DrapeLevel& level, const ClothMoment& rest,
                                            ClothLaws laws);

struct SensitivityOptions {
  SimulateOptions simulate;
  bool variants = false;  ///< drapes again with one part of the model changed
};

/// Where the marks of a drape, and so their mean distance from `reference`, go with each value, to
/// first order at its rest, so on its mesh and its branch: fabric values, more segments per curve,
/// place and size of the objects, friction, places of pins and clamps, level of the bench. Pressed
/// places stay pressed, so that no answer leads to another branch. A place that slides follows a
/// change that draws it on and stays with one that draws it back: friction's answer is the mean of
/// both. `options.simulate`: those of the drape.
[[nodiscard]] SensitivityFile sensitivities_of(const SimulateResult& result, const Fabric& fabric,
                                               const Sheet& reference,
                                               const SensitivityOptions& options);

}  // namespace drape::simulate

template <>
inline constexpr std::string_view drape::names_of<drape::simulate::FabricValue>[] = {
    "tensile_warp", "tensile_weft", "shear",        "bending_warp",
    "bending_weft", "twist",        "areal_density"};
