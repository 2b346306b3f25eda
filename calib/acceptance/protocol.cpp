// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/protocol.hpp"

#include <fmt/format.h>

#include <chrono>

#include "core/drawing/svg.hpp"
#include "core/error.hpp"
#include "core/program/dates.hpp"

namespace drape::calib {
namespace {

std::string verdict_of(const AcceptanceFigure& figure) {
  if (figure.good()) return "GO";
  return figure.informs ? "warning" : "NO-GO";
}

std::string row_of(const AcceptanceFigure& figure) {
  if (!figure.not_measured.empty())
    return fmt::format("<tr><td>{}</td><td colspan=\"6\">{}: {}</td></tr>\n", xml(figure.name),
                       figure.may_lack ? "not measured" : "NO-GO, not measured",
                       xml(figure.not_measured));
  return fmt::format(
      "<tr><td>{}</td><td>{:.4f} {}</td><td>{:.4f}</td><td>{:.4f}{}</td><td>{:.4f} {}</td>"
      "<td>{}</td><td>{}</td></tr>\n",
      xml(figure.name), figure.value, figure.unit, figure.expanded, figure.limit,
      figure.limit_stated ? " (stated)" : "", figure.smallest, figure.smallest_unit,
      xml(figure.where), verdict_of(figure));
}

}  // namespace

AcceptanceDates dates_of(const std::string& on, int valid_days) {
  if (valid_days < 1) throw usage_error("--valid-days is below 1", "give a number of days");
  if (on.empty()) return {};
  const auto date = date_in(on);
  if (!date) throw usage_error("--date `" + on + "` is no date", "write it as 2026-01-31");
  return {on, date_text(*date + std::chrono::days(valid_days))};
}

std::string protocol_page(const Acceptance& acceptance, const AcceptanceDates& dates) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Acceptance of "
      "{0}</title>\n<style>body{{font:11pt sans-serif;margin:2cm}}table{{border-collapse:collapse}}"
      "td,th{{border:1px solid #888;padding:4px 8px;text-align:left}}</style></head><body>\n"
      "<h1>{5} of {0}: {1}</h1>\n<p>{2}, {3} positions of the target, calibration {4}</p>\n",
      xml(acceptance.rig), acceptance.good() ? "GO" : "NO-GO",
      xml(dates.on.empty() ? "no date" : dates.on + ", valid until " + dates.valid_until),
      acceptance.positions, xml(acceptance.calibration_sha256),
      acceptance.lacks.empty() ? "Acceptance" : "Interim check");
  for (const std::string& part : acceptance.lacks)
    page += "<p>An acceptance needs also " + xml(part) + "</p>\n";
  if (!acceptance.cause.empty()) page += "<p>" + xml(acceptance.cause) + "</p>\n";
  for (const std::string& warning : acceptance.warnings)
    page += "<p>Warning: " + xml(warning) + "</p>\n";
  page +=
      "<table><tr><th>figure</th><th>value</th><th>U (95 %)</th><th>limit</th><th>smallest fault "
      "named</th><th>where</th><th>verdict</th></tr>\n";
  for (const AcceptanceFigure& figure : acceptance.figures) page += row_of(figure);
  return page +
         "</table>\n<p>Conformity is proven when value and U together stay within the limit (ISO "
         "14253-1). A limit that is not stated is what this instrument can prove: it follows from "
         "the uncertainties of calibration, marks and print.</p>\n<p>Date, signature: "
         "____________________</p>\n</body></html>\n";
}

}  // namespace drape::calib
