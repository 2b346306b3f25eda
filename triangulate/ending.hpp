// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/program/program.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// What the operator reads after a triangulation: verdict, figures, gaps by reason.
[[nodiscard]] Ending ending_of(const TriangulateResult& result, const TriangulateOptions& options,
                               const std::filesystem::path& out);

}  // namespace drape::triangulate
