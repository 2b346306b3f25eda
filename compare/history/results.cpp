// SPDX-License-Identifier: Apache-2.0
#include "compare/history/results.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/matching.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

/// True for "2026", "2026-03" or "2026-03-01": the beginning of a date as stored.
bool is_date(const std::string& text) {
  static const std::regex form("[0-9]{4}(-[0-9]{2}){0,2}");
  return has_form(text, form) && date_in((text + "-01-01").substr(0, 10));
}

/// Throws if no row of the query `names` has `value` as `name`; reads all only for the error.
void check_known(const StoreReader& store, const std::string& option, const std::string& value,
                 const char* names) {
  if (value.empty() ||
      !store.rows<int>(fmt::format("SELECT 1 FROM ({}) WHERE name = ? LIMIT 1", names), {value})
           .empty())
    return;
  const auto known = store.column<std::string>(
      fmt::format("SELECT DISTINCT name FROM ({}) WHERE name <> '' ORDER BY 1", names));
  throw usage_error(
      fmt::format("nothing in the store has {} `{}`", option, value),
      known.empty() ? "there is: none" : fmt::format("there is: {}", fmt::join(known, ", ")));
}

/// A column of every view of comparisons with the value that a filter asks for; no filter if empty.
struct Condition {
  const char* option;
  const char* column;
  std::string value;
  const char* known;  ///< query of the values in the store
};

std::vector<Condition> conditions_of(const ResultFilter& filter) {
  static const std::string meshes =
      fmt::format("SELECT {} AS name FROM simulation AS s", kDiscretisation);
  return {{"scene", "scene", filter.scene,
           "SELECT scene AS name FROM simulation UNION ALL SELECT scene FROM run_drape UNION ALL "
           "SELECT scene FROM surface_comparison"},
          {"fabric", "fabric", filter.fabric,
           "SELECT coalesce(f.name, s.fabric_stated) AS name FROM simulation AS s LEFT JOIN fabric "
           "AS f ON f.sha256 = s.fabric_sha256 UNION ALL SELECT fabric_stated FROM "
           "surface_comparison"},
          {filter.spacing_m ? "mesh" : "grid", "discretisation", discretisation_of(filter),
           meshes.c_str()},
          {"segments", "segments", filter.segments ? std::to_string(*filter.segments) : "",
           "SELECT CAST(segments AS TEXT) AS name FROM simulation"},
          {"rig", "rig", filter.rig, "SELECT name FROM rig"},
          {"model", "model", filter.model, "SELECT model AS name FROM simulation"},
          {"simulator", "simulator", filter.simulator,
           "SELECT simulator AS name FROM simulation UNION ALL SELECT simulator FROM "
           "surface_comparison"}};
}

constexpr const char* kSpecimen = "the specimen SCENE or SCENE/FABRIC";
constexpr const char* kSpecimens =
    "SELECT scene AS name FROM v_comparison UNION ALL SELECT scene || '/' || fabric FROM "
    "v_comparison";

/// Condition with a parameter for each of since and until; either can be the beginning of a date.
std::string between_dates(const std::string& column, const ResultFilter& filter,
                          Cells& parameters) {
  std::string condition;
  if (!filter.since.empty()) {
    condition += fmt::format(" AND {} >= ?", column);
    parameters.push_back(filter.since);
  }
  if (!filter.until.empty()) {
    // A day, month or year is the beginning of its times: includes the last one.
    condition += fmt::format(" AND substr({}, 1, {}) <= ?", column, filter.until.size());
    parameters.push_back(filter.until);
  }
  return condition;
}

/// Condition on v_run_moment AS q.
std::string window_of(const ResultFilter& filter, Cells& parameters) {
  std::string window = between_dates("q.date", filter, parameters);
  if (filter.run) window += fmt::format(" AND q.run = {}", *filter.run);
  return window;
}

