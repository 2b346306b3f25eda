// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/start_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {
namespace {

using units::mm;

constexpr double kAtHem_m = 1e-6;    // a pin this close to the hem counts as on it
constexpr double kWritten_m = 1e-3;  // rounding of positions given in whole millimetres

/// Largest depth of a start laid on an object: woven cloth is thinner (KES-FB-3 at 0.5
/// gf/cm2).
constexpr double kThickest_m = 1e-3;

double deepest_m(const std::vector<Eigen::Vector3d>& places_in_world,
                 const Surroundings& surroundings, double raised_m) {
  double deepest = 0;
  for (const Eigen::Vector3d& place : places_in_world)
    for (int shape = 0; shape < surroundings.count(); ++shape)
      deepest =
          std::max(deepest, -surroundings.gap_m(shape, place + Eigen::Vector3d(0, 0, raised_m)));
  return deepest;
}

/// True if a point is inside an object near a downward-facing surface, as if laid on it from below.
bool is_below_an_object(const std::vector<Eigen::Vector3d>& places_in_world,
                        const Surroundings& surroundings) {
  constexpr double kRounded_m = 1e-6, kDown = -1e-3;
  for (const Eigen::Vector3d& place : places_in_world)
    for (int shape = 0; shape < surroundings.count(); ++shape)
      if (surroundings.gap_m(shape, place) < -kRounded_m &&
          surroundings.normal(shape, place).z() < kDown)
        return true;
  return false;
}

}  // namespace

void refuse_inside(const Scene& scene, const std::vector<Eigen::Vector3d>& places_in_world,
                   const Surroundings& surroundings) {
  const double deep_m = deepest_m(places_in_world, surroundings, 0);
  if (deep_m <= kThickest_m && !is_below_an_object(places_in_world, surroundings)) return;
  constexpr double kHighest_m = 10, kFirst_m = 1e-3;
  double raised_m = kFirst_m;
  while (raised_m < kHighest_m && deepest_m(places_in_world, surroundings, raised_m) > 0)
    raised_m += std::max(kFirst_m, deepest_m(places_in_world, surroundings, raised_m));
  throw bad_input(
      fmt::format("the flat start lies inside an object or below the table, by up to {:.3g} mm",
                  deep_m / mm),
      {.file = scene.file.string(), .field = "start.centre_mm"},
      fmt::format("its height must be some {:.3g} mm more; are its numbers millimetres?",
                  raised_m / mm));
}

void refuse_flat_start_inside(const Scene& scene, const Print& print, const ClothOutline& outline,
                              const Surroundings& surroundings) {
  if (scene.start.mode != StartMode::flat) return;
  require_sized(print, scene);
  constexpr int kPlaces = 110;  // along each side; closer than half of a small object
  const FlatPose flat{scene.start.centre_in_world.value_or(Eigen::Vector3d::Zero()),
                      scene.start.yaw_rad};
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i <= kPlaces; ++i) {
    for (int k = 0; k <= kPlaces; ++k) {
      const Eigen::Vector2d at =
          print.patch_m.cwiseProduct(Eigen::Vector2d(i, k) / double{kPlaces});
      if (is_on(outline, at, kAtHem_m)) places.push_back(flat.point_in_world(at, print.patch_m));
    }
  }
  refuse_inside(scene, places, surroundings);
}

void refuse_pins_beside(const Scene& scene, const Print& print, const ClothOutline& outline) {
  for (const Pin& pin : scene.pins) {
    const Eigen::Vector2d at = pin.material_m(print);
    if (is_on(outline, at, kAtHem_m)) continue;
    throw bad_input(fmt::format("the pin at warp {:g}, weft {:g} mm is not on the cloth",
                                at.x() / mm, at.y() / mm),
                    {.file = scene.file.string(), .field = "pin"},
                    "pin a point inside the outline");
  }
}

void require_gravity_of_earth(const Scene& scene) {
  if (is_gravity_of_earth(scene)) return;
  throw bad_input(fmt::format("a real drape was measured under gravity of 9.76 to 9.84 m/s2, the "
                              "scene has {:g}",
                              scene.gravity_m_per_s2.norm()),
                  {.file = scene.file.string(), .field = "gravity_m_per_s2"},
                  "leave it out, or give [0, 0, -9.80665]");
}

std::vector<std::string> warnings_of_scene(const Scene& scene, std::optional<double> least_gap_m,
                                           double spacing_m) {
  std::vector<std::string> warnings;
  if (!is_gravity_of_earth(scene))
    warnings.push_back(fmt::format("gravity of {:g} m/s2 is not Earth's, of 9.76 to 9.84",
                                   scene.gravity_m_per_s2.norm()));
  if (least_gap_m && *least_gap_m > spacing_m)
    warnings.push_back(
        fmt::format("the cloth touches none of the scene's objects: the nearest is {:.1f} mm away",
                    *least_gap_m / units::mm));
  return warnings;
}

void check_pins(const Scene& scene, const Print& print, const Fabric& fabric) {
  for (std::size_t i = 0; i < scene.pins.size(); ++i) {
    for (std::size_t k = i + 1; k < scene.pins.size(); ++k) {
      const Pin &one = scene.pins[i], &other = scene.pins[k];
      if (!one.point_in_world || !other.point_in_world) continue;
      const Eigen::Vector2d between = (other.material_m(print) - one.material_m(print)).cwiseAbs();
      const double apart_m = (*other.point_in_world - *one.point_in_world).norm();
      const double reach_m = between.x() * (1 + fabric.tensile[0].x.back()) +
                             between.y() * (1 + fabric.tensile[1].x.back());
      if (apart_m <= reach_m + kWritten_m) continue;
      throw bad_input(
          fmt::format("pins {} and {} are {:.4g} mm apart in space; the cloth between them, {:.4g} "
                      "mm along its threads, was measured to stretch to {:.4g} mm",
                      i + 1, k + 1, apart_m / mm, between.sum() / mm, reach_m / mm),
          {.file = scene.file.string(), .field = "pin"},
          "is a place wrong, or a mark's row or column exchanged?");
    }
  }
}

}  // namespace drape::simulate
