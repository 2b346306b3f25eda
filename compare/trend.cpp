// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "compare/explain.hpp"
#include "core/csv.hpp"
#include "core/error.hpp"
#include "core/files.hpp"

namespace drape::compare {
namespace {

/// One series in the order of its imports.
struct Series {
  std::string name, unit;
  std::vector<std::string> labels;
  std::vector<double> values;
};

void add_series(std::vector<Series>& list, const Table& rows, const std::string& unit) {
  for (const auto& row : rows.rows) {
    if (list.empty() || list.back().name != row[0]) list.push_back({row[0], unit, {}, {}});
    list.back().labels.push_back(row[1]);
    list.back().values.push_back(std::stod(row[2]));
  }
}

std::vector<Series> all_series(const StoreReader& store, const std::string& specimen) {
  std::vector<Series> list;
  if (specimen.empty()) {
    add_series(
        list,
        store.query(
            "SELECT 'calibration residual ' || k.rig_name || ' ' || c.camera, "
            "substr(c.calibration_sha256, 1, 12), c.rms_px FROM calibration_camera AS c JOIN "
            "calibration AS k ON k.sha256 = c.calibration_sha256 JOIN ledger AS l ON l.kind "
            "= 'calibration_file' AND l.key = c.calibration_sha256 ORDER BY k.rig_name, "
            "c.camera, l.sequence"),
        "px");
  }
  add_series(list,
             store.query(
                 "SELECT 'mean distance ' || v.scene || ' ' || coalesce(v.fabric, '') || ' ' || "
                 "v.grid_size || coalesce(' ' || v.segments || ' seg ', ' ') || v.simulator || ' ' "
                 "|| v.model || ' ' || v.solver AS name, v.comparison, v.mean_dist_mm FROM "
                 "v_real_vs_virtual AS v WHERE (?1 = '' OR v.scene = ?1 OR v.scene || '/' || "
                 "v.fabric = ?1) ORDER BY name, v.id",
                 {specimen}),
             "mm");
  return list;
}

}  // namespace

Trend trend_of(const StoreReader& store, const TrendOptions& options) {
  if (options.least_before < 2 || !(options.alarm_sigmas > 0))
    throw usage_error("a trend needs at least 2 values before and an alarm above 0 sigma", "");
  Trend trend;
  trend.table.names = {"series",      "n",        "run",    "value", "unit",
                       "mean_before", "s_before", "sigmas", "alarm"};
  trend.table.numeric = {false, true, false, true, false, true, true, true, false};
  for (const Series& series : all_series(store, options.specimen)) {
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < series.values.size(); ++i) {
      const double value = series.values[i];
      std::vector<std::string> cells = {series.name,
                                        std::to_string(i + 1),
                                        series.labels[i],
                                        fmt::format("{:.4f}", value),
                                        series.unit,
                                        "",
                                        "",
                                        "",
                                        ""};
      const auto n = static_cast<double>(i);
      if (i >= static_cast<std::size_t>(options.least_before)) {
        const double mean = sum / n;
        const double s = std::sqrt(std::max(0.0, (squares - n * mean * mean) / (n - 1)));
        const double spread = s * std::sqrt(1 + 1 / n);
        const double off = value - mean;
        const bool alarm = std::abs(off) > options.alarm_sigmas * spread;
        cells[5] = fmt::format("{:.4f}", mean);
        cells[6] = fmt::format("{:.4f}", s);
        cells[7] = spread > 0 ? fmt::format("{:+.1f}", off / spread) : off == 0 ? "0" : "";
        cells[8] = alarm ? "ALARM" : "";
        trend.alarms += alarm && i + 1 == series.values.size();
      }
      trend.table.add(std::move(cells));
      sum += value;
      squares += value * value;
    }
  }
  return trend;
}

namespace {

/// One line of published.csv.
struct Published {
  std::string experiment, kind, label_a, label_b, mean_mm;
  int table = 0;
};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t comma = std::min(line.find(',', at), line.size());
    cells.push_back(line.substr(at, comma - at));
    at = comma + 1;
  }
  return cells;
}