/// Transposes the single row of `table` into name, value, unit and definition.
Table metrics_of(const StoreReader& store, const Table& row) {
  Table metrics({"metric", "value", "unit", "definition"}, {1});
  for (const auto& [name, unit, definition] : metric_dictionary(store))
    if (const auto at = row.column(name)) metrics.add({name, row.rows[0][*at], unit, definition});
  return metrics;
}

Table turned(const Table& row) {
  Table table({"what", "value"});
  for (std::size_t i = 0; i < row.names.size(); ++i)
    if (!row.rows.front()[i].empty()) table.add({row.names[i], row.rows.front()[i]});
  return table;
}

}  // namespace

std::string discretisation_of(const ResultFilter& filter) {
  if (filter.spacing_m) return fmt::format("{:g} mm", *filter.spacing_m / units::mm);
  const std::string& grid = filter.grid;
  return grid.empty() || grid.find('x') != std::string::npos ? grid : grid + "x" + grid;
}

void Selection::add(const ResultFilter& filter) {
  for (const Condition& one : conditions_of(filter)) {
    if (one.value.empty()) continue;
    where += fmt::format(" AND {} = ?", one.column);
    parameters.emplace_back(one.value);
  }
}

std::string runs_of(const ResultFilter& filter, Cells& parameters) {
  return "SELECT q.run FROM v_run_moment AS q WHERE 1" + window_of(filter, parameters);
}

static void check_filter(const StoreReader& store, const ResultFilter& filter) {
  for (const auto& [option, date] : {std::pair("--since", filter.since), {"--until", filter.until}})
    if (!date.empty() && !is_date(date))
      throw usage_error(fmt::format("{} {} is not an ISO date", option, date),
                        "give year-month-day, e.g. 2026-03-01");
  for (const Condition& one : conditions_of(filter))
    check_known(store, one.option, one.value, one.known);
  if (filter.run) require_run(store, *filter.run);
  if (filter.calibration.empty()) return;
  std::string names;
  for (const auto& [sha256, name] : store.rows<std::string, std::string>(
           "SELECT sha256, '' FROM calibration UNION SELECT calibration_sha256, calibration_name "
           "FROM run WHERE calibration_sha256 IS NOT NULL ORDER BY 1")) {
    if (sha256.starts_with(filter.calibration) ||
        name.find(filter.calibration) != std::string::npos)
      return;
    names += (names.empty() ? "" : "; ") + sha256.substr(0, 12) +
             (name.empty() ? "" : " (" + name + ")");
  }
  throw usage_error(fmt::format("nothing in the store has calibration `{}`", filter.calibration),
                    "there is: " + (names.empty() ? "none" : names));
}

Selection selection_of(const StoreReader& store, const ResultFilter& filter) {
  check_filter(store, filter);
  Selection selection;
  Cells& parameters = selection.parameters;
  const std::string window = window_of(filter, parameters);
  selection.from = fmt::format("v_comparison AS v JOIN ({}) AS s ON s.comparison_id = v.id",
                               state_query(window));
  selection.add(filter);
  if (!window.empty()) {
    selection.where += " AND v.id IN (SELECT comparison_id FROM run_comparison WHERE run IN (";
    selection.where += runs_of(filter, parameters) + ")";
    if (!filter.run)
      selection.where += R"sql( UNION ALL SELECT c.id FROM comparison AS c
  JOIN sheet AS m ON m.sha256 = c.measured_sha256 JOIN recording AS r ON r.sha256 = m.recording_sha256
WHERE NOT EXISTS (SELECT 1 FROM run_comparison WHERE comparison_id = c.id))sql" +
                         between_dates("r.recorded_on", filter, parameters);
    selection.where += ")";
  }
  if (!filter.calibration.empty()) {
    // The second part is redundant, but finds these few rows first.
    selection.where += R"sql( AND (substr(v.calibration_sha256, 1, length(?)) = ?
  OR instr(s.calibration, ?) > 0) AND v.id IN (
  SELECT id FROM comparison WHERE measured_sha256 IN (
    SELECT sha256 FROM sheet WHERE substr(calibration_sha256, 1, length(?)) = ?)
  UNION SELECT comparison_id FROM run_comparison WHERE run IN (
    SELECT number FROM run WHERE instr(calibration_name, ?) > 0)))sql";
    parameters.insert(parameters.end(), 6, Cell(filter.calibration));
  }
  if (!filter.outdated && !filter.run)
    selection.where += " AND coalesce(s.state, 'current') = 'current'";
  return selection;
}

