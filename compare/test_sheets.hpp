// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "compare/compare.hpp"
#include "core/sheet.hpp"

namespace drape::compare::test {

/// A shape over material coordinates (warp, weft), metres.
using Shape = std::function<Eigen::Vector3d(const Eigen::Vector2d&)>;

/// Flat in the plane z = 0: x along the weft, y against the warp, printed side up.
[[nodiscard]] Eigen::Vector3d flat(const Eigen::Vector2d& material_m);

/// 11x11 marks, pitch 20 mm, margin 10 mm, on a 220 mm patch; covariance (0.03 mm)^2 I.
[[nodiscard]] Sheet measured_sheet(const Shape& shape = flat);

/// n x n particles over the whole patch, at rest.
[[nodiscard]] Sheet simulated_sheet(int n, int segments, const Shape& shape = flat);

/// Writes the sheet to folder/name and gives what read_session would: with its hashes.
[[nodiscard]] SheetFile file_of(const Sheet& sheet);
[[nodiscard]] DrapeInput drape_of(const Sheet& measured, const std::vector<Sheet>& simulated);

/// A measured sheet at <folder>/sheet.ply with two gaps and simulations 11-1, 11-5, 21-1, 21-5 in
/// <folder>/simulations/, each with certificate.json and history.csv. Returns all sheet files.
[[nodiscard]] std::vector<std::filesystem::path> write_example(const std::filesystem::path& folder);

/// The same, with what stands behind it in a real run: photographs, recording.json, a scene, a
/// fabric with a curve, and run records of the steps that made detections and sheets.
[[nodiscard]] std::vector<std::filesystem::path> write_recorded_example(
    const std::filesystem::path& folder);

}  // namespace drape::compare::test
