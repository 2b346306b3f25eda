// SPDX-License-Identifier: Apache-2.0
#include "compare/report/history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compare/history/results.hpp"
#include "compare/report/report.hpp"
#include "compare/schema/schema.hpp"
#include "core/run_report.hpp"

namespace drape::compare {
namespace {

using Rows = std::vector<std::vector<std::string>>;

/// Points of each series, with the band predicted by the values before each.
Value series_of(const Trend& trend, double alarm_sigmas) {
  Value all = Value::List{};
  const Rows& rows = trend.table.rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto& row = rows[i];
    if (i == 0 || row[0] != rows[i - 1][0]) {
      Value series;
      series["name"] = row[0];
      series["unit"] = row[4];
      series["points"] = Value::List{};
      all.append(std::move(series));
    }
    Value point;
    point["label"] = row[2];
    point["value"] = std::stod(row[3]);
    point["low"] = Value();
    point["high"] = Value();
    if (!row[5].empty()) {
      const double mean = std::stod(row[5]);
      const double reach =
          alarm_sigmas * std::stod(row[6]) * std::sqrt(1 + 1 / (std::stod(row[1]) - 1));
      point["low"] = mean - reach;
      point["high"] = mean + reach;
    }
    point["alarm"] = !row[8].empty();
    all.get_if<Value::List>()->back()["points"].append(std::move(point));
  }
  return all;
}

}  // namespace

HistoryPage history_page(const StoreReader& store, const TrendOptions& options) {
  const Trend trend = trend_of(store, options);
  store.require_as_written(std::vector<std::string>{"drapemeter", "simulation_pair", "branch"});
  Table list = store.query(
      R"sql(SELECT scene, fabric, simulator, discretisation, segments,
  round(mean_dist_mm, 3) AS "mean (mm)", round(sigma_mean_mm, 4) AS "± (mm)",
  round(mean_low_mm, 2) AS "95 % from (mm)", round(mean_high_mm, 2) AS "to (mm)",
  round(max_mm, 2) AS "largest (mm)", marks, gaps, status, recorded_on AS recorded, comparison,
  coalesce(measurement, 'not stated') AS measurement, cause, coalesce(state, 'current') AS state
FROM v_real_vs_virtual ORDER BY id DESC)sql");
  Table drapemeters = store.query(
      R"sql(SELECT coalesce(s.scene, m.set_name) AS drape, coalesce(s.simulator, 'measured') AS sheet, )sql" +
      std::string(kDiscretisation) +
      R"sql( AS discretisation, s.segments, round(d.covered_area_mm2) AS "covered (mm²)",
  round(d.drape_coefficient_percent, 1) AS "drape coefficient (%)", d.folds,
  round(d.fold_depth_mm, 1) AS "fold depth (mm)", substr(m.sha256, 1, 12) AS "key of the sheet"
FROM drapemeter AS d JOIN sheet AS m ON m.sha256 = d.sheet_sha256
  LEFT JOIN simulation AS s ON s.sheet_sha256 = d.sheet_sha256
ORDER BY drape, sheet, s.segments, s.spacing_mm, s.grid_rows, d.sheet_sha256)sql");
  Table pairs = store.query(
      R"sql(SELECT scene, pair, round(mean_dist_mm, 2) AS "mean (mm)", round(max_mm, 2) AS "largest (mm)",
  round(hausdorff_mm, 2) AS "Hausdorff (mm)", points, fabric, model, solver,
  CASE both_at_rest WHEN 1 THEN 'yes' WHEN 0 THEN 'no' END AS "both at rest",
  coalesce(measured, 'no real cloth') AS "marks of", comparison AS pair, measurement,
  state FROM v_virtual_vs_virtual)sql");
  const std::size_t columns = list.names.size();
  const auto no_go = std::count_if(list.rows.begin(), list.rows.end(), [&](const auto& row) {
    return row[columns - 3] == "NO-GO" && row[columns - 1] == "current";
  });
  std::string verdict = trend.alarms == 0
                            ? "no newest value is beyond the alarm"
                            : fmt::format("{} newest values are beyond the alarm", trend.alarms);
  if (no_go > 0) verdict += fmt::format("; {} current comparisons are NO-GO", no_go);
  const bool go = trend.alarms == 0 && no_go == 0;
  list.title = "Real against virtual; the newest import stands first";
  pairs.title = "Virtual against virtual";
  drapemeters.title = "Drapemeter";
  Value page;
  page["go"] = go;
  page["sentence"] = fmt::format("{} comparisons; {}", list.rows.size(), verdict);
  page["note"] = fmt::format(
      "Blue bands: where {:g} standard deviations of the values before each one end (mean ± {:g} s "
      "sqrt(1 + 1/n), from {} values on).",
      options.alarm_sigmas, options.alarm_sigmas, options.least_before);
  page["series"] = series_of(trend, options.alarm_sigmas);
  for (Table* table : {&list, &pairs, &drapemeters})
    page["tables"].append(value_of(ReportedTable{"history", "", *table}));
  return {page_of("History of the bench", "history", page), go};
}

}  // namespace drape::compare
