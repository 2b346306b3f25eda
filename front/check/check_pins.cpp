// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Core>

#include "core/units.hpp"
#include "front/check/check.hpp"

namespace drape {

using units::mm;

namespace {

/// Two pins farther apart in space than the cloth between them is long along its threads; a cloth
/// that is sheared reaches as far as that, and no farther.
void check_apart(const Scene& scene, const Print& print, BenchCheck& check) {
  constexpr double kMostStretch = 0.03;  // as of a clamped edge
  constexpr double kWritten_m = 1e-3;    // two places written to a whole millimetre
  for (std::size_t k = 0; k < scene.pins.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i) {
      const Pin &one = scene.pins[i], &other = scene.pins[k];
      if (!one.point_in_world || !other.point_in_world) continue;
      const double threads_m = (other.material_m(print) - one.material_m(print)).cwiseAbs().sum();
      const double apart_m = (*other.point_in_world - *one.point_in_world).norm();
      if (apart_m <= (1 + kMostStretch) * threads_m + kWritten_m) continue;
      add(check, scene.file, "pin.at_mm",
          fmt::format("pins {} and {} are {:.4g} mm apart in space, on the cloth {:.4g} mm along "
                      "its threads",
                      i + 1, k + 1, apart_m / mm, threads_m / mm),
          "is a place wrong, or a mark's row or column exchanged?", k);
    }
  }
}

}  // namespace

void check_pins(const Scene& scene, const Print* print, BenchCheck& check) {
  if (print == nullptr) return;
  for (std::size_t i = 0; i < scene.pins.size(); ++i) {
    const Pin& pin = scene.pins[i];
    if (pin.at_material_m) {
      const Eigen::Vector2d at = *pin.at_material_m;
      if (at.minCoeff() >= 0 && (print->patch_m - at).minCoeff() >= 0) continue;
      add(check, scene.file, "pin.at_material_mm",
          fmt::format("pin {} is at ({:g}, {:g}) mm, the patch is {:g} x {:g} mm", i + 1,
                      at.x() / mm, at.y() / mm, print->patch_m.x() / mm, print->patch_m.y() / mm),
          "count along warp and weft from the corner beside mark (0, 0)", i);
    } else if (pin.mark.row < 0 || pin.mark.row >= print->rows || pin.mark.col < 0 ||
               pin.mark.col >= print->cols) {
      add(check, scene.file, "pin.row",
          fmt::format("pin {} holds mark ({}, {}), the print has {} x {} marks", i + 1,
                      pin.mark.row, pin.mark.col, print->rows, print->cols),
          "rows and columns count from 0", i);
    }
  }
  check_apart(scene, *print, check);
}

}  // namespace drape