std::vector<Metric> metric_dictionary(const StoreReader& store) {
  return store.rows<std::string, std::string, std::string>(
      "SELECT name, unit, definition FROM metric ORDER BY name");
}

StoredKey stored_key(const StoreReader& store, const std::string& key,
                     const std::vector<std::string>& tables) {
  std::string query;
  for (const std::string& table : tables) {
    query += fmt::format("{}SELECT '{}', sha256 FROM {} WHERE substr(sha256, 1, length(?1)) = ?1",
                         query.empty() ? "" : " UNION ALL ", table, table);
  }
  const auto found = store.rows<std::string, std::string>(query, {key});
  if (found.size() == 1) return found[0];
  throw usage_error(fmt::format("{} rows have a key that starts with `{}`", found.size(), key),
                    "take a key from the column `comparison` of drape-results list or tables");
}

void require_comparisons(const StoreReader& store, const std::set<std::string>& keys) {
  Printed printed{.marks = true};
  for (const std::string& key : keys)
    for (const auto& [id, run] : store.rows<std::int64_t, std::optional<std::int64_t>>(
             "SELECT id, (SELECT max(run) FROM run_comparison WHERE comparison_id = id) FROM "
             "comparison WHERE sha256 = ?",
             {key})) {
      printed.comparisons.insert(id);
      if (run) printed.runs.insert(*run);
    }
  store.require_as_written(printed);
}

Table list_results(const StoreReader& store, const ResultFilter& filter) {
  const Selection selection = selection_of(store, filter);
  Table list = store.query(R"sql(
SELECT comparison, s.run, substr(s.date, 1, 10) AS date,
  coalesce(s.measurement, 'not stated') AS measurement, coalesce(s.state, 'current') AS state,
  scene, discretisation, segments, begins, round(mean_dist_mm, 3) AS mean_dist_mm,
  round(sigma_mean_mm, 4) AS sigma_mean_mm, round(max_mm, 3) AS max_mm,
  round(mean_percent_of_warp_side, 2) AS mean_percent_of_warp_side,
  round(mean_percent_of_weft_side, 2) AS mean_percent_of_weft_side, marks, gaps, fabric, simulator,
  status, branch, recorded_on, measured, s.cause AS cause, v.id FROM )sql" +
                               selection.from + selection.where + " " + kInOrder,
                           selection.parameters);
  Printed printed;
  for (auto& row : list.rows) {
    printed.comparisons.insert(std::stoll(row.back()));
    if (!row[1].empty()) printed.runs.insert(std::stoll(row[1]));
    row.pop_back();
  }
  list.names.pop_back();
  list.numeric.pop_back();
  store.require_as_written(printed);
  return list;
}

