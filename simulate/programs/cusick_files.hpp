// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/program/program.hpp"
#include "core/program/run_record.hpp"
#include "simulate/mesh/relaxation.hpp"

namespace drape::simulate {

/// Writes start-NN.ply and cusick.json (schema drapebench/cusick/1) into `out`, books them in the
/// record, and says how many drapes are at rest.
[[nodiscard]] Ending write_cusick(const std::filesystem::path& out, const std::string& fabric,
                                  const std::vector<CusickDrape>& drapes, RunRecord& record);

}  // namespace drape::simulate
