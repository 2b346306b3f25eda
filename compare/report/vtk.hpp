// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/run_report.hpp"

namespace drape::compare {

/// Geometry of a VTK file: measured marks, their positions on the simulation that represents the
/// drape, or a line from each mark to its position.
enum class VtkPart { measured, simulated, distance };
/// VTK XML (.vtp) of the marks with a distance, in millimetres; cells with four such marks are
/// faces. Point data: distance_mm (active), sigma_distance_mm, sigma_mm, row, col.
[[nodiscard]] std::string vtp_of(const ReportedDrape& drape, VtkPart part);

}  // namespace drape::compare

template <>
inline constexpr std::string_view drape::names_of<drape::compare::VtkPart>[] = {"real", "virtual",
                                                                                "distance"};
