// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "triangulate/guards/object_fit.hpp"

namespace drape::triangulate {

/// Another object that passes the guards which the stated one does not.
struct SuggestedObject {
  Obstacle object;   ///< with its values as the text prints them
  std::string text;  ///< "yaw_deg = 20.0 (with the other sign)"
  /// Expanded uncertainty (k = 2) of each fitted value: of all that pass, as likely as each other.
  Change within = Change::Zero();
};

/// Suggestion for an object that is contradicted, or the reason why there is none.
struct ObjectSuggestion {
  std::optional<SuggestedObject> one;
  std::string why_not;
};

/// Tries slips of the pen (signs, axes, units, radius for diameter, a corner for the centre), then
/// fits place and turn from many starts, then size as well, each by the guards that named the
/// stated object. All objects that pass must lie in one range, which a walk samples (hit-and-run,
/// Smith 1984): where two ranges apart from each other pass, none is suggested, but the one that
/// holds the only slip.
[[nodiscard]] ObjectSuggestion suggested_object(const SeenCloth& seen, const Scene& scene,
                                                std::size_t object);

}  // namespace drape::triangulate
