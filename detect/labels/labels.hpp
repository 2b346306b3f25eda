// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/marks.hpp"
#include "detect/dots/blobs.hpp"
#include "detect/labels/print_plane.hpp"

namespace drape::detect {

/// Dots that form a piece of the print's lattice. Rows and columns start at 0 within the piece and
/// are correct up to a shift and quarter turns, never a reflection, since only one side of a print
/// is visible.
using LatticePiece = std::map<MarkId, std::size_t>;  ///< place in the piece -> index of the dot

/// Grows pieces from the dots that are not `taken`, without tags or labels. A dot whose neighbours
/// are where its own ellipse predicts them is a start; each clear step must agree with all
/// neighbours already in the piece. Largest piece first; pieces with fewer than four dots are
/// dropped.
[[nodiscard]] std::vector<LatticePiece> grow_pieces(const PrintPlane& plane,
                                                    const std::vector<UnlabelledDot>& dots,
                                                    const std::vector<char>& taken);

/// Extends a piece of a flat, stiff print across holes: the homography through its dots predicts
/// the positions of the others, up to a fifth of a pitch for lens distortion.
void fill_flat_piece(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                     LatticePiece& piece);

/// Locates a piece by the classes of its dots, which are unique in every 3 x 3 window: at the only
/// place where they agree. nullopt if too few dots show their class or two places match nearly as
/// well. If few dots of the print have a light centre, the place is the one at which the piece
/// shows all of them. Dots that disagree there are left out.
[[nodiscard]] std::optional<LatticePiece> place_by_classes(const PrintPlane& plane,
                                                           const std::vector<UnlabelledDot>& dots,
                                                           const LatticePiece& piece);

/// Locates a piece that spans the whole print, up to the print's own symmetry: half a turn, or
/// quarter turns if rows equal columns. Of these, the one whose columns run to the right in the
/// picture is chosen. nullopt for a piece that could also lie elsewhere on the print.
[[nodiscard]] std::optional<LatticePiece> place_whole_piece(const PrintPlane& plane,
                                                            const std::vector<UnlabelledDot>& dots,
                                                            const LatticePiece& piece);

/// Dots of a plate more than a quarter of a pitch from the position interpolated from both sides,
/// or else extrapolated from two dots on one side: no lens distorts a plate that much.
[[nodiscard]] std::vector<std::size_t> off_the_plate(const std::vector<UnlabelledDot>& dots,
                                                     const LatticePiece& labelled);

/// Label of a dot, or the reason why it has none. A dot can have both: a label that was withdrawn,
/// and the reason.
struct DotLabel {
  std::optional<MarkId> mark;
  std::string reason;  ///< empty if the label is valid
};

/// Labels dots, best match first, from adjacent tags and from labelled neighbours. A step is
/// accepted only if it satisfies the trapezoidal rule with both local maps and no other dot matches
/// nearly as well; a label must agree with labelled neighbours and with where tags are present or
/// absent around it. The result is in the order of `dots`.
[[nodiscard]] std::vector<DotLabel> label_dots(const PrintPlane& plane,
                                               const std::vector<TagDetection>& tags,
                                               const std::vector<UnlabelledDot>& dots,
                                               const DarkMap& map);

}  // namespace drape::detect
