// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/ending.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace drape::calib {
namespace {

std::optional<std::string> given(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

}  // namespace

AcceptanceFile file_of(const Acceptance& acceptance, const AcceptanceDates& dates) {
  AcceptanceFile file;
  file.rig = acceptance.rig;
  file.calibration_sha256 = acceptance.calibration_sha256;
  file.date = given(dates.on);
  file.valid_until = given(dates.valid_until);
  file.cause = given(acceptance.cause);
  file.positions = acceptance.positions;
  file.go = acceptance.good();
  file.warnings = acceptance.warnings;
  file.lacks = acceptance.lacks;
  for (const AcceptanceFigure& figure : acceptance.figures) {
    const auto if_measured = [&](double value) {
      return figure.not_measured.empty() ? std::optional(value) : std::nullopt;
    };
    file.figures.push_back({.name = figure.name,
                            .unit = figure.unit,
                            .where = figure.where,
                            .value = if_measured(figure.value),
                            .expanded = if_measured(figure.expanded),
                            .limit = if_measured(figure.limit),
                            .limit_stated = figure.limit_stated,
                            .smallest_fault = if_measured(figure.smallest),
                            .smallest_fault_unit = given(figure.smallest_unit),
                            .not_measured = given(figure.not_measured),
                            .go = figure.good()});
  }
  return file;
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
        acceptance.lacks.empty()
            ? fmt::format("the instrument is accepted from {} positions", acceptance.positions)
            : fmt::format(
                  "the interim check is passed at {} positions; an acceptance (ISO "
                  "10360-13, VDI/VDE 2634) needs also {}",
                  acceptance.positions, fmt::join(acceptance.lacks, ", "));
  ending.warnings = acceptance.warnings;
  ending.numbers.emplace_back("protocol", page.string());
  return ending;
}

}  // namespace drape::calib
