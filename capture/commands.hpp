// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::capture {

// The commands of drape-capture. Each parses its own command line and returns the exit code.
int capture_command(int argc, char** argv);
int import_command(int argc, char** argv);
int verify_command(int argc, char** argv);
int cameras_command(int argc, char** argv);
int doctor_command(int argc, char** argv);

}  // namespace drape::capture
