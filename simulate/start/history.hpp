// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {

/// One event in the history of a cloth, a string of `start.history` in scene.toml.
struct PastEvent {
  enum class Kind {
    flat,    ///< "flat": pressed flat, which erases all earlier history
    bent,    ///< "bent 1.5 per cm along warp": the whole cloth, then flattened
    draped,  ///< "draped 3 times": from the scene's start to rest, then laid flat
    shaken,  ///< "shaken 5 times by 40 %": gravity grows and shrinks at rest; must come last
  };
  Kind kind = Kind::flat;
  int direction = 0;           ///< direction of `bent`: 0 warp, 1 weft
  double curvature_per_m = 0;  ///< curvature of `bent`; positive towards the printed side
  int times = 0;               ///< repetitions of `draped` and `shaken`
  double part = 0.5;           ///< fraction of gravity, for `shaken`
};

/// Parses a history. Throws Error(bad_input) for an unknown text, values that would destroy the
/// cloth, and `shaken` anywhere but at the end.
[[nodiscard]] std::vector<PastEvent> history_of(const Scene& scene);

/// The shaking event of a history; with times 0 if there is none.
[[nodiscard]] PastEvent shakes_of(const std::vector<PastEvent>& history);

/// Warning that drape `number` of a history did not come to rest and is the one reported.
[[nodiscard]] std::string not_at_rest_before(int number);

/// Drapes a cloth with the given friction state once; returns that at rest, nullopt if not at rest.
using DrapeOnce = std::function<std::optional<ClothMemory>(const ClothMemory& memory)>;

/// Friction state at the start of the final drape, from one without slips (`fresh`); nullopt if one
/// of the earlier drapes did not come to rest.
[[nodiscard]] std::optional<ClothMemory> memory_after(const std::vector<PastEvent>& history,
                                                      const ClothFriction& friction,
                                                      ClothMemory fresh, const DrapeOnce& drape);

}  // namespace drape::simulate
