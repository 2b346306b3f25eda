// SPDX-License-Identifier: Apache-2.0
#include "capture/commands.hpp"
#include "core/program/program.hpp"

int main(int argc, char** argv) {
  using namespace drape::capture;
  return drape::run_stage(argc, argv, capture_command,
                          {{"import", import_command, "images from elsewhere to a recording"},
                           {"verify", verify_command, "is every image as it was recorded?"},
                           {"cameras", cameras_command, "lists the cameras that answer"},
                           {"doctor", doctor_command, "is the bench fit to measure?"}});
}
