// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"

namespace drape::detect {

/// How large the dots are against what is stated, by length: the fitted ellipse's area over that
/// of a dot where its neighbours lie as they do. A blur of width s takes pi s^2 of the area within
/// any convex outline (s^2 / 2 times its curvature, all around), which is added. Median over the
/// dots between four neighbours, or, below 20 of these, over those with one along each axis;
/// nothing below 20 of them, or for a lattice of corners. Cloth bends between neighbours, so single
/// dots scatter by some 10 %; on bench1 the median is within 0.3 % on cloth and 0.1 % on the
/// target. `blurs_px` are those of `frames`.
[[nodiscard]] std::optional<double> dot_size_ratio(const std::vector<FrameDetections>& frames,
                                                   const std::vector<double>& blurs_px,
                                                   const MarkLattice& lattice);

/// Why the dots cannot have the stated size: off by more than 10 %, where the correction of their
/// shape, which goes with the square, errs by a fifth. Empty when they can. `file` for the
/// sentence.
[[nodiscard]] std::string other_dot_size(const std::optional<double>& ratio,
                                         const MarkLattice& lattice, const std::string& file);

}  // namespace drape::detect
