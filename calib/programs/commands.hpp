// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::calib {

// The commands of drape-calib. Each parses its own command line and returns the exit code.
int calib_command(int argc, char** argv);
int accept_command(int argc, char** argv);
int convert_command(int argc, char** argv);

}  // namespace drape::calib
