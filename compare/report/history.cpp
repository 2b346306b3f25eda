// SPDX-License-Identifier: Apache-2.0
#include "compare/report/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compare/history/results.hpp"
#include "compare/report/html.hpp"
#include "compare/report/svg.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {
namespace {

constexpr double kWidth = 520, kHeight = 170, kLeft = 58, kTop = 14, kBottom = 34;

using Rows = std::vector<std::vector<std::string>>;

double number(const std::string& text) {
  return std::stod(text);
}

/// Values over imports with the band that the values before each one predict.
std::string chart_of(const std::string& name, const Rows& rows, double alarm_sigmas) {
  double low = 1e300, high = -1e300;
  const auto extend = [&](double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  };
  for (const auto& row : rows) {
    extend(number(row[3]));
    if (row[5].empty()) continue;
    const double n = number(row[1]) - 1;
    const double reach = alarm_sigmas * number(row[6]) * std::sqrt(1 + 1 / n);
    extend(number(row[5]) - reach);
    extend(number(row[5]) + reach);
  }
  const double step = round_step(std::max(high - low, 1e-3), 4);
  low = step * std::floor(low / step);
  high = std::max(step * std::ceil(high / step), low + step);
  const auto count = static_cast<double>(rows.size());
  const double wide = kWidth - kLeft - 14, tall = kHeight - kTop - kBottom;
  const auto x = [&](double n) { return kLeft + wide * (n - 0.5) / count; };
  const auto y = [&](double value) { return kTop + tall * (high - value) / (high - low); };
  Svg svg(kWidth, kHeight, name);
  for (const double value : ticks(low, high, step)) {
    svg.line({kLeft, y(value)}, {kLeft + wide, y(value)}, "stroke=\"#e3e6ea\"");
    svg.text({kLeft - 6, y(value) + 4}, fmt::format("{:.4g}", value), 11, "end", "fill=\"#555\"");
  }
  std::vector<Eigen::Vector2d> line;
  for (const auto& row : rows) {
    const double n = number(row[1]), value = number(row[3]);
    if (!row[5].empty()) {
      const double mean = number(row[5]);
      const double reach = alarm_sigmas * number(row[6]) * std::sqrt(1 + 1 / (n - 1));
      svg.rectangle(x(n) - wide / count * 0.4, y(mean + reach), wide / count * 0.8,
                    std::max(1.0, y(mean - reach) - y(mean + reach)), "fill=\"#dbe6f1\"",
                    "what the values before predict");
    }
    line.emplace_back(x(n), y(value));
  }
  svg.polyline(line, "stroke=\"#0072b2\" stroke-width=\"1.6\"");
  for (const auto& row : rows) {
    const bool alarm = !row[8].empty();
    const Eigen::Vector2d at(x(number(row[1])), y(number(row[3])));
    svg.circle(at, alarm ? 5 : 3, alarm ? "fill=\"#a3231c\"" : "fill=\"#0072b2\"",
               fmt::format("{}: {} {}", row[2], row[3], row[4]));
    // A second sign beside the colour.
    if (alarm) svg.text(at + Eigen::Vector2d(0, -9), "alarm", 11, "middle", "fill=\"#a3231c\"");
  }
  svg.text({kLeft + wide / 2, kHeight - 6}, "imports, in order", 11, "middle", "fill=\"#555\"");
  svg.text({kLeft, kHeight - 6}, rows.front()[4], 11, "start", "fill=\"#555\"");
  return html_figure({name, name + " (" + rows.front()[4] + ")", svg.finish()});
}

std::string charts(const Trend& trend, double alarm_sigmas) {
  std::string text;
  const Rows& rows = trend.table.rows;
  for (std::size_t begin = 0; begin < rows.size();) {
    std::size_t end = begin;
    while (end < rows.size() && rows[end][0] == rows[begin][0]) ++end;
    const Rows part(rows.begin() + static_cast<std::ptrdiff_t>(begin),
                    rows.begin() + static_cast<std::ptrdiff_t>(end));
    if (part.size() > 1) text += chart_of(part.front()[0], part, alarm_sigmas);
    begin = end;
  }
  return text.empty() ? "<p>No series has two values yet.</p>\n"
                      : "<div class=\"columns\">" + text + "</div>\n";
}

}  // namespace

