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
  double ink = 1;  ///< +1 prints, -1 takes the print of a disc or area below away
};

/// All that is printed on a cloth or a calibration target.
struct Face {
  std::vector<FaceDisc> discs;  ///< dots, then light centres on them
  /// Black of a plate or squares of a board, then the modules of each tag; below the discs.
  std::vector<std::vector<FaceBox>> areas;
};

/// Throw Error(bad_input) where the print's tag family is not known or has no such tag.
[[nodiscard]] Face face_of(const Print& print);
[[nodiscard]] Face face_of(const Target& target);

/// The place of a mark, or of a tag's middle, on the face.
[[nodiscard]] FacePoint face_point(const Print& print, MarkId mark);
[[nodiscard]] FacePoint face_point(const Print& print, const PrintedTag& tag);
[[nodiscard]] FacePoint face_point(const Target& target, MarkId mark);
[[nodiscard]] FacePoint face_point(const Target& target, const PrintedTag& tag);

}  // namespace drape
