// SPDX-License-Identifier: Apache-2.0
#include "capture/commands.hpp"
#include "core/program/program.hpp"

int main(int argc, char** argv) {
  using namespace drape::capture;
  return drape::run_stage(
      argc, argv, capture_command,
      {{"import", import_command, "makes a recording from other images"},
       {"verify", verify_command, "checks that every image is as recorded"},
       {"cameras", cameras_command, "lists the cameras that answer"},
       {"doctor", doctor_command, "checks whether the bench is fit to measure"}});
}
