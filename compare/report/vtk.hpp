// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/run_report.hpp"

namespace drape::compare {

/// Geometry of a VTK file: the measured marks, their places on the simulation that speaks for the
/// drape, or a line from each mark to its place.
enum class VtkPart { measured, simulated, distance };
/// VTK XML (.vtp) of the marks that have a distance, millimetres, with the cells of four such marks
/// as faces. Point data: distance_mm (active), sigma_distance_mm, sigma_mm, row, col.
[[nodiscard]] std::string vtp_of(const ReportedDrape& drape, VtkPart part);

}  // namespace drape::compare

template <>
inline constexpr std::string_view drape::names_of<drape::compare::VtkPart>[] = {"real", "virtual",
                                                                                "distance"};
