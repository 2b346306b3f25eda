// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/program/program.hpp"
#include "front/plan.hpp"

namespace drape {

/// `drape run`: runs every stage in order, skipping steps that are up to date. Returns the exit
/// code: 0 GO, 1 if a stage's verdict is NO-GO, else that of the stage that failed.
[[nodiscard]] int run_bench(const RunOptions& options, const CommonOptions& common);

}  // namespace drape
