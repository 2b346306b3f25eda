// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// What the operator reads after a triangulation: verdict, figures, gaps by reason.
[[nodiscard]] Ending ending_of(const TriangulateResult& result, const TriangulateOptions& options,
                               const std::filesystem::path& out);

/// The options that a result rests on, as the run record keeps them.
void note_options(RunRecord& record, const TriangulateOptions& options, const std::string& set);

/// Which laying of which drape a sheet is, where the rig says so ([[repeat]]).
struct RepeatId {
  std::string scene, name, face;  ///< the side of the cloth that lies up; may be empty
};
/// Adds to the source in the sheet's .json which scene the marks were asked about, with its table
/// and objects, and the laying, if it has a name.
void note_scene(const std::filesystem::path& sheet, const Scene& scene, const RepeatId& id);

}  // namespace drape::triangulate
