// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "compare/store/store.hpp"
#include "core/pose.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// How a mark moved between two calibrations, beyond the motion of the whole sheet.
struct MarkMove {
  MarkId mark;
  Eigen::Vector3d by_m;           ///< second less first, rigid part taken out
  Eigen::Matrix3d covariance_m2;  ///< of the difference
  double chi2 = 0;

  [[nodiscard]] bool moved(std::size_t marks) const;
};

/// Noise that two measurements of one set have in common.
struct SharedNoise {
  bool detections = false;   ///< the same marks in the same pictures
  bool calibrating = false;  ///< both calibrations are of the same pictures
};

/// Moves of the marks that both sheets have. The covariance of a difference leaves out what both
/// have in common: with the same detections only the calibrations' shares of both covariances
/// count (the whole sheet's share, of its error budget); where these rest on the same pictures
/// too, the difference of the two shares (Hausman 1978), for the worse estimate errs by what the
/// better one does and by more. Without a budget the whole covariances count. A mark moved where
/// chi square with three degrees of freedom exceeds its upper 5 % over all marks (Bonferroni).
struct SheetMoves {
  Pose<void, void> rigid;
  std::vector<MarkMove> marks;
};
/// Throws Error(bad_input) below three marks in common.
[[nodiscard]] SheetMoves moves_between(const Sheet& first, const Sheet& second,
                                       const SharedNoise& shared);

/// Moves of the marks of every set that two runs measured in the same pictures. Sheets are found by
/// the store, also where a later run wrote over them. Throws Error(usage) for a number that no run
/// has or runs without a set in common; Error(bad_input) where a sheet is gone.
struct MovedMarks {
  std::string sentence;
  Table sets, marks;
};
[[nodiscard]] MovedMarks moved_marks(const StoreReader& store, int first, int second);

}  // namespace drape::compare
