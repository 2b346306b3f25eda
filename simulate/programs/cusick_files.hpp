// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "simulate/checker/mesh_rest.hpp"
#include "simulate/mesh/cusick.hpp"

namespace drape::simulate {

/// A drape and what the checker says of it; nothing of one that is not at rest.
struct JudgedDrape {
  CusickDrape drape;
  std::optional<MeshJudgement> judgement;

  [[nodiscard]] bool go() const { return judgement && judgement->accepted(); }
};

/// Drapes a specimen and puts what rests before the checker.
[[nodiscard]] JudgedDrape judged_drape(const ClothLaws& laws, const CusickOptions& options);

/// Writes start-NN.ply and cusick.json (schema drapebench/cusick/1) into `out`, books them in the
/// record, and says how many drapes the checker takes for rests.
[[nodiscard]] Ending write_cusick(const std::filesystem::path& out, const std::string& fabric,
                                  const std::vector<JudgedDrape>& drapes, RunRecord& record);

}  // namespace drape::simulate
