// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/calib.hpp"
#include "core/program.hpp"
#include "core/run_record.hpp"

namespace drape {

/// Options of both methods on the command line.
void add_options(CLI::App& app, CalibOptions& options);

/// The same into the run record.
void note_options(RunRecord& record, const CalibOptions& options, const std::string& method);

}  // namespace drape
