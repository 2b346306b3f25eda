// SPDX-License-Identifier: Apache-2.0
#include "calib/programs/commands.hpp"
#include "core/program/program.hpp"

int main(int argc, char** argv) {
  using namespace drape::calib;
  return drape::run_stage(
      argc, argv, calib_command,
      {{"accept", accept_command, "accepts a calibrated rig by what it measures"},
       {"convert", convert_command, "calibrations for other tools, or theirs"}});
}
