// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"

namespace drape {

/// Simulated drape of one round specimen from one start.
struct CusickStart {
  std::string file;  ///< file name of its mesh
  int points = 0;
  double specimen_area_m2 = 0;
  bool at_rest = false;  ///< accepted by the checker
  int steps = 0;
  std::optional<double> residual = {};  ///< in mean weights of a point; absent if it diverged
  std::optional<double> energy_j = {};
  std::vector<std::string> refusals = {};  ///< the checker's reasons
  std::optional<double> checked_residual = {}, deepest_m = {};
  std::optional<double> dissipated_j = {};  ///< energy lost to internal friction
  int hurried_loads = 0;  ///< load steps that ended before the cloth was nearly at rest
};

/// cusick.json: drapes of one fabric between the discs of a drapemeter.
struct CusickFile {
  std::string fabric;
  std::optional<double> disc_m, specimen_m;  ///< diameters; absent in files of older programs
  std::vector<CusickStart> starts;
  Document document = {};
};
template <>
inline constexpr Format format_of<CusickFile>{
    "cusick", Syntax::json, 1, "cusick.json: virtual drapes of a round specimen from many starts."};

void fields(Fields& f, CusickFile& file);

}  // namespace drape
