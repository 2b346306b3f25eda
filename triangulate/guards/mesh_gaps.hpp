// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::triangulate {

/// Signed distance (m) of each mark from a closed mesh, negative inside. Throws Error(bad_input)
/// for a file that cannot be read or holds no closed mesh.
[[nodiscard]] std::vector<double> gaps_to_mesh(const Sheet& sheet, const MeshObject& object,
                                               int threads);

/// Depth to which a mark may lie in a mesh that is as stated: four values of place and turn, as for
/// a body of known shape, at the upper half per cent of their chi square, and three standard
/// deviations of the mark.
[[nodiscard]] double most_inside_m(const ObjectUncertainty& stated, const SheetMark& mark);

/// Why a mesh, one of the scene's objects, cannot be where and as large as stated; empty: it can.
[[nodiscard]] std::string contradiction_of_mesh(const Sheet& sheet, const std::vector<double>& gaps,
                                                const MeshObject& object,
                                                const ObjectUncertainty& stated);

}  // namespace drape::triangulate