std::vector<Published> read_published(const std::string& file) {
  const std::string text = read_text(file);
  std::vector<Published> list;
  int number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::vector<std::string> c = cells_of(text.substr(at, end - at));
    at = end + 1;
    if (++number == 1) {
      if (c.size() == 8 && c[0] == "experiment" && c[7] == "mean_distance_mm") continue;
      throw bad_input("this is not the list of the paper's numbers", {.file = file, .line = 1},
                      "give rigs/paper/published.csv");
    }
    if (c.size() != 8)
      throw bad_input("a line with another number of cells", {.file = file, .line = number},
                      "give rigs/paper/published.csv");
    Published row{c[0], c[2], c[3] + "x" + c[3], c[4], c[7], std::stoi(c[1])};
    if (c[2] == "virtual-virtual") {
      row.label_a = c[3] == c[5] ? fmt::format("{0}x{0}: {1} seg vs {2} seg", c[3], c[4], c[6])
                                 : fmt::format("{0} seg: {1}x{1} vs {2}x{2}", c[4], c[3], c[5]);
    }
    list.push_back(row);
  }
  return list;
}

/// A column of results: a measured sheet, or the simulations without one.
struct Column {
  std::string head, measured;
};

std::string result_of(const StoreReader& store, const Published& row, const Column& column) {
  const bool real = row.kind == "real-virtual";
  const std::string sql =
      real ? "SELECT round(mean_dist_mm, 2) FROM v_real_vs_virtual WHERE scene = ?1 AND measured = "
             "?2 AND grid_size = ?3 AND CAST(segments AS TEXT) = ?4 AND simulator = 'drapebench'"
           : "SELECT round(mean_dist_mm, 2) FROM v_virtual_vs_virtual WHERE scene = ?1 AND "
             "coalesce(measured, '') = ?2 AND pair = ?3 AND ?4 = ?4";
  const Table found = store.query(sql, {row.experiment, column.measured, row.label_a, row.label_b});
  std::string text;
  for (const auto& result : found.rows) text += (text.empty() ? "" : " / ") + result[0];
  return text;
}

std::vector<Column> columns_of(const StoreReader& store, const Published& row) {
  std::vector<Column> columns;
  const bool real = row.kind == "real-virtual";
  if (!real) columns.push_back({"paper_scene_mm", ""});
  for (const auto& sheet :
       store
           .query("SELECT DISTINCT rig, measured_set, measured FROM v_real_vs_virtual WHERE scene "
                  "= ? ORDER BY rig, measured_set, measured",
                  {row.experiment})
           .rows)
    columns.push_back(
        {fmt::format("{}_{}_{}_mm", sheet[0], sheet[1], sheet[2].substr(0, 6)), sheet[2]});
  return columns;
}

}  // namespace

std::vector<Table> published_tables(const StoreReader& store, const std::string& published_csv) {
  std::vector<Table> tables;
  std::vector<Column> columns;
  int number = 0;
  for (const Published& row : read_published(published_csv)) {
    const bool real = row.kind == "real-virtual";
    if (row.table != number) {
      number = row.table;
      columns = columns_of(store, row);
      Table table;
      table.title = fmt::format("Table {}. {}, experiment {}", number,
                                real ? "Real vs virtual" : "Virtual vs virtual", row.experiment);
      table.names = real ? std::vector<std::string>{"grid_size", "segments", "published_mm"}
                         : std::vector<std::string>{"pair", "published_mm"};
      table.numeric = real ? std::vector<bool>{false, true, true} : std::vector<bool>{false, true};
      for (const Column& column : columns) {
        table.names.push_back(column.head);
        table.numeric.push_back(true);
      }
      tables.push_back(table);
    }
    std::vector<std::string> cells = {row.label_a};
    if (real) cells.push_back(row.label_b);
    cells.push_back(row.mean_mm);
    for (const Column& column : columns) cells.push_back(result_of(store, row, column));
    tables.back().add(std::move(cells));
  }
  return tables;
}

}  // namespace drape::compare
