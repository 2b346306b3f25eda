// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/fields/fields.hpp"
#include "core/program/program.hpp"

namespace drape {

struct NewRigOptions {
  std::filesystem::path folder;      ///< folder of the new rig; its last part is the rig's name
  std::vector<std::string> cameras;  ///< names, or "auto" alone: those that answer
  std::string size_px = "1600x1200";
  std::vector<std::string> drapes;  ///< NAME=sphere:DIAMETER_MM, NAME=box:EDGE_MM, NAME=hung:MM
  std::vector<double> stage_z_mm = {0, 30, 60, 90};
  int free_poses = 15;
};

void fields(Fields& f, NewRigOptions& options);

/// `drape new`: the files of a bench of one's own, commented, in a new folder. What only the
/// operator can measure is left out, so that the first reader names it with file and line instead
/// of running on a number that nobody measured. Returns the exit code. Throws Error(usage) for a
/// name, size or drape that cannot be understood, Error(bad_input) when the folder exists. With
/// "auto", cameras.toml too is written, from what drape-capture cameras finds; Error(device) where
/// that is nothing, or a camera does not say how large its pictures are.
[[nodiscard]] int make_new_rig(const NewRigOptions& options, const CommonOptions& common);

}  // namespace drape
