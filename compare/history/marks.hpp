// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "compare/store/store.hpp"
#include "core/pose.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// Movement of a mark between two calibrations, after removing the motion of the whole sheet.
struct MarkMove {
  MarkId mark;
  Eigen::Vector3d by_m;           ///< second minus first, without the rigid part
  Eigen::Matrix3d covariance_m2;  ///< covariance of the difference
  double chi2 = 0;

  [[nodiscard]] bool moved(std::size_t marks) const;
};

/// Noise common to two measurements of one set.
struct SharedNoise {
  bool detections = false;   ///< true for the same marks in the same pictures
  bool calibrating = false;  ///< true if both calibrations use the same pictures
};

/// Movements of the marks present in both sheets. The covariance of a difference excludes what both
/// have in common: with the same detections only the calibrations' parts of both covariances count
/// (the whole sheet's part, from its error budget); if these use the same pictures too, the
/// difference of the two parts counts (Hausman 1978), since the less accurate estimate has the
/// error of the other and more. Without a budget the full covariances count. A mark moved if chi
/// square with three degrees of freedom exceeds its upper 5 % point over all marks (Bonferroni).
struct SheetMoves {
  Pose<void, void> rigid;
  std::vector<MarkMove> marks;
};
/// Throws Error(bad_input) for fewer than three common marks.
[[nodiscard]] SheetMoves moves_between(const Sheet& first, const Sheet& second,
                                       const SharedNoise& shared);

/// Movements of the marks of every set that two runs measured in the same pictures. Sheets are
/// taken from the store, even if a later run replaced their files. Throws Error(usage) for a number
/// that no run has or runs without a common set; Error(bad_input) if a sheet is missing.
struct MovedMarks {
  std::string sentence;
  Table sets, marks;
};
[[nodiscard]] MovedMarks moved_marks(const StoreReader& store, int first, int second);

}  // namespace drape::compare
