// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "core/fields/fields.hpp"
#include "core/rig.hpp"
#include "detect/prints/page.hpp"

namespace drape::detect {

/// Paper that a print is laid out on: the first of a4 and a3 that holds it, one of these, or as
/// large as the print needs, for textile printers. Sheets are turned to fit.
enum class Paper { automatic, a4, a3, letter, fit };

struct PrintedPage {
  Page page;
  std::string paper;        ///< chosen, with its direction
  Eigen::Vector2d check_m;  ///< to be measured on the paper: along a row, a column
  std::string check_text;   ///< lengths, and their ends
  Eigen::Vector2d face_m;   ///< origin of the face (core/prints) on the page
};

/// Advice on printing a page at its size, and on correcting its description where it has not.
[[nodiscard]] std::string printing_advice(const std::filesystem::path& description);

/// Throws Error(bad_input) naming two windows of 3 x 3 dots that look alike.
void check_windows(const DotClasses& classes);

/// The cloth's print as seen from its printed side, row 0 on top: dots, tags, corners of the patch,
/// ruler and check length. Throws Error(bad_input) when the paper is too small (naming the
/// size that is needed), a dot lies across the patch's edge, a tag reaches into a dot, or the
/// family has no such tag.
[[nodiscard]] PrintedPage page_of(const Print& print, Paper paper);

/// The calibration target, dots, chessboard, ChArUco board or AprilGrid, as seen from its printed
/// face, y up. Throws Error(bad_input) as above.
[[nodiscard]] PrintedPage page_of(const Target& target, const std::string& name, Paper paper);

/// A square sheet of dots with tags that lies on a box's top or carries a sphere, as large as asked
/// (metres), half a pitch of white around the dots. Its four tags, `first_id` to `first_id` + 3,
/// lie in the corner cells. Throws Error(usage) for less than 45 mm.
[[nodiscard]] Target object_plate(double size_m, int first_id);

/// The plate's description, as read_target() reads it.
[[nodiscard]] std::string object_plate_toml(const Target& plate);

/// Throws Error(bad_input) where `file` is there and is not, byte for byte, what the run that
/// `record` tells of wrote: the target of a rig, or a description that was corrected since.
void require_replaceable_plate(const std::filesystem::path& file,
                               const std::filesystem::path& record);

}  // namespace drape::detect

namespace drape {
template <>
inline constexpr std::string_view names_of<detect::Paper>[] = {"auto", "a4", "a3", "letter", "fit"};
}  // namespace drape