Answer show_result(const StoreReader& store, const std::string& key) {
  const auto& [table, full] = stored_key(store, key);
  if (table != "comparison") {
    store.require_as_written(table, {full});
    Table metrics =
        metrics_of(store, store.query("SELECT * FROM surface_comparison WHERE sha256 = ?", {full}));
    Table provenance = turned(store.query(fmt::format(R"sql(
SELECT z.run, substr(z.date, 1, 10) AS date, coalesce(z.measurement, 'not stated') AS measurement,
  z.cause, coalesce(z.state, 'current') AS state, p.scene, p.simulator, p.fabric_stated AS fabric,
  m.rig_name AS rig, m.set_name AS measured_set, p.marks, m.gaps, p.points, p.triangles,
  p.sha256 AS comparison_sha256, p.measured_sha256, p.mesh_sha256, m.detections_sha256,
  m.calibration_sha256
FROM surface_comparison AS p JOIN sheet AS m ON m.sha256 = p.measured_sha256
  JOIN ({}) AS z ON z.sheet_sha256 = p.measured_sha256 WHERE p.sha256 = ?)sql",
                                                      sheet_state_query()),
                                          {full}));
    return {{}, {std::move(metrics), std::move(provenance), Table()}};
  }
  require_comparisons(store, {full});
  Table metrics = metrics_of(
      store, store.query("SELECT c.*, m.sigma_median_mm, m.sigma_max_mm FROM comparison AS c JOIN "
                         "sheet AS m ON m.sha256 = c.measured_sha256 WHERE c.sha256 = ?",
                         {full}));
  Table provenance = turned(store.query(fmt::format(R"sql(
SELECT z.run, substr(z.date, 1, 10) AS date, coalesce(z.measurement, 'not stated') AS measurement,
  z.cause, coalesce(z.state, 'current') AS state, z.match, z.match_reason, s.scene,
  {} AS discretisation, s.segments, CASE s.from_measured WHEN 1 THEN 'measured shape' END AS begins,
  s.simulator, coalesce(f.name, s.fabric_stated) AS fabric, s.model, s.solver, s.status,
  m.rig_name AS rig, m.set_name AS measured_set, c.marks, m.gaps, k.method AS calibration_method,
  c.sha256 AS comparison_sha256, c.measured_sha256, c.simulated_sha256, m.detections_sha256,
  m.calibration_sha256, s.scene_sha256, s.fabric_sha256, s.start_sha256, s.certificate_sha256,
  (SELECT rest_sha256 FROM refinement WHERE sheet_sha256 = s.sheet_sha256) AS refined_from_sha256,
  s.certificate_json AS certificate
FROM comparison AS c JOIN sheet AS m ON m.sha256 = c.measured_sha256
  JOIN simulation AS s ON s.sheet_sha256 = c.simulated_sha256
  LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256
  LEFT JOIN calibration_file AS k ON k.calibration_sha256 = m.calibration_sha256
  JOIN ({}) AS z ON z.comparison_id = c.id WHERE c.sha256 = ?)sql",
                                                    kDiscretisation, state_query()),
                                        {full}));
  Table marks = store.query(R"sql(
SELECT "row", "col", round(distance_mm, 3) AS distance_mm, round(along_warp_mm, 3) AS along_warp_mm,
  round(along_weft_mm, 3) AS along_weft_mm, round(along_normal_mm, 3) AS along_normal_mm,
  round(sigma_distance_mm, 4) AS sigma_distance_mm, views FROM mark_error
WHERE comparison_id = (SELECT id FROM comparison WHERE sha256 = ?) ORDER BY "row", "col")sql",
                            {full});
  return {{}, {std::move(metrics), std::move(provenance), std::move(marks)}};
}

Table list_runs(const StoreReader& store, const ResultFilter& filter) {
  check_filter(store, filter);
  Cells parameters;
  std::string sql = "SELECT * FROM v_run WHERE run IN (";
  sql += runs_of(filter, parameters) + ")";
  const auto add = [&](const std::string& condition, const std::string& value, std::size_t times) {
    if (value.empty()) return;
    sql += " AND " + condition;
    parameters.insert(parameters.end(), times, Cell(value));
  };
  add("rig = ?", filter.rig, 1);
  add("run IN (SELECT run FROM run_drape WHERE scene = ?)", filter.scene, 1);
  // A run without calibration.json can still have sheets that were measured with one.
  add(R"sql(run IN (
SELECT number FROM run WHERE substr(calibration_sha256, 1, length(?)) = ?
  OR instr(calibration_name, ?) > 0
UNION SELECT d.run FROM run_drape AS d JOIN sheet AS m ON m.sha256 = d.measured_sha256
  WHERE substr(m.calibration_sha256, 1, length(?)) = ?))sql",
      filter.calibration, 5);
  Table runs = store.query(sql + " ORDER BY run", parameters);
  Printed printed{.values = true};
  for (const auto& row : runs.rows) printed.runs.insert(std::stoll(row.front()));
  store.require_as_written(printed);
  return runs;
}

