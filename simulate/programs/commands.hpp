// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::simulate {

// The commands of drape-simulate. Each parses its own command line and returns the exit code.
int branches_command(int argc, char** argv);
int certify_command(int argc, char** argv);
int cusick_command(int argc, char** argv);
int fabric_command(int argc, char** argv);
int sensitivity_command(int argc, char** argv);
int study_command(int argc, char** argv);

}  // namespace drape::simulate
