// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "compare/hems/repeats.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// A sheet of repeats and its name for people.
struct NamedSheet {
  std::string name;
  Sheet sheet;
};

struct MarkRepeats {
  int marks = 0;  ///< that every repeat has
  /// Root mean square distance of the marks of two repeats, in the world of the bench: nothing is
  /// turned or moved.
  std::vector<std::vector<double>> real_to_real_m;
  struct Match {
    std::string name;
    int marks = 0;                    ///< of those, that the virtual sheet has or interpolates
    std::vector<double> distances_m;  ///< to each repeat
    Judgement judgement;
    std::string verdict;  ///< inside, outside or undecided
    std::string reason;   ///< of undecided; else empty
  };
  std::vector<Match> matches;
};

/// Is each virtual sheet inside the repeats of the real one, mark by mark? A virtual sheet is taken
/// at the material points of the marks, bilinear between its particles. With fewer than three
/// repeats the verdict is undecided, because nothing says how far repeats lie apart. Throws
/// Error(bad_input) when the repeats have no mark in common.
[[nodiscard]] MarkRepeats mark_repeats(const std::vector<NamedSheet>& repeats,
                                       const std::vector<NamedSheet>& virtual_sheets,
                                       double significance);

}  // namespace drape::compare
