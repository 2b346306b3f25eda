// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/calib.hpp"
#include "calib/joint.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"
#include "core/program/run_record.hpp"

namespace drape::calib {

/// Options of both methods on the command line.
void add_options(Command& app, CalibOptions& options);

/// Those of the joint method alone.
void add_joint_options(Command& app, JointOptions& options);

/// Throws Error(usage) for an option of the joint method beside another one: it would do nothing.
void refuse_joint_options(const Command& app, const std::string& method);

/// The same into the run record.
void note_options(RunRecord& record, const CalibOptions& options, const std::string& method);
void note_joint_options(RunRecord& record, const JointOptions& options);

}  // namespace drape::calib
