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

constexpr double ms = 1e-3;      // s
constexpr int kMostStarts = 99;  // two digits in the files' names

/// What `drape simulate cusick` was asked for, in people's units.
struct CusickArguments {
  std::filesystem::path fabric, out;
  double disc_mm = 180, specimen_mm = 300, spacing_mm = 7.5, warp_deg = 0;
  int starts = 1, most_steps = DescentOptions{}.most_steps;
  bool internal_friction = false;
  int lowering_steps = CusickOptions{}.lowering_steps, shakes = 0;
  double lowering_s = CusickOptions{}.lowering_s, step_ms = TimeStepsOptions{}.step_s / ms;
  double laid_coarser = CusickOptions{}.laid_coarser;
  double shake_percent = 50;
};
/// Throws Error(usage) where an option would change nothing, or a file of the fabric would be
/// written over.
void check(const CusickArguments& arguments);
[[nodiscard]] CusickOptions options_of(const CusickArguments& arguments, unsigned start);

/// A drape and what the checker says of it; nothing of one that is not at rest.
struct JudgedDrape {
  CusickDrape drape;
  std::optional<MeshJudgement> judgement;

  [[nodiscard]] bool go() const { return judgement && judgement->accepted(); }
};

/// Drapes a specimen and puts what rests before the checker.
[[nodiscard]] JudgedDrape judged_drape(const ClothLaws& laws, const CusickOptions& options);

/// Writes start-NN.ply and cusick.json (schema drapebench/cusick/1) into `out`, where no drape of
/// an earlier run remains, books them in the record, and says how many drapes the checker takes for
/// rests.
[[nodiscard]] Ending write_cusick(const CusickArguments& arguments, const std::string& fabric,
                                  const std::vector<JudgedDrape>& drapes, RunRecord& record);

}  // namespace drape::simulate
