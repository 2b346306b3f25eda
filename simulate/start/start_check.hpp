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
/// them can reach, along its threads, each stretched to the end of its measured curve.
void check_pins(const Scene& scene, const Print& print, const Fabric& fabric);

/// Throws Error(bad_input) naming `start.centre_mm` and the required increase of height if a point
/// of a flat start is deeper in an object or below the table than cloth is thick: a solver cannot
/// know on which side it should emerge, and cloth that emerges below falls past the object.
void refuse_inside(const Scene& scene, const std::vector<Eigen::Vector3d>& places_in_world,
                   const Surroundings& surroundings);

/// Same, for the scene's own flat start of a cloth; other starts lie outside objects.
void refuse_flat_start_inside(const Scene& scene, const Print& print, const ClothOutline& outline,
                              const Surroundings& surroundings);

/// Throws Error(bad_input) naming a pin that is not on the cloth.
void refuse_pins_beside(const Scene& scene, const Print& print, const ClothOutline& outline);

/// Throws Error(bad_input) unless gravity is that of the Earth.
void require_gravity_of_earth(const Scene& scene);

/// Warnings about a scene's drape: gravity that is not Earth's, and cloth that touches no object:
/// `least_gap_m`, its smallest distance (absent without objects), exceeds the mesh spacing.
[[nodiscard]] std::vector<std::string> warnings_of_scene(const Scene& scene,
                                                         std::optional<double> least_gap_m,
                                                         double spacing_m);

}  // namespace drape::simulate
