// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/rig.hpp"
#include "core/scene.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/mesh/material_mesh.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// Throws Error(bad_input) naming two pins that are farther apart in space than the cloth between
/// them reaches: along its threads, each stretched to the end of its measured curve.
void check_pins(const Scene& scene, const Print& print, const Fabric& fabric);

/// Throws Error(bad_input) naming `start.centre_mm` and how much higher it must be, where a place
/// of a flat start lies deeper inside an object or below the table than cloth is thick: no solver
/// can know on which side it is to come out, and cloth that comes out below falls past the object.
void refuse_inside(const Scene& scene, const std::vector<Eigen::Vector3d>& places_in_world,
                   const Surroundings& surroundings);

/// The same for the scene's own flat start of a cloth; starts of other modes lie outside.
void refuse_flat_start_inside(const Scene& scene, const Print& print, const ClothOutline& outline,
                              const Surroundings& surroundings);

/// Throws Error(bad_input) naming a pin that does not hold a point of the cloth.
void refuse_pins_beside(const Scene& scene, const Print& print, const ClothOutline& outline);

/// Throws Error(bad_input) for gravity under which nobody measured a drape on Earth.
void require_gravity_of_earth(const Scene& scene);

/// Oddities of a scene's drape: gravity that is not Earth's, and objects none of which
/// the cloth touches: `least_gap_m` of any point, absent without objects, above the mesh's spacing.
[[nodiscard]] std::vector<std::string> warnings_of_scene(const Scene& scene,
                                                         std::optional<double> least_gap_m,
                                                         double spacing_m);

}  // namespace drape::simulate
