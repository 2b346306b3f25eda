// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

/// A particle that a clamp holds.
struct ClampedParticle {
  int particle = 0;
  Eigen::Vector3d place_in_world;
};

/// The clamps of a scene on a particle grid.
struct GridClamps {
  std::vector<ClampedParticle> held;
  std::vector<ClampedPlace> places;  ///< for Cloth::clamp()
  double beside_m = 0;  ///< largest distance of a clamp's line from the row that stands for it
  double ends_m = 0;    ///< largest distance of a clamp's end from the last particle it holds
  /// Largest distance between the places that two clamps give one particle.
  double apart_m = 0;
};

/// The row of particles nearest to each clamp's line stands for it; where it is not on the line it
/// is held in the plane of the clamp, beside the line. Throws Error(bad_input) for a clamp that is
/// not on the cloth, has no length, runs along no thread, or that the cloth leaves along itself.
[[nodiscard]] GridClamps clamps_on(const Scene& scene, const GridSpec& grid);

/// Throws Error(bad_input) where a clamp does not stand on a row of particles, so that the free
/// length would begin beside it, and where two clamps disagree. Returns a warning for each end that
/// lies between particles.
[[nodiscard]] std::vector<std::string> check_clamps(const Scene& scene, const GridSpec& grid);

}  // namespace drape::simulate