HistoryPage history_page(const StoreReader& store, const TrendOptions& options) {
  const Trend trend = trend_of(store, options);
  Table list = store.query(
      "SELECT scene, fabric, simulator, grid_size AS grid, segments AS seg, round(mean_dist_mm, 3) "
      "AS mean, round(sigma_mean_mm, 4) AS sigma, round(mean_low_mm, 2) AS low, "
      "round(mean_high_mm, 2) AS high, round(max_mm, 2) AS max, marks, gaps, status, recorded_on, "
      "comparison, coalesce(measurement, 'not stated') AS measurement, cause, coalesce(state, "
      "'current') AS state FROM v_real_vs_virtual ORDER BY id DESC");
  list.headings = {"scene",       "fabric", "simulator",      "grid",     "segments",
                   "mean (mm)",   "± (mm)", "95 % from (mm)", "to (mm)",  "largest (mm)",
                   "marks",       "gaps",   "status",         "recorded", "comparison",
                   "measurement", "cause",  "state"};
  Table drapemeters = store.query(
      "SELECT coalesce(s.scene, m.set_name) AS drape, coalesce(s.simulator, 'measured') AS sheet, "
      "s.grid_rows || 'x' || s.grid_cols AS grid_size, s.segments, round(d.covered_area_mm2) AS "
      "covered_area_mm2, round(d.drape_coefficient_percent, 1) AS drape_coefficient_percent, "
      "d.folds, round(d.fold_depth_mm, 1) AS fold_depth_mm, substr(m.sha256, 1, 12) AS sheet_key "
      "FROM drapemeter AS d JOIN sheet AS m ON "
      "m.sha256 = d.sheet_sha256 LEFT JOIN simulation AS s ON s.sheet_sha256 = d.sheet_sha256 "
      "ORDER "
      "BY drape, sheet, s.segments, s.grid_rows, d.sheet_sha256");
  drapemeters.headings = {"drape",    "sheet",           "grid",
                          "segments", "covered (mm²)",   "drape coefficient (%)",
                          "folds",    "fold depth (mm)", "key of the sheet"};
  Table pairs = store.query(
      "SELECT scene, pair, round(mean_dist_mm, 2) AS mean_dist_mm, round(max_mm, 2) AS max_mm, "
      "round(hausdorff_mm, 2) AS hausdorff_mm, points, fabric, model, solver, CASE both_at_rest "
      "WHEN 1 THEN 'yes' WHEN 0 THEN 'no' END AS at_rest, coalesce(measured, 'no real cloth') AS "
      "measured, comparison, measurement, state FROM v_virtual_vs_virtual");
  pairs.headings = {"scene",    "pair",   "mean (mm)",   "largest (mm)", "Hausdorff (mm)",
                    "points",   "fabric", "model",       "solver",       "both at rest",
                    "marks of", "pair",   "measurement", "state"};
  const std::size_t columns = list.names.size();
  const auto no_go = std::count_if(list.rows.begin(), list.rows.end(), [&](const auto& row) {
    return row[columns - 3] == "NO-GO" && row[columns - 1] == "current";
  });
  std::string verdict = trend.alarms == 0
                            ? "no newest value is beyond the alarm"
                            : fmt::format("{} newest values are beyond the alarm", trend.alarms);
  if (no_go > 0) verdict += fmt::format("; {} current comparisons are NO-GO", no_go);
  const bool go = trend.alarms == 0 && no_go == 0;
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta "
      "http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'\"/>\n<meta "
      "name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>History of "
      "the bench</title>\n<style>" +
      html_style() + "</style>\n</head>\n<body>\n<main>\n<h1>drapebench " + version() +
      " · history of the bench</h1>\n" +
      fmt::format("<div class=\"verdict {}\"><strong>{}</strong>{} comparisons; {}</div>\n",
                  go ? "go" : "stop", go ? "GO" : "NO-GO", list.rows.size(), verdict) +
      fmt::format(
          "<h2>Trends</h2>\n<p class=\"soft\">Blue bands: where {:g} standard deviations "
          "of the values before each one end (mean ± {:g} s sqrt(1 + 1/n), from {} "
          "values on).</p>\n",
          options.alarm_sigmas, options.alarm_sigmas, options.least_before) +
      charts(trend, options.alarm_sigmas) +
      "<h2>Real against virtual</h2>\n<p class=\"soft\">The newest import stands first.</p>\n" +
      html_table(list, "dense") +
      (pairs.rows.empty() ? std::string()
                          : "<h2>Virtual against virtual</h2>\n" + html_table(pairs, "dense")) +
      (drapemeters.rows.empty() ? std::string()
                                : "<h2>Drapemeter</h2>\n" + html_table(drapemeters, "dense")) +
      "</main>\n</body>\n</html>\n";
  return {std::move(html), go};
}

}  // namespace drape::compare
