// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/hems/hem_files.hpp"
#include "core/fields/fields.hpp"
#include "core/program/program.hpp"

namespace drape::compare {

/// Arguments of `drape drapemeter`.
struct DrapemeterArguments {
  std::vector<std::filesystem::path> inputs, compared;
  std::optional<std::filesystem::path> out, disc_picture, calibration;
  StandardTest geometry = StandardTest::iso_300;
  std::string names, camera;
  std::optional<double> disc_m, specimen_m, m_per_px, scale_u;
  double plane_z_m = 0, significance = 0.05;
  bool disc_hole = false;
  std::optional<std::array<double, 5>> ruler;  ///< x y x y in px, length in mm
};

void fields(Fields& f, DrapemeterArguments& arguments);

/// Checked options with the scale of pictures. Throws Error(usage).
[[nodiscard]] HemReadOptions read_options(const DrapemeterArguments& arguments, int threads);

/// Ending with a hem's numbers or each fabric's variance components, matches and refused files.
[[nodiscard]] Ending ending_of(const HemSet& real, const HemSet& compared,
                               const std::vector<HemMatch>& matches);

}  // namespace drape::compare
