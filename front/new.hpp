// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/program/program.hpp"

namespace drape {

struct NewRigOptions {
  std::filesystem::path folder;      ///< folder of the new rig; its last part names the rig
  std::vector<std::string> cameras;  ///< names, or just "auto" for all that answer
  std::string size_px = "1600x1200";
  std::vector<std::string> drapes;  ///< NAME=sphere:DIAMETER_MM, NAME=box:EDGE_MM, NAME=hung:MM
  std::vector<double> stage_z_mm = {0, 30, 60, 90};
  std::vector<std::string> stages;  ///< NAME=Z_MM, instead of heights alone
  std::vector<std::string> pins;    ///< DRAPE=WARP_MM,WEFT_MM: held points of the cloth
  int free_poses = 15;
};

void fields(Fields& f, NewRigOptions& options);

/// `drape new`: writes commented files for a new bench to a new folder. Leaves out values that
/// only the operator can measure: the first program to read them reports file and line. Returns
/// the exit code. Throws Error(usage) for an invalid name, size or drape, Error(bad_input) if the
/// folder exists. With "auto", also writes cameras.toml from the output of `drape-capture
/// cameras`; throws Error(device) if it finds nothing, or a camera does not report its image
/// size.
[[nodiscard]] int make_new_rig(const NewRigOptions& options, const CommonOptions& common);

}  // namespace drape
