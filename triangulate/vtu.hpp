// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace drape::triangulate {

/// Points and point data of a VTK XML unstructured grid, as columns: the points are X_mm, Y_mm and
/// Z_mm, an array of several components has NAME_0, NAME_1, ... Arrays may be ASCII, base64 or raw
/// appended, whole or compressed by zlib, of either byte order. Throws Error(bad_input).
[[nodiscard]] std::vector<std::pair<std::string, std::vector<double>>> vtu_columns(
    const std::filesystem::path& file);

}  // namespace drape::triangulate
