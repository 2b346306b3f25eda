// SPDX-License-Identifier: Apache-2.0
#include "compare/report/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compare/history/results.hpp"
#include "compare/report/html.hpp"
#include "compare/schema/schema.hpp"
#include "core/drawing/chart.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {
namespace {

using Rows = std::vector<std::vector<std::string>>;

double number(const std::string& text) {
  return std::stod(text);
}

/// Draws values over imports with the band that the values before each one predict.
std::string chart_of(const std::string& name, const Rows& rows, double alarm_sigmas) {
  const auto reach_of = [&](const std::vector<std::string>& row) {
    return alarm_sigmas * number(row[6]) * std::sqrt(1 + 1 / (number(row[1]) - 1));
  };
  double low = 1e300, high = -1e300;
  std::vector<Eigen::Vector2d> line;
  for (const auto& row : rows) {
    const double value = number(row[3]), mean = row[5].empty() ? value : number(row[5]);
    const double reach = row[5].empty() ? 0 : reach_of(row);
    low = std::min({low, value, mean - reach});
    high = std::max({high, value, mean + reach});
    line.emplace_back(number(row[1]), value);
  }
  Svg svg(520, 190, name);
  Chart chart(svg, {58, 14, 448, 132},
              {"imports, in order", 0.5, static_cast<double>(rows.size()) + 0.5},
              axis_over(rows.front()[4], low, std::max(high, low + 1e-3), 4, true));
  for (const auto& row : rows)
    if (!row[5].empty())
      chart.bar(number(row[1]) - 0.4, number(row[1]) + 0.4, number(row[5]) + reach_of(row),
                "fill=\"#dbe6f1\" stroke=\"#dbe6f1\"", "what the values before predict",
                number(row[5]) - reach_of(row));
  chart.curve(line, series_line(0));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool alarm = !rows[i][8].empty();
    const Eigen::Vector2d at = chart.at(line[i].x(), line[i].y());
    svg.circle(at, alarm ? 5 : 3, alarm ? "fill=\"#a3231c\"" : "fill=\"#0072b2\"",
               fmt::format("{}: {} {}", rows[i][2], rows[i][3], rows[i][4]));
    // A second sign beside the colour.
    if (alarm) svg.text(at + Eigen::Vector2d(0, -9), "alarm", 11, "middle", "fill=\"#a3231c\"");
  }
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
      "SELECT scene, fabric, simulator, discretisation, segments AS seg, round(mean_dist_mm, 3) "
      "AS mean, round(sigma_mean_mm, 4) AS sigma, round(mean_low_mm, 2) AS low, "
      "round(mean_high_mm, 2) AS high, round(max_mm, 2) AS max, marks, gaps, status, recorded_on, "
      "comparison, coalesce(measurement, 'not stated') AS measurement, cause, coalesce(state, "
      "'current') AS state FROM v_real_vs_virtual ORDER BY id DESC");
  list.headings = {"scene",       "fabric", "simulator",      "discretisation", "segments",
                   "mean (mm)",   "± (mm)", "95 % from (mm)", "to (mm)",        "largest (mm)",
                   "marks",       "gaps",   "status",         "recorded",       "comparison",
                   "measurement", "cause",  "state"};
  Table drapemeters = store.query(
      "SELECT coalesce(s.scene, m.set_name) AS drape, coalesce(s.simulator, 'measured') AS "
      "sheet, " +
      std::string(kDiscretisation) +
      " AS discretisation, s.segments, round(d.covered_area_mm2) AS "
      "covered_area_mm2, round(d.drape_coefficient_percent, 1) AS drape_coefficient_percent, "
      "d.folds, round(d.fold_depth_mm, 1) AS fold_depth_mm, substr(m.sha256, 1, 12) AS sheet_key "
      "FROM drapemeter AS d JOIN sheet AS m ON "
      "m.sha256 = d.sheet_sha256 LEFT JOIN simulation AS s ON s.sheet_sha256 = d.sheet_sha256 "
      "ORDER "
      "BY drape, sheet, s.segments, s.spacing_mm, s.grid_rows, d.sheet_sha256");
  drapemeters.headings = {"drape",    "sheet",           "discretisation",
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
  std::string body =
      "<h1>drapebench " + version() + " · history of the bench</h1>\n" +
      fmt::format("<div class=\"verdict {}\"><strong>{}</strong>{} comparisons; {}</div>\n",
                  go ? "go" : "stop", go ? "GO" : "NO-GO", list.rows.size(), verdict) +
      "<h2>Trends</h2>\n" +
      html_note(fmt::format(
          "Blue bands: where {:g} standard deviations of the values before each one end "
          "(mean ± {:g} s sqrt(1 + 1/n), from {} values on).",
          options.alarm_sigmas, options.alarm_sigmas, options.least_before)) +
      charts(trend, options.alarm_sigmas) + "<h2>Real against virtual</h2>\n" +
      html_note("The newest import stands first.") + html_table(list, "dense");
  for (const auto& [heading, table] :
       {std::pair{"Virtual against virtual", &pairs}, {"Drapemeter", &drapemeters}})
    if (!table->rows.empty())
      body += fmt::format("<h2>{}</h2>\n", heading) + html_table(*table, "dense");
  return {html_page("History of the bench", body), go};
}

}  // namespace drape::compare
