// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/ending.hpp"

#include <fmt/format.h>

namespace drape::calib {

Json json_of(const Acceptance& acceptance) {
  Json json;
  json["schema"] = "drapebench/acceptance/1";
  json["rig"] = acceptance.rig;
  json["calibration_sha256"] = acceptance.calibration_sha256;
  json["positions"] = acceptance.positions;
  json["go"] = acceptance.good();
  json["figures"] = Json::array();
  for (const AcceptanceFigure& figure : acceptance.figures) {
    Json row;
    row["name"] = figure.name;
    row["unit"] = figure.unit;
    const bool measured = figure.not_measured.empty();
    row["value"] = measured ? Json(figure.value) : Json();
    row["expanded_uncertainty"] = measured ? Json(figure.expanded) : Json();
    row["limit"] = figure.limit;
    row["where"] = figure.where;
    row["go"] = figure.good();
    row["not_measured"] = measured ? Json() : Json(figure.not_measured);
    json["figures"].push_back(row);
  }
  return json;
}

Ending ending_of(const Acceptance& acceptance, const std::filesystem::path& page) {
  Ending ending;
  ending.go = acceptance.good();
  for (const AcceptanceFigure& figure : acceptance.figures) {
    const std::string value =
        figure.not_measured.empty()
            ? fmt::format("{:.4f} +- {:.4f} (k = 2) {}, limit {:g}: {}, {}", figure.value,
                          figure.expanded, figure.unit, figure.limit,
                          figure.good() ? "GO" : "NO-GO", figure.where)
            : "not measured: " + figure.not_measured;
    ending.numbers.emplace_back(figure.name, value);
    if (!figure.good() && ending.verdict.empty() && figure.name != "known shift")
      ending.verdict = figure.name + " " + value;
  }
  if (ending.go) {
    ending.verdict =
        fmt::format("the instrument is accepted from {} positions", acceptance.positions);
  } else if (ending.verdict.empty()) {
    ending.verdict = "known shift beyond its limit";
  }
  ending.numbers.emplace_back("protocol", page.string());
  return ending;
}

}  // namespace drape::calib
