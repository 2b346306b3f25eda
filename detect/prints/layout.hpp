// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/rig.hpp"

namespace drape::detect {

/// A filled circle on a page. Positions are from the upper left corner, x right, y down, metres.
struct PageDisc {
  Eigen::Vector2d centre_m;
  double radius_m = 0;
  bool dark = true;
};

struct PageBox {
  Eigen::Vector2d corner_m;  ///< upper left corner
  Eigen::Vector2d size_m;
};

/// Adjacent black boxes, filled as one shape to avoid visible seams.
struct PageArea {
  std::vector<PageBox> boxes;
};

/// A line of ASCII text.
struct PageText {
  Eigen::Vector2d baseline_m;  ///< left end of the baseline
  double height_m = 0;         ///< font size
  std::string text;
};

/// One sheet of paper at true size.
struct Page {
  Eigen::Vector2d size_m;
  std::string title;
  std::vector<std::variant<PageDisc, PageArea, PageText>> items;  ///< in painting order
};

/// PDF 1.4 with vector shapes only and coordinates to 0.1 um; tells viewers not to scale it.
/// Deterministic.
[[nodiscard]] std::string pdf_of(const Page& page);

/// SVG 1.1 in millimetres, otherwise like pdf_of().
[[nodiscard]] std::string svg_of(const Page& page);

/// Paper for a print: the smaller of a4 and a3 that holds it, a given size, or a page as large as
/// the print, for textile printers. Sheets are turned if necessary.
enum class Paper { automatic, a4, a3, letter, fit };

struct PrintedPage {
  Page page;
  std::string paper;        ///< chosen paper with orientation
  Eigen::Vector2d check_m;  ///< lengths to be checked on the paper: along a row, a column
  std::string check_text;   ///< these lengths and their end points
  Eigen::Vector2d face_m;   ///< origin of the face (core/prints) on the page
};

/// Advice on printing a page at true size, and on correcting its description if it is not.
[[nodiscard]] std::string printing_advice(const std::filesystem::path& description);

/// Throws Error(bad_input) naming two identical windows of 3 x 3 dots.
void check_windows(const DotClasses& classes);

/// Lays out the cloth's print as seen from its printed side, row 0 on top: dots, tags, corners of
/// the patch, ruler and check length. Throws Error(bad_input) if the paper is too small (names the
/// size needed), a dot crosses the edge of the patch, a tag overlaps a dot, or the family lacks a
/// tag.
[[nodiscard]] PrintedPage page_of(const Print& print, Paper paper);

/// Lays out the calibration target, dots, chessboard, ChArUco board or AprilGrid, as seen from its
/// printed face, y up. Throws Error(bad_input) as above.
[[nodiscard]] PrintedPage page_of(const Target& target, const std::string& name, Paper paper);

/// Makes a square sheet of dots with tags that lies on a box or carries a sphere, of the requested
/// size (metres) including half a pitch of white margin. Its four tags, `first_id` to `first_id` +
/// 3, lie in the corner cells. Throws Error(usage) below 45 mm.
[[nodiscard]] Target object_plate(double size_m, int first_id);

/// Description of the plate in the format of read_target().
[[nodiscard]] std::string object_plate_toml(const Target& plate);

}  // namespace drape::detect

template <>
inline constexpr std::string_view drape::names_of<drape::detect::Paper>[] = {"auto", "a4", "a3",
                                                                             "letter", "fit"};
