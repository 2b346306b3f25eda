// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/hems/hem_files.hpp"
#include "core/program/command.hpp"
#include "core/program/program.hpp"

namespace drape::compare {

/// The words of `drape drapemeter`.
struct DrapemeterArguments {
  std::vector<std::filesystem::path> inputs, compared;
  std::optional<std::filesystem::path> out, disc_picture, calibration;
  std::string geometry = "iso-300", names, camera;
  std::optional<double> disc_mm, specimen_mm, mm_per_px, scale_u_percent;
  double plane_z_mm = 0, significance = 0.05;
  bool disc_hole = false;
  std::vector<double> ruler;  ///< x y x y in px, length in mm
};

void add_options(Command& app, DrapemeterArguments& arguments);

/// Checked and with the scale of pictures. Throws Error(usage).
[[nodiscard]] HemReadOptions read_options(const DrapemeterArguments& arguments, int threads);

/// One hem's numbers, or each fabric's variance components; the matches; what was refused.
[[nodiscard]] Ending ending_of(const HemSet& real, const HemSet& compared,
                               const std::vector<HemMatch>& matches);

}  // namespace drape::compare
