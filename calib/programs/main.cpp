// SPDX-License-Identifier: Apache-2.0
#include "calib/programs/commands.hpp"
#include "core/program/program.hpp"

int main(int argc, char** argv) {
  using namespace drape::calib;
  return drape::run_stage(
      argc, argv, calib_command,
      {{"accept", accept_command, "tests and accepts a calibrated rig"},
       {"convert", convert_command, "writes calibrations for other tools, or reads theirs"}});
}
