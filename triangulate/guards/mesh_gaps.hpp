// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::triangulate {

/// Signed distance (m) of each mark from a closed mesh, negative inside. Throws Error(bad_input) if
/// the file cannot be read or is not a closed mesh.
[[nodiscard]] std::vector<double> gaps_to_mesh(const Sheet& sheet, const MeshObject& object,
                                               int threads);

/// Largest penetration of a mark into a correctly stated mesh: 99.5 % quantile of chi square for
/// the four values of place and rotation, as for a body of known shape, plus three standard
/// deviations of the mark.
[[nodiscard]] double most_inside_m(const ObjectUncertainty& stated, const SheetMark& mark);

/// Explains why a mesh object cannot have the stated position and size; empty if it can.
[[nodiscard]] std::string contradiction_of_mesh(const Sheet& sheet, const std::vector<double>& gaps,
                                                const MeshObject& object,
                                                const ObjectUncertainty& stated);

}  // namespace drape::triangulate