Table export_table(const StoreReader& store, const std::string& name) {
  // The lists of comparisons are based on this view, which itself has no verdict.
  if (name == "v_comparison")
    return store.query(
        "SELECT v.*, s.run, s.measurement, s.cause, s.state FROM v_comparison AS v LEFT JOIN "
        "v_state AS s ON s.comparison_id = v.id");
  const auto known = store.column<std::string>(
      "SELECT name FROM sqlite_master WHERE type IN ('table', 'view') ORDER BY name");
  if (std::find(known.begin(), known.end(), name) != known.end())
    return store.query(fmt::format("SELECT * FROM \"{}\"", name));
  throw usage_error(fmt::format("the store has no table or view `{}`", name),
                    fmt::format("it has: {}", fmt::join(known, ", ")));
}

std::string dump_sql(const StoreReader& store) {
  std::string text = fmt::format(
      "PRAGMA application_id = {};\nPRAGMA user_version = {};\nPRAGMA foreign_keys = "
      "OFF;\nBEGIN;\n",
      kApplicationId, store_version());
  const auto objects = store.rows<std::string, std::string, std::string>(
      "SELECT type, name, sql FROM sqlite_master WHERE sql IS NOT NULL ORDER BY type = 'view', "
      "type = 'trigger', type = 'index', rowid");
  for (const auto& [type, name, sql] : objects) text += sql + ";\n";
  for (const auto& [type, name, sql] : objects) {
    if (type != "table") continue;
    const auto values = store.column<std::string>(
        R"(SELECT 'quote("' || name || '")' FROM pragma_table_info(?))", {name});
    for (const std::string& line : store.column<std::string>(
             fmt::format("SELECT {} FROM \"{}\"", fmt::join(values, " || ', ' || "), name)))
      text += fmt::format("INSERT INTO \"{}\" VALUES ({});\n", name, line);
  }
  return text + "COMMIT;\n";
}

void require_run(const StoreReader& store, int number) {
  if (!store.rows<int>("SELECT 1 FROM run WHERE number = ?", {number}).empty()) return;
  const auto last = store.column<int>("SELECT max(number) FROM run");
  throw usage_error(fmt::format("there is no run {}", number),
                    fmt::format("the store has runs 1 to {}: drape-results runs", last[0]));
}

Answer difference_of_runs(const StoreReader& store, int first, int second) {
  require_run(store, first);
  require_run(store, second);
  store.require_as_written({.runs = {first, second}, .values = true});
  Table values = store.query(R"sql(
WITH of_run AS (
  SELECT run, owner, key, value, stand_in FROM run_value
  UNION ALL SELECT number, 'run', 'calibration', substr(calibration_sha256, 1, 12), 0 FROM run
  UNION ALL SELECT number, 'run', 'recording', substr(recording_sha256, 1, 12), 0 FROM run
  UNION ALL SELECT number, 'run', 'program version', program_version, 0 FROM run),
a AS (SELECT * FROM of_run WHERE run = ?1), b AS (SELECT * FROM of_run WHERE run = ?2)
SELECT owner, key, a.value AS first, b.value AS second,
  max(a.stand_in, coalesce(b.stand_in, 0)) AS stand_in
FROM a LEFT JOIN b USING (owner, key) WHERE a.value IS NOT b.value
UNION ALL SELECT owner, key, NULL, b.value, b.stand_in FROM b LEFT JOIN a USING (owner, key)
WHERE a.run IS NULL ORDER BY 1, 2)sql",
                             {first, second});
  values.title = fmt::format("What differs between run {} and run {}", first, second);
  std::string sentence;
  const auto shown = [](const std::string& value) { return value.empty() ? "(absent)" : value; };
  for (const auto& row : values.rows)
    sentence += fmt::format("{}{} {} {} -> {}", sentence.empty() ? "" : "; ", row[0], row[1],
                            shown(row[2]), shown(row[3]));
  if (sentence.empty()) sentence = "no value differs";
  Table drapes = store.query(fmt::format(R"sql(
SELECT d.run, d.scene, d.discretisation, d.segments, round(d.mean_dist_mm, 3) AS mean_dist_mm,
  round(d.expanded_uncertainty_mm, 3) AS expanded_uncertainty_mm, {}, d.measurement, d.match,
  d.match_rests_on FROM v_run_drape AS d WHERE d.run IN (?1, ?2) ORDER BY d.scene, d.run)sql",
                                         kUncertaintyIs),
                             {first, second});
  drapes.title = "Their drapes";
  return {sentence, {std::move(values), std::move(drapes)}};
}

