// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::capture {

// The commands of drape-capture, each with a command line of its own; each returns the exit code.
int capture_command(int argc, char** argv);
int import_command(int argc, char** argv);
int verify_command(int argc, char** argv);
int cameras_command(int argc, char** argv);
int doctor_command(int argc, char** argv);

}  // namespace drape::capture
