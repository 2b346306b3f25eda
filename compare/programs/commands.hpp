// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::compare {

// The commands of drape-compare, each with its own command line; each returns the exit code.
int drapemeter_command(int argc, char** argv);
int repeats_command(int argc, char** argv);

}  // namespace drape::compare
