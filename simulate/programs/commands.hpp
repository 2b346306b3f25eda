// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::simulate {

// The commands of drape-simulate, each with a command line of its own; each returns the exit code.
int branches_command(int argc, char** argv);
int certify_command(int argc, char** argv);
int cusick_command(int argc, char** argv);
int fabric_command(int argc, char** argv);
int sensitivity_command(int argc, char** argv);
int study_command(int argc, char** argv);

}  // namespace drape::simulate