/// Every value with its series, unit, label, verdict (GO, NO-GO, or NULL if in no run), number in
/// the series, whether it is the newest; and count, sum and sum of squares of the earlier values of
/// its series without those that are NO-GO, which say nothing about usual ones. Values of a series
/// are in the order of their first runs. The braces are replaced by state_query().
constexpr const char* kSeries = R"sql(
WITH all_values(part, place, name, first, id, unit, label, value, verdict) AS (
SELECT 1, k.rig_name, 'calibration residual ' || k.rig_name || ' ' || c.camera,
  (SELECT min(r.date) FROM run AS r WHERE r.calibration_sha256 = k.sha256), l.sequence, 'px',
  substr(c.calibration_sha256, 1, 12), c.rms_px, (SELECT max(CASE WHEN d.cause LIKE
    'the calibration is NO-GO:%' THEN 'NO-GO' ELSE 'GO' END)
    FROM run AS q JOIN run_drape AS d ON d.run = q.number WHERE q.calibration_sha256 = k.sha256)
FROM calibration_camera AS c JOIN calibration AS k ON k.sha256 = c.calibration_sha256
  JOIN listed AS l ON l.kind = 'calibration_file' AND l.key = c.calibration_sha256
WHERE ?1 = ''
UNION ALL SELECT 2, f.unit || ' ' || a.rig_name, 'acceptance ' || a.rig_name || ' ' || f.name,
  a.date, l.sequence, f.unit, coalesce(a.date, substr(a.sha256, 1, 12)), f.value, f.verdict
FROM acceptance_figure AS f JOIN acceptance AS a ON a.sha256 = f.acceptance_sha256
  JOIN listed AS l ON l.kind = 'acceptance' AND l.key = a.sha256
WHERE f.value IS NOT NULL AND ?1 = ''
UNION ALL SELECT 3, '', 'mean distance ' || v.rig || ' ' || v.scene || ' ' ||
  coalesce(v.fabric, '') || ' ' || v.discretisation || coalesce(' ' || v.segments || ' seg ', ' ') ||
  v.simulator || ' ' || v.model || coalesce(' ' || v.solver, '') ||
  CASE v.begins WHEN 'scene' THEN '' ELSE ' from the ' || v.begins END ||
  coalesce(', friction ' || f.value, ''),
  (SELECT min(q.date) FROM run_comparison AS k JOIN v_run_moment AS q ON q.run = k.run
    WHERE k.comparison_id = v.id), v.id, 'mm', v.comparison, v.mean_dist_mm, s.measurement
FROM v_comparison AS v JOIN ({}) AS s ON s.comparison_id = v.id
  LEFT JOIN run_value AS f ON f.run = s.run AND f.owner = 'scene ' || v.scene AND f.key = 'friction'
WHERE v.branch IS NULL AND coalesce(s.measurement, 'GO') = 'GO'
  AND (?1 = '' OR v.scene = ?1 OR v.scene || '/' || v.fabric = ?1))
