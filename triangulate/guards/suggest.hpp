// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "triangulate/guards/object_fit.hpp"

namespace drape::triangulate {

/// An object that passes the tests failed by the stated one.
struct SuggestedObject {
  Obstacle object;   ///< with the values printed in the text
  std::string text;  ///< "yaw_deg = 20.0 (with the other sign)"
  /// Expanded uncertainty (k = 2) of each fitted value, over all passing objects with equal weight.
  Change within = Change::Zero();
};

/// Suggestion for a contradicted object, or the reason why there is none.
struct ObjectSuggestion {
  std::optional<SuggestedObject> one;
  std::string why_not;
};

/// Tries typing errors (signs, axes, units, radius for diameter, a corner for the centre), then
/// fits place and rotation from many starts, then size as well, each by the tests that the stated
/// object failed. All passing objects must form one connected range, which is sampled by a random
/// walk (hit-and-run, Smith 1984). If two separate ranges pass, nothing is suggested unless only
/// one contains a typing error.
[[nodiscard]] ObjectSuggestion suggested_object(const SeenCloth& seen, const Scene& scene,
                                                std::size_t object);

}  // namespace drape::triangulate
