// SPDX-License-Identifier: Apache-2.0
#include "compare/history/results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "compare/schema/schema.hpp"
#include "compare/store/runs.hpp"
#include "core/error.hpp"
#include "core/program/similar.hpp"

namespace drape::compare {
namespace {

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
  if (found.size() == 1) return {std::get<0>(found[0]), std::get<1>(found[0])};
  throw usage_error(fmt::format("{} rows have a key that starts with `{}`", found.size(), key),
                    "take a key from the column `comparison` of drape-results list or tables");
}

void require_comparisons(const StoreReader& store, const std::set<std::string>& keys) {
  Printed printed;
  printed.marks = true;
  for (const std::string& key : keys)
    for (const auto& [id] :
         store.rows<std::int64_t>("SELECT id FROM comparison WHERE sha256 = ?", {key}))
      printed.comparisons.insert(id);
  for (const std::int64_t id : printed.comparisons)
    for (const auto& [run] : store.rows<std::int64_t>(
             "SELECT max(run) FROM run_comparison WHERE comparison_id = ? HAVING max(run) IS NOT "
             "NULL",
             {id}))
      printed.runs.insert(run);
  store.require_as_written(printed);
}

std::string full_key(const StoreReader& store, const std::string& key) {
  const StoredKey found = stored_key(store, key);
  if (found.table == "comparison") return found.sha256;
  throw usage_error(fmt::format("`{}` compares a surface without marks", key),
                    "see it with drape-results show or why");
}

Table list_results(const StoreReader& store, const ResultFilter& filter) {
  const Selection selection = selection_of(store, filter);
  Table list = store.query(
      "SELECT comparison, s.run, substr(s.date, 1, 10) AS date, coalesce(s.measurement, 'not "
      "stated') "
      "AS measurement, coalesce(s.state, 'current') AS state, "
      "scene, discretisation, segments, begins, round(mean_dist_mm, 3) AS mean_dist_mm, "
      "round(sigma_mean_mm, 4) AS sigma_mean_mm, round(max_mm, 3) AS max_mm, "
      "round(mean_percent_of_warp_side, 2) AS mean_percent_of_warp_side, "
      "round(mean_percent_of_weft_side, 2) AS mean_percent_of_weft_side, marks, gaps, fabric, "
      "simulator, status, branch, recorded_on, measured, s.cause AS cause, v.id FROM " +
          selection.from + selection.where + in_order(),
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

namespace {

ShownResult show_surface(const StoreReader& store, const std::string& full) {
  store.require_as_written("surface_comparison", {full});
  const Table row = store.query("SELECT * FROM surface_comparison WHERE sha256 = ?", {full});
  ShownResult shown;
  shown.metrics = metrics_of(store, row);
  shown.provenance = turned(store.query(
      "SELECT z.run, substr(z.date, 1, 10) AS date, coalesce(z.measurement, 'not stated') AS "
      "measurement, z.cause, coalesce(z.state, 'current') AS state, p.scene, p.simulator, "
      "p.fabric_stated AS fabric, m.rig_name AS rig, m.set_name AS "
      "measured_set, p.marks, m.gaps, p.points, p.triangles, p.sha256 AS comparison_sha256, "
      "p.measured_sha256, p.mesh_sha256, m.detections_sha256, m.calibration_sha256 FROM "
      "surface_comparison AS p JOIN sheet AS m ON m.sha256 = p.measured_sha256 JOIN (" +
          sheet_state_query() + ") AS z ON z.sheet_sha256 = p.measured_sha256 WHERE p.sha256 = ?",
      {full}));
  return shown;
}

}  // namespace

ShownResult show_result(const StoreReader& store, const std::string& key) {
  const StoredKey stored = stored_key(store, key);
  if (stored.table != "comparison") return show_surface(store, stored.sha256);
  const std::string& full = stored.sha256;
  require_comparisons(store, {full});
  ShownResult shown;
  shown.metrics = metrics_of(
      store, store.query("SELECT c.*, m.sigma_median_mm, m.sigma_max_mm FROM comparison AS c JOIN "
                         "sheet AS m ON m.sha256 = c.measured_sha256 WHERE c.sha256 = ?",
                         {full}));
  shown.provenance = turned(store.query(
      "SELECT z.run, substr(z.date, 1, 10) AS date, coalesce(z.measurement, 'not stated') AS "
      "measurement, z.cause, coalesce(z.state, 'current') AS state, z.match, z.match_reason, "
      "s.scene, " +
          std::string(kDiscretisation) +
          " AS discretisation, s.segments, CASE s.from_measured WHEN 1 THEN 'measured shape' END "
          "AS "
          "begins, s.simulator, "
          "coalesce(f.name, s.fabric_stated) AS fabric, s.model, s.solver, s.status, m.rig_name AS "
          "rig, m.set_name AS measured_set, "
          "c.marks, m.gaps, k.method AS calibration_method, c.sha256 AS comparison_sha256, "
          "c.measured_sha256, c.simulated_sha256, m.detections_sha256, m.calibration_sha256, "
          "s.scene_sha256, s.fabric_sha256, s.start_sha256, s.certificate_sha256, "
          "(SELECT rest_sha256 FROM refinement WHERE sheet_sha256 = s.sheet_sha256) AS "
          "refined_from_sha256, "
          "s.certificate_json AS certificate FROM comparison AS c JOIN sheet AS m ON m.sha256 = "
          "c.measured_sha256 JOIN simulation AS s ON s.sheet_sha256 = c.simulated_sha256 LEFT JOIN "
          "fabric "
          "AS f ON f.sha256 = s.fabric_sha256 LEFT JOIN calibration_file AS k ON "
          "k.calibration_sha256 "
          "= "
          "m.calibration_sha256 JOIN (" +
          state_query() + ") AS z ON z.comparison_id = c.id WHERE c.sha256 = ?",
      {full}));
  shown.marks = store.query(
      "SELECT \"row\", \"col\", round(distance_mm, 3) AS distance_mm, round(along_warp_mm, 3) AS "
      "along_warp_mm, round(along_weft_mm, 3) AS along_weft_mm, round(along_normal_mm, 3) AS "
      "along_normal_mm, round(sigma_distance_mm, 4) AS sigma_distance_mm, views FROM mark_error "
      "WHERE comparison_id = (SELECT id FROM comparison WHERE sha256 = ?) ORDER BY \"row\", "
      "\"col\"",
      {full});
  return shown;
}

Table list_runs(const StoreReader& store, const ResultFilter& filter) {
  check_filter(store, filter);
  Cells parameters;
  std::string sql = "SELECT * FROM v_run WHERE run IN (";
  sql += runs_of(filter, parameters) + ")";
  const auto add = [&](const std::string& condition, const std::string& value, int times) {
    if (value.empty()) return;
    sql += " AND " + condition;
    parameters.insert(parameters.end(), static_cast<std::size_t>(times), Cell(value));
  };
  add("rig = ?", filter.rig, 1);
  add("run IN (SELECT run FROM run_drape WHERE scene = ?)", filter.scene, 1);
  // A run without calibration.json can still have sheets that were measured with one.
  add("run IN (SELECT number FROM run WHERE substr(calibration_sha256, 1, length(?)) = ? OR "
      "instr(calibration_name, ?) > 0 UNION SELECT d.run FROM run_drape AS d JOIN sheet AS m ON "
      "m.sha256 = d.measured_sha256 WHERE substr(m.calibration_sha256, 1, length(?)) = ?)",
      filter.calibration, 5);
  Table runs = store.query(sql + " ORDER BY run", parameters);
  Printed printed;
  printed.values = true;
  for (const auto& row : runs.rows) printed.runs.insert(std::stoll(row.front()));
  store.require_as_written(printed);
  return runs;
}

namespace {

/// Values of every run by owner, except those with these keys.
using Values = std::map<std::string, std::string>;
using ValuesOfRuns = std::map<std::string, std::map<std::string, Values>>;

ValuesOfRuns other_values(const StoreReader& store, const Cells& keys, const std::string& key) {
  std::string list;
  for (std::size_t i = 0; i < keys.size(); ++i) list += fmt::format("{}?", i == 0 ? "" : ", ");
  ValuesOfRuns values;
  for (auto& [run, owner, name, value] :
       store.rows<std::string, std::string, std::string, std::string>(
           fmt::format(
               "SELECT run, owner, key, value FROM run_value WHERE (owner LIKE 'scene %' OR "
               "owner LIKE 'fabric %' OR owner = 'calibration') AND key NOT IN ({})",
               list),
           keys))
    if (name != key) values[run][owner][name] = std::move(value);
  return values;
}

/// Numbers the rows of each scene by the values they share apart from that of the trend, and names
/// the differences from the first of them. The last column comes with the fabric's name.
void set_series_apart(Table& table, const ValuesOfRuns& runs, bool by_fabric) {
  const auto at = [&](const char* name) { return *table.column(name); };
  const std::size_t scene = at("scene"), run = at("run"), series = at("series"),
                    mesh = at("discretisation"), segments = at("segments"),
                    otherwise = at("otherwise");
  std::map<std::string, std::vector<Values>> known;
  for (auto& row : table.rows) {
    Values all = {{"discretisation", row[mesh]}, {"segments", row[segments]}};
    const auto add = [&](const std::string& owner) {
      const auto values = runs.find(row[run]);
      if (values == runs.end() || !values->second.contains(owner)) return;
      for (const auto& [name, value] : values->second.at(owner)) all[owner + " " + name] = value;
    };
    add("scene " + row[scene]);
    add("calibration");
    if (!by_fabric) {
      all["fabric"] = row[otherwise];
      add("fabric " + row[otherwise]);
    } else {
      all.erase("scene " + row[scene] + " fabric");
    }
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

}  // namespace

Table trend_by(const StoreReader& store, const std::string& key, const std::string& specimen) {
  store.require_as_written(std::vector<std::string>{"run", "run_drape", "run_match", "run_value",
                                                    "comparison", "simulation", "fabric"});
  check_specimen(store, specimen);
  std::string value = "d." + key, chosen;
  Cells keys;
  if (key != "fabric" && key != "label" && key != "scene") {
    std::string list;
    for (const auto& [found] : store.rows<std::string>(
             // Goes from key to key by the index: DISTINCT would read every value of every run.
             "WITH RECURSIVE each(key) AS (SELECT min(key) FROM run_value UNION ALL SELECT (SELECT "
             "min(v.key) FROM run_value AS v WHERE v.key > each.key) FROM each WHERE each.key IS "
             "NOT NULL) SELECT key FROM each WHERE key = ?1 OR key LIKE '%.' || ?1",
             {key})) {
      keys.push_back(found);
      list += fmt::format("{}?{}", list.empty() ? "" : ", ", keys.size());
    }
    value =
        "(SELECT group_concat(v.value, ', ') FROM chosen AS v WHERE v.run = d.run AND v.owner IN "
        "('scene ' || d.scene, 'fabric ' || d.fabric, 'calibration'))";
    chosen = fmt::format(
        "WITH chosen AS MATERIALIZED (SELECT run, owner, value FROM run_value WHERE key IN ({}) "
        "ORDER BY run, owner, key) ",
        list);
  }
  if (value.front() == '(' && keys.empty()) {
    std::vector<std::string> names = {"fabric", "label"};
    for (const auto& [known] :
         store.rows<std::string>("SELECT DISTINCT key FROM run_value ORDER BY key"))
      names.push_back(known);
    throw usage_error(fmt::format("no run has a value `{}`{}", key, did_you_mean(key, names)),
                      "see the keys with: drape-results sql \"SELECT DISTINCT owner, key FROM "
                      "run_value\"");
  }
  std::string of_specimen;
  if (!specimen.empty()) {
    keys.push_back(specimen);
    of_specimen =
        fmt::format(" WHERE d.scene = ?{0} OR d.scene || '/' || d.fabric = ?{0}", keys.size());
  }
  Table table = store.query(
      chosen + "SELECT d.scene, " + value +
          " AS by_value, '' AS series, d.run, substr(d.date, 1, 10) AS date, d.discretisation, "
          "d.segments, "
          "round(d.mean_dist_mm, 3) AS mean_dist_mm, round(d.expanded_uncertainty_mm, 3) AS "
          "expanded_uncertainty_mm, " +
          kUncertaintyIs +
          ", d.measurement, d.match, d.match_rests_on, coalesce(d.fabric, '') AS otherwise FROM "
          "v_run_drape AS d" +
          of_specimen + " ORDER BY d.scene, by_value, d.date, d.run",
      keys);
  if (!specimen.empty()) keys.pop_back();
  set_series_apart(table, other_values(store, keys, key), key == "fabric");
  table.names[1] = key;
  return table;
}

Table export_table(const StoreReader& store, const std::string& name) {
  std::string names;
  // The lists of comparisons are based on this view, which itself has no verdict.
  if (name == "v_comparison")
    return store.query(
        "SELECT v.*, s.run, s.measurement, s.cause, s.state FROM v_comparison AS v LEFT JOIN "
        "v_state AS s ON s.comparison_id = v.id");
  for (const auto& [known] : store.rows<std::string>(
           "SELECT name FROM sqlite_master WHERE type IN ('table', 'view') ORDER BY name")) {
    if (known == name) return store.query(fmt::format("SELECT * FROM \"{}\"", name));
    names += (names.empty() ? "" : ", ") + known;
  }
  throw usage_error(fmt::format("the store has no table or view `{}`", name), "it has: " + names);
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
    std::string values;
    for (const auto& [column] :
         store.rows<std::string>("SELECT name FROM pragma_table_info(?) ORDER BY cid", {name}))
      values += fmt::format("{}quote(\"{}\")", values.empty() ? "" : " || ', ' || ", column);
    for (const auto& [line] :
         store.rows<std::string>(fmt::format("SELECT {} FROM \"{}\"", values, name)))
      text += fmt::format("INSERT INTO \"{}\" VALUES ({});\n", name, line);
  }
  return text + "COMMIT;\n";
}

void require_run(const StoreReader& store, int number) {
  if (!store.rows<int>("SELECT 1 FROM run WHERE number = ?", {number}).empty()) return;
  const auto last = store.rows<int>("SELECT max(number) FROM run");
  throw usage_error(
      fmt::format("there is no run {}", number),
      fmt::format("the store has runs 1 to {}: drape-results runs", std::get<0>(last[0])));
}

RunDifference difference_of_runs(const StoreReader& store, int first, int second) {
  require_run(store, first);
  require_run(store, second);
  store.require_as_written({.runs = {first, second}, .values = true});
  RunDifference difference;
  difference.values = store.query(
      "WITH a AS (SELECT owner, key, value, stand_in FROM run_value WHERE run = ?1), b AS (SELECT "
      "owner, key, value, stand_in FROM run_value WHERE run = ?2), of_run AS (SELECT number, "
      "'calibration' AS what, substr(calibration_sha256, 1, 12) AS value FROM run UNION ALL SELECT "
      "number, 'recording', substr(recording_sha256, 1, 12) FROM run UNION ALL SELECT number, "
      "'program version', program_version FROM run) SELECT owner, key, a.value AS first, b.value "
      "AS second, max(a.stand_in, coalesce(b.stand_in, 0)) AS stand_in FROM a LEFT JOIN b USING "
      "(owner, key) WHERE a.value IS NOT b.value UNION ALL SELECT owner, key, NULL, b.value, "
      "b.stand_in FROM b LEFT JOIN a USING (owner, key) WHERE a.value IS NULL UNION ALL SELECT "
      "'run', x.what, x.value, y.value, 0 FROM of_run AS x JOIN of_run AS y ON y.what = x.what "
      "WHERE x.number = ?1 AND y.number = ?2 AND x.value IS NOT y.value ORDER BY 1, 2",
      {first, second});
  difference.values.title = fmt::format("What differs between run {} and run {}", first, second);
  for (const auto& row : difference.values.rows) {
    difference.sentence +=
        fmt::format("{}{} {} {} -> {}", difference.sentence.empty() ? "" : "; ", row[0], row[1],
                    row[2].empty() ? "(absent)" : row[2], row[3].empty() ? "(absent)" : row[3]);
  }
  if (difference.sentence.empty()) difference.sentence = "no value differs";
  difference.drapes = store.query(
      "SELECT d.run, d.scene, d.discretisation, d.segments, round(d.mean_dist_mm, 3) AS "
      "mean_dist_mm, "
      "round(d.expanded_uncertainty_mm, 3) AS expanded_uncertainty_mm, " +
          std::string(kUncertaintyIs) +
          ", d.measurement, d.match, d.match_rests_on FROM v_run_drape AS d WHERE d.run IN "
          "(?1, ?2) ORDER BY d.scene, d.run",
      {first, second});
  difference.drapes.title = "Their drapes";
  return difference;
}

}  // namespace drape::compare