SELECT name, unit, label, value, verdict, row_number() OVER series, lead(id) OVER series IS NULL,
  count(*) FILTER (WHERE verdict IS NOT 'NO-GO') OVER before,
  sum(value) FILTER (WHERE verdict IS NOT 'NO-GO') OVER before,
  sum(value * value) FILTER (WHERE verdict IS NOT 'NO-GO') OVER before
FROM all_values WINDOW series AS (PARTITION BY name ORDER BY first, id),
  before AS (series ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING)
ORDER BY part, place, name, first, id)sql";

Trend trend_of(const StoreReader& store, const TrendOptions& options) {
  if (options.least_before < 2 || !(options.alarm_sigmas > 0))
    throw usage_error("a trend needs at least 2 values before and an alarm above 0 sigma", "");
  check_known(store, kSpecimen, options.specimen, kSpecimens);
  store.require_as_written(std::vector<std::string>{
      "calibration", "calibration_camera", "acceptance", "acceptance_figure", "comparison", "sheet",
      "simulation", "fabric", "run", "run_drape", "run_value"});
  Trend trend;
  trend.table = Table({"series", "n", "run", "value", "unit", "mean_before", "s_before", "sigmas",
                       "alarm", "measurement"},
                      {1, 3, 5, 6, 7});
  using Text = std::string;
  for (const auto& [name, unit, label, value, verdict, number, is_newest, n, sum, squares] :
       store.rows<Text, Text, Text, double, Text, Text, bool, double, double, double>(
           fmt::format(fmt::runtime(kSeries), state_query()), {options.specimen})) {
    std::vector<Text> cells = {name, number, label,  fmt::format("{:.4f}", value), unit, "", "",
                               "",   "",     verdict};
    if (n >= options.least_before) {
      const double mean = sum / n;
      const double s = std::sqrt(std::max(0.0, (squares - n * mean * mean) / (n - 1)));
      const double spread = s * std::sqrt(1 + 1 / n);
      const double off = value - mean;
      const bool alarm = std::abs(off) > options.alarm_sigmas * spread;
      trend.alarms += alarm && is_newest;
      cells[5] = fmt::format("{:.4f}", mean);
      cells[6] = fmt::format("{:.4f}", s);
      cells[7] = spread > 0 ? fmt::format("{:+.1f}", off / spread) : off == 0 ? "0" : "";
      cells[8] = alarm ? "ALARM" : "";
    }
    trend.table.add(std::move(cells));
  }
  return trend;
}

using Values = std::map<std::string, std::string>;

/// The keys that a trend by ?1 asks for. Goes from key to key by the index: DISTINCT would read
/// every value of every run.
constexpr const char* kAsked = R"sql(WITH RECURSIVE each(key) AS (SELECT min(key) FROM run_value
  UNION ALL SELECT (SELECT min(v.key) FROM run_value AS v WHERE v.key > each.key) FROM each
  WHERE each.key IS NOT NULL),
asked AS (SELECT key FROM each WHERE key = ?1 OR key LIKE '%.' || ?1))sql";

