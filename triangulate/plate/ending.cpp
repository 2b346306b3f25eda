// SPDX-License-Identifier: Apache-2.0
#include "triangulate/plate/ending.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"

namespace drape::triangulate {

std::vector<std::string> contradictions_of(const std::vector<ObjectValue>& values,
                                           const std::string& name) {
  std::vector<std::string> found;
  for (const ObjectValue& value : values)
    if (value.contradicts())
      found.push_back(fmt::format("{}: {} = {:g} is not where the plate lies; write {} = {:.2f}",
                                  name, value.key, value.stated, value.key, value.measured));
  return found;
}

Ending ending_of(const std::vector<ObjectValue>& values, const PlatePose& plate,
                 const std::string& name, const std::vector<std::string>& against) {
  Ending ending;
  ending.verdict = name + ": its stated place is the one measured";
  for (const ObjectValue& value : values)
    ending.numbers.emplace_back(
        value.key,
        fmt::format("{:.3f} +- {:.3f}, stated {:g} +- {:.3g} (one standard uncertainty)",
                    value.measured, value.uncertainty, value.stated, value.stated_uncertainty));
  for (const std::string& text : against) {
    if (ending.go)
      ending.verdict = text;
    else
      ending.warnings.push_back("NO-GO also because " + text);
    ending.go = false;
  }
  ending.numbers.emplace_back(
      "plate", fmt::format("{} dots, {} views, {:.4f} px RMS, {:.2f} of what their noise predicts",
                           plate.dots, plate.views, plate.rms_px, std::sqrt(plate.chi2_per_dof)));
  const Tilt tilt = tilt_of(plate);
  if (tilt.rad > 3 * tilt.uncertainty_rad)
    ending.warnings.push_back(fmt::format("the plate is tilted by {:.2f} +- {:.2f} degrees",
                                          tilt.rad / units::deg,
                                          tilt.uncertainty_rad / units::deg));
  ending.advice = {
      fmt::format("in the scene: place_uncertainty_mm = {:.2f}", place_uncertainty_mm(values))};
  return ending;
}

}  // namespace drape::triangulate
