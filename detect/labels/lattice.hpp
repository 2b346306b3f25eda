// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <vector>

#include "core/marks.hpp"
#include "detect/dots/local_map.hpp"
#include "detect/labels/print_plane.hpp"

namespace drape::detect {

/// From a mark to those beside it.
inline constexpr std::array<MarkId, 4> neighbours = {{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};

/// A proposal that a dot is a mark of the print, or a place in a piece of it.
struct DotProposal {
  double error = 0;  ///< error of the step that led to it
  MarkId mark;
  std::size_t dot = 0;
  LocalMap map;
};
struct LaterProposal {
  bool operator()(const DotProposal& a, const DotProposal& b) const {
    return std::tie(a.error, a.mark, a.dot) > std::tie(b.error, b.mark, b.dot);
  }
};
/// Proposals, the best first.
using DotProposals = std::priority_queue<DotProposal, std::vector<DotProposal>, LaterProposal>;

/// Dots that stand as a piece of the print's lattice. Rows and columns count from 0 in the piece
/// and are right up to a shift and quarter turns; they are never mirrored, since only one side of a
/// print can be seen.
using LatticePiece = std::map<MarkId, std::size_t>;  ///< place in the piece -> index of the dot

/// Grows pieces from the dots that are not `taken`, with neither tags nor labels: a dot whose
/// neighbours stand where its own ellipse says that they must is a start, and each clear step from
/// it must agree with all neighbours that the piece already has. Largest piece first; pieces of
/// fewer than four dots are left out.
[[nodiscard]] std::vector<LatticePiece> grow_pieces(const PrintPlane& plane,
                                                    const std::vector<UnlabelledDot>& dots,
                                                    const std::vector<char>& taken);

/// A piece of a print that is flat and stiff reaches over holes: the plane's projective map through
/// its dots says where the others must be. Lens distortion may move them by a fifth of a pitch.
void fill_flat_piece(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                     LatticePiece& piece);

/// Places a piece by two looks of dots that make every window of 3 x 3 unique: at the only place
/// where the classes of its dots agree. Empty when too few dots show their class or two places fit
/// nearly as well. Where only some dots of the print have a light centre, it is the one place at
/// which the piece shows all of them. Dots that disagree there are left out.
[[nodiscard]] std::optional<LatticePiece> place_by_classes(const PrintPlane& plane,
                                                           const std::vector<UnlabelledDot>& dots,
                                                           const LatticePiece& piece);

/// A piece that spans the whole print has only the print's own symmetry left: half a turn, or
/// quarter turns for as many rows as columns. Of these the one is taken whose columns run to the
/// right in the picture. Nothing for a piece that could also lie elsewhere on the print.
[[nodiscard]] std::optional<LatticePiece> place_whole_piece(const PrintPlane& plane,
                                                            const std::vector<UnlabelledDot>& dots,
                                                            const LatticePiece& piece);

/// Dots of a plate that lie off the places that those on both sides of them, or else the two next
/// on one side, let one expect by more than a quarter of a pitch: no lens bends a plate so.
[[nodiscard]] std::vector<std::size_t> off_the_plate(const std::vector<UnlabelledDot>& dots,
                                                     const LatticePiece& labelled);

}  // namespace drape::detect
