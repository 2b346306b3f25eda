// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/prints/tag_family.hpp"
#include "core/rig.hpp"

namespace drape {

/// A disc on a printed face.
struct FaceDisc {
  FacePoint centre;
  double radius_m = 0;
  double ink = 1;  ///< +1 prints; -1 erases the print of discs and areas below it
};

/// Everything printed on a cloth or a calibration target.
struct Face {
  std::vector<FaceDisc> discs;  ///< dots first, then the light centres on them
  /// Plate or board squares in black, then the modules of each tag; all below the discs.
  std::vector<std::vector<FaceBox>> areas;
};

/// Throws Error(bad_input) if the print's tag family is unknown or lacks one of its tags.
[[nodiscard]] Face face_of(const Print& print);
[[nodiscard]] Face face_of(const Target& target);

/// Position of a mark, or of a tag's centre, on the face.
[[nodiscard]] FacePoint face_point(const Print& print, MarkId mark);
[[nodiscard]] FacePoint face_point(const Print& print, const PrintedTag& tag);
[[nodiscard]] FacePoint face_point(const Target& target, MarkId mark);
[[nodiscard]] FacePoint face_point(const Target& target, const PrintedTag& tag);

}  // namespace drape
