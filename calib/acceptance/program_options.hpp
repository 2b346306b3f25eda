// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/acceptance/acceptance.hpp"

namespace drape {
class Command;
}

namespace drape::calib {

/// What `drape calib accept` is called with.
struct AcceptanceArguments {
  AcceptanceOptions options;
  std::filesystem::path detections, calibration, rig, out;
  std::optional<std::filesystem::path> target, sphere;
  double sphere_diameter_mm = 0, sphere_uncertainty_mm = 0.01;
  std::vector<std::string> repeats;
  std::vector<double> bow_mm, bow_sd_mm;
  std::string date;
  int valid_days = 365;
};

void add_acceptance_options(Command& app, AcceptanceArguments& arguments);

/// Throws Error(usage) for an option that would do nothing: of a ball without --sphere, of a date
/// without --date; and for a ball of unknown size.
void refuse_idle_options(const Command& app);

}  // namespace drape::calib
