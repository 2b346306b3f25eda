// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "simulate/checker/mesh_rest.hpp"
#include "simulate/drape/piece.hpp"

namespace drape::simulate {

/// Judgement of the checker on a piece on the scene's objects.
[[nodiscard]] MeshJudgement judge_piece(const PieceDrape& piece, const Scene& scene,
                                        const ClothLaws& laws, double residual_tolerance);

/// Names in the files beside the drape itself.
struct PieceNames {
  std::string scene, fabric;
  Eigen::Vector2d patch_m;           ///< the print's patch, (warp, weft)
  std::optional<std::string> no_go;  ///< reason of the measured sheet that placed it
};

/// Writes piece.ply, its description piece.toml (schema drapebench/mesh/1) for drape compare, and
/// piece.json (schema drapebench/piece/1) into `out`, and books them in the record. GO: at rest,
/// accepted by the checker and placed by no sheet that is NO-GO.
[[nodiscard]] Ending write_piece(const std::filesystem::path& out, const PieceNames& names,
                                 const PieceDrape& piece,
                                 const std::optional<MeshJudgement>& judgement, RunRecord& record);

}  // namespace drape::simulate