/// Numbers the rows of each scene by the values they share apart from those of the trend's key,
/// and names the differences from the first of them. The last column comes with the fabric's name.
static void set_series_apart(const StoreReader& store, const std::string& key, Table& table) {
  std::map<std::pair<std::string, std::string>, Values> values;  // by run and scene
  for (auto& [run, scene, name, value] :
       store.rows<std::string, std::string, std::string, std::string>(
           fmt::format(R"sql(
SELECT d.run, d.scene, x.owner || ' ' || x.key, x.value FROM v_run_drape AS d
  JOIN run_value AS x ON x.run = d.run AND x.owner IN ('scene ' || d.scene, 'calibration'{})
WHERE x.key <> ?1 AND x.key NOT LIKE '%.' || ?1)sql",
                       key == "fabric" ? "" : ", 'fabric ' || d.fabric"),
           {key}))
    values[{run, scene}][name] = std::move(value);
  const auto at = [&](const char* name) { return *table.column(name); };
  const std::size_t scene = at("scene"), run = at("run"), series = at("series"),
                    mesh = at("discretisation"), segments = at("segments"),
                    otherwise = at("otherwise");
  std::map<std::string, std::vector<Values>> known;
  for (auto& row : table.rows) {
    Values all = values[{row[run], row[scene]}];
    all["discretisation"] = row[mesh];
    all["segments"] = row[segments];
    if (key != "fabric") all["fabric"] = row[otherwise];
    std::vector<Values>& of_scene = known[row[scene]];
    const auto same = std::find(of_scene.begin(), of_scene.end(), all);
    row[series] = std::to_string(same - of_scene.begin() + 1);
    if (same == of_scene.end()) of_scene.push_back(all);
    constexpr int kNamed = 3;
    int differ = 0;
    row[otherwise].clear();
    for (const auto& [name, value] : all) {
      const auto first = of_scene.front().find(name);
      const std::string old = first == of_scene.front().end() ? "absent" : first->second;
      if (old == value || ++differ > kNamed) continue;
      row[otherwise] += fmt::format("{}{} {} -> {}", differ == 1 ? "" : ", ", name, old, value);
    }
    if (differ > kNamed) row[otherwise] += fmt::format(" and {} more", differ - kNamed);
  }
  std::stable_sort(table.rows.begin(), table.rows.end(), [&](const auto& one, const auto& other) {
    return std::pair(one[scene], std::stoi(one[series])) <
           std::pair(other[scene], std::stoi(other[series]));
  });
}

Table trend_by(const StoreReader& store, const std::string& key, const std::string& specimen) {
  store.require_as_written(std::vector<std::string>{"run", "run_drape", "run_match", "run_value",
                                                    "comparison", "simulation", "fabric"});
  check_known(store, kSpecimen, specimen, kSpecimens);
  std::string value = "d." + key, with;
  if (key != "fabric" && key != "label" && key != "scene") {
    if (store.column<std::string>(fmt::format("{} SELECT key FROM asked", kAsked), {key}).empty()) {
      auto names = store.column<std::string>("SELECT DISTINCT key FROM run_value ORDER BY key");
      names.insert(names.begin(), {"fabric", "label"});
      throw usage_error(fmt::format("no run has a value `{}`{}", key, did_you_mean(key, names)),
                        "see the keys with: drape-results sql \"SELECT DISTINCT owner, key FROM "
                        "run_value\"");
    }
    value =
        "(SELECT group_concat(v.value, ', ') FROM chosen AS v WHERE v.run = d.run AND v.owner IN "
        "('scene ' || d.scene, 'fabric ' || d.fabric, 'calibration'))";
    with = std::string(kAsked) +
           ", chosen AS MATERIALIZED (SELECT run, owner, value FROM run_value WHERE key IN (SELECT "
           "key FROM asked) ORDER BY run, owner, key)";
  }
  Table table = store.query(fmt::format(R"sql({}
SELECT d.scene, {} AS by_value, '' AS series, d.run, substr(d.date, 1, 10) AS date,
  d.discretisation, d.segments, round(d.mean_dist_mm, 3) AS mean_dist_mm,
  round(d.expanded_uncertainty_mm, 3) AS expanded_uncertainty_mm, {}, d.measurement, d.match,
  d.match_rests_on, coalesce(d.fabric, '') AS otherwise
FROM v_run_drape AS d WHERE ?2 = '' OR d.scene = ?2 OR d.scene || '/' || d.fabric = ?2
ORDER BY d.scene, by_value, d.date, d.run)sql",
                                        with, value, kUncertaintyIs),
                            {key, specimen});
  set_series_apart(store, key, table);
  table.names[1] = key;
  return table;
}

}  // namespace drape::compare
