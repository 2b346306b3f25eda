// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "core/rig.hpp"
#include "detect/prints/page.hpp"

namespace drape::detect {

/// Paper: "a4", "a3", "letter", "fit" (as large as the print needs, for textile printers) or
/// "auto" (the first of a4, a3 that holds it). Sheets are turned to fit.
struct PrintOptions {
  std::string paper = "auto";

  /// Throws Error(usage) for a paper that is not known.
  void check() const;
};

struct PrintedPage {
  Page page;
  std::string paper;                   ///< chosen, with its direction
  Eigen::Vector2d check_m;             ///< to be measured on the paper: along a row, a column
  std::string check_text;              ///< these lengths, and from where to where
  Eigen::Vector2d first_m;             ///< mark (0, 0) on the page
  Eigen::Vector2d by_row_m, by_col_m;  ///< steps to the next mark, of an AprilGrid to the next tag
};

/// How a page comes out at its size, and what to correct in its description where it has not.
[[nodiscard]] std::string printing_advice(const std::filesystem::path& description);

/// Throws Error(bad_input) naming two windows of 3 x 3 dots that look alike.
void check_windows(const DotClasses& classes);

/// The cloth's print as seen from its printed side, row 0 on top: dots, tags, corners of the patch,
/// ruler and check length. Throws Error(bad_input) when the paper is too small (naming the
/// size that is needed), a dot lies across the patch's edge, a tag reaches into a dot, or the
/// family has no such tag.
[[nodiscard]] PrintedPage page_of(const Print& print, const PrintOptions& options);

/// The calibration target, dots, chessboard, ChArUco board or AprilGrid, as seen from its printed
/// face, y up. Throws Error(bad_input) as above.
[[nodiscard]] PrintedPage page_of(const Target& target, const std::string& name,
                                  const PrintOptions& options);

}  // namespace drape::detect
