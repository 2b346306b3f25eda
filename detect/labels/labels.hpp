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
using LatticePiece = std::map<MarkId, std::size_t>;  ///< position in the piece -> index of the dot

/// Grows pieces from the dots that are not `taken`, without tags or labels. A piece starts at a dot
/// whose neighbours lie where its own ellipse predicts them; each clear step must agree with all
/// neighbours already in the piece. Largest piece first; pieces with fewer than four dots are
/// dropped.
[[nodiscard]] std::vector<LatticePiece> grow_pieces(const PrintPlane& plane,
                                                    const std::vector<UnlabelledDot>& dots,
                                                    const std::vector<char>& taken);

/// Extends a piece of a flat, stiff print across holes: the homography through its dots predicts
/// the positions of the others, up to a fifth of a pitch for lens distortion.
void fill_flat_piece(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                     LatticePiece& piece);

/// Locates a piece by the classes of its dots, unique in every 3 x 3 window: at the only position
/// where they agree. nullopt if too few dots show their class or two positions match nearly as
/// well. If few dots of the print have a light centre, the piece must show all of them. Drops dots
/// that disagree.
[[nodiscard]] std::optional<LatticePiece> place_by_classes(const PrintPlane& plane,
                                                           const std::vector<UnlabelledDot>& dots,
                                                           const LatticePiece& piece);

/// Locates a piece that spans the whole print, up to the print's own symmetry: half a turn, or
/// quarter turns if rows equal columns. Chooses the orientation whose columns run to the right in
/// the picture. nullopt for a piece that could also lie elsewhere on the print.
[[nodiscard]] std::optional<LatticePiece> place_whole_piece(const PrintPlane& plane,
                                                            const std::vector<UnlabelledDot>& dots,
                                                            const LatticePiece& piece);

/// Finds dots of a plate more than a quarter of a pitch from the position interpolated from both
/// sides, or else extrapolated from two dots on one side: no lens distorts a plate that much.
[[nodiscard]] std::vector<std::size_t> off_the_plate(const std::vector<UnlabelledDot>& dots,
                                                     const LatticePiece& labelled);

/// Label of a dot, or the reason why it has none; both for a label that was
/// withdrawn.
struct DotLabel {
  std::optional<MarkId> mark;
  std::string reason;  ///< empty if the label is valid
};

/// Labels dots, best match first, from adjacent tags and from labelled neighbours. A step is
/// accepted only if it satisfies the trapezoidal rule with both local maps and no other dot matches
/// nearly as well. A label must agree with labelled neighbours and with the tags present or absent
/// around it. The result is in the order of `dots`.
[[nodiscard]] std::vector<DotLabel> label_dots(const PrintPlane& plane,
                                               const std::vector<TagDetection>& tags,
                                               const std::vector<UnlabelledDot>& dots,
                                               const DarkMap& map);

}  // namespace drape::detect
