// SPDX-License-Identifier: Apache-2.0
#include "compare/folds/folds_json.hpp"

#include <fmt/format.h>

#include "core/units.hpp"

namespace drape::compare {

using units::mm;

Json json_of(const std::string& file, const SheetShape& shape) {
  Json json;
  json["sheet"] = file;
  json["mean_bending_per_m2"] = shape.mean_bending_per_m2;
  json["bands"] = Json::array();
  for (const WaveBand& band : shape.bands)
    json["bands"].push_back({{"from_mm", band.from_m / mm},
                             {"to_mm", band.to_m / mm},
                             {"height_mm2", band.height_m2 / (mm * mm)},
                             {"curvature_per_m2", band.curvature_per_m2}});
  json["folds"] = Json::array();
  for (const Fold& fold : shape.folds)
    json["folds"].push_back({{"material_mm", to_json_vector(fold.middle_material_m / mm)},
                             {"xyz_mm", to_json_vector(fold.middle_in_world / mm)},
                             {"length_mm", fold.length_m / mm},
                             {"direction_deg", fold.direction_rad / units::deg},
                             {"curvature_per_m", fold.curvature_per_m}});
  return json;
}

Json json_of(const DescriptorSpread& spread) {
  Json json = {{"descriptor", spread.name}, {"mean", spread.mean}};
  const auto add = [&](const char* key, const std::optional<double>& value) {
    if (value) json[key] = *value;
  };
  add("variation", spread.variation);
  add("mean_against", spread.mean_against);
  add("variation_against", spread.variation_against);
  add("area_under_curve", spread.area_under_curve);
  return json;
}

std::string text_of(const DescriptorSpread& spread) {
  const auto part = [](const std::optional<double>& variation) {
    return variation ? fmt::format(" (variation {:.1f} %)", 100 * *variation) : std::string();
  };
  std::string text = fmt::format("{:.4g}{}", spread.mean, part(spread.variation));
  if (spread.mean_against)
    text += fmt::format(", against {:.4g}{}, which has more in {:.1f} % of the pairs",
                        *spread.mean_against, part(spread.variation_against),
                        100 * *spread.area_under_curve);
  return text;
}

}  // namespace drape::compare
