// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// Ending of a triangulation: verdict, figures, gaps by reason.
[[nodiscard]] Ending ending_of(const TriangulateResult& result, const TriangulateOptions& options,
                               const std::filesystem::path& out);

/// Records which scene was used, with its table and objects, and the laying if it has a name. The
/// hash is that of the bytes that were read.
void note_scene(MeasuredSource& source, const Scene& scene, const RepeatId& repeat);

}  // namespace drape::triangulate
