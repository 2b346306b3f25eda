// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/ending.hpp"

#include <fmt/format.h>

namespace drape::calib {
namespace {

Json text_or_null(const std::string& text) {
  return text.empty() ? Json() : Json(text);
}

}  // namespace

Json json_of(const Acceptance& acceptance, const AcceptanceDates& dates) {
  Json json;
  json["schema"] = "drapebench/acceptance/1";
  json["rig"] = acceptance.rig;
  json["calibration_sha256"] = acceptance.calibration_sha256;
  json["date"] = text_or_null(dates.on);
  json["valid_until"] = text_or_null(dates.valid_until);
  json["positions"] = acceptance.positions;
  json["go"] = acceptance.good();
  json["cause"] = text_or_null(acceptance.cause);
  json["warnings"] = acceptance.warnings;
  json["figures"] = Json::array();
  for (const AcceptanceFigure& figure : acceptance.figures) {
    Json row;
    row["name"] = figure.name;
    row["unit"] = figure.unit;
    const bool measured = figure.not_measured.empty();
    row["value"] = measured ? Json(figure.value) : Json();
    row["expanded_uncertainty"] = measured ? Json(figure.expanded) : Json();
    row["limit"] = measured ? Json(figure.limit) : Json();
    row["limit_stated"] = figure.limit_stated;
    row["smallest_fault"] = measured ? Json(figure.smallest) : Json();
    row["smallest_fault_unit"] = text_or_null(figure.smallest_unit);
    row["where"] = figure.where;
    row["go"] = figure.good();
    row["not_measured"] = text_or_null(figure.not_measured);
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
            ? fmt::format(
                  "{:.4f} +- {:.4f} (95 %) {}, limit {:.4f}{}: {}, {}; named from {:.4f} {}",
                  figure.value, figure.expanded, figure.unit, figure.limit,
                  figure.limit_stated ? " (stated)" : "",
                  figure.good()    ? "GO"
                  : figure.informs ? "warning"
                                   : "NO-GO",
                  figure.where, figure.smallest, figure.smallest_unit)
            : "not measured: " + figure.not_measured;
    ending.numbers.emplace_back(figure.name, value);
    const bool lacks = figure.may_lack && !figure.not_measured.empty();
    if (!figure.good() && !figure.informs && !lacks && ending.verdict.empty())
      ending.verdict = figure.name + " " + value;
  }
  if (!acceptance.cause.empty()) ending.verdict = acceptance.cause;
  if (ending.go)
    ending.verdict =
        fmt::format("the instrument is accepted from {} positions", acceptance.positions);
  ending.warnings = acceptance.warnings;
  ending.numbers.emplace_back("protocol", page.string());
  return ending;
}

}  // namespace drape::calib
