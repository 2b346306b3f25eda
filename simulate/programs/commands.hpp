// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::simulate {

// Commands of drape-simulate outside main.cpp. Each parses its own command line and returns the
// exit code.
int cusick_command(int argc, char** argv);
int fabric_command(int argc, char** argv);

}  // namespace drape::simulate
