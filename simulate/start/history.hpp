// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "simulate/fabric/memory.hpp"

namespace drape::simulate {

/// One thing that a cloth goes through, as a text of `start.history` in scene.toml.
struct PastEvent {
  enum class Kind {
    flat,    ///< "flat": pressed flat, so that it forgets what was before
    bent,    ///< "bent 1.5 per cm along warp": the whole cloth, then flat
    draped,  ///< "draped 3 times": from the scene's start to rest, and laid flat
    shaken,  ///< "shaken 5 times by 40 %": gravity grows and shrinks, last of all, once it rests
  };
  Kind kind = Kind::flat;
  int direction = 0;           ///< direction of `bent`: 0 warp, 1 weft
  double curvature_per_m = 0;  ///< curvature of `bent`; above 0: towards the printed side
  int times = 0;               ///< repetitions of `draped` and `shaken`
  double part = 0.5;           ///< share of gravity, of `shaken`
};

/// Throws Error(bad_input) for a text that is none, values that no cloth survives, and `shaken`
/// anywhere but in the end.
[[nodiscard]] std::vector<PastEvent> history_of(const Scene& scene);

/// The shakes of a history, or none (times 0).
[[nodiscard]] PastEvent shakes_of(const std::vector<PastEvent>& history);

/// A warning: drape `number` of a history did not rest, and what is reported is that one.
[[nodiscard]] std::string not_at_rest_before(int number);

/// Drapes a cloth with that memory once; its memory at rest, or nothing where it does not rest.
using DrapeOnce = std::function<std::optional<ClothMemory>(const ClothMemory& memory)>;

/// Memory of a cloth without slips (`fresh`) when the drape begins; nothing where one of the
/// drapes before did not come to rest.
[[nodiscard]] std::optional<ClothMemory> memory_after(const std::vector<PastEvent>& history,
                                                      const ClothFriction& friction,
                                                      ClothMemory fresh, const DrapeOnce& drape);

}  // namespace drape::simulate
