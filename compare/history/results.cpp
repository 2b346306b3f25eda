// SPDX-License-Identifier: Apache-2.0
#include "compare/history/results.hpp"

#include <fmt/format.h>

#include "core/error.hpp"

namespace drape::compare {
namespace {

struct Condition {
  std::string sql = " WHERE 1";
  std::vector<std::string> parameters;

  void add(const std::string& column, const std::string& value, const char* relation = "=") {
    if (value.empty()) return;
    sql += fmt::format(" AND {} {} ?", column, relation);
    parameters.push_back(value);
  }
};

std::string grid_text(const std::string& grid) {
  return grid.empty() || grid.find('x') != std::string::npos ? grid : grid + "x" + grid;
}

Condition condition_of(const ResultFilter& filter) {
  Condition condition;
  condition.add("scene", filter.scene);
  condition.add("fabric", filter.fabric);
  condition.add("grid_size", grid_text(filter.grid));
  if (filter.segments) condition.add("CAST(segments AS TEXT)", std::to_string(*filter.segments));
  condition.add("rig", filter.rig);
  condition.add("model", filter.model);
  condition.add("simulator", filter.simulator);
  condition.add("recorded_on", filter.since, ">=");
  condition.add("recorded_on", filter.until, "<=");
  return condition;
}

/// Turns the one row of `table` into name, value, unit and definition.
Table metrics_of(const StoreReader& store, const Table& row) {
  Table metrics;
  metrics.names = {"metric", "value", "unit", "definition"};
  metrics.numeric = {false, true, false, false};
  const Table dictionary = store.query("SELECT name, unit, definition FROM metric");
  for (std::size_t i = 0; i < row.names.size(); ++i) {
    for (const auto& entry : dictionary.rows) {
      if (entry[0] == row.names[i])
        metrics.add({row.names[i], row.rows.front()[i], entry[1], entry[2]});
    }
  }
  return metrics;
}

Table turned(const Table& row) {
  Table table;
  table.names = {"what", "value"};
  table.numeric = {false, false};
  for (std::size_t i = 0; i < row.names.size(); ++i)
    if (!row.rows.front()[i].empty()) table.add({row.names[i], row.rows.front()[i]});
  return table;
}

}  // namespace

StoredKey stored_key(const StoreReader& store, const std::string& key,
                     const std::vector<std::string>& tables) {
  std::string query;
  for (const std::string& table : tables) {
    query += fmt::format("{}SELECT '{}', sha256 FROM {} WHERE substr(sha256, 1, length(?1)) = ?1",
                         query.empty() ? "" : " UNION ALL ", table, table);
  }
  const Table found = store.query(query, {key});
  if (found.rows.size() == 1) return {found.rows[0][0], found.rows[0][1]};
  throw usage_error(fmt::format("{} rows have a key that starts with `{}`", found.rows.size(), key),
                    "take a key from the column `comparison` of drape-results list or tables");
}

std::string full_key(const StoreReader& store, const std::string& key) {
  const StoredKey found = stored_key(store, key);
  if (found.table == "comparison") return found.sha256;
  throw usage_error(fmt::format("`{}` compares a surface without marks", key),
                    "see it with drape-results show or why");
}

Table list_results(const StoreReader& store, const ResultFilter& filter) {
  const Condition condition = condition_of(filter);
  return store.query(
      "SELECT comparison, scene, grid_size, segments, round(mean_dist_mm, 3) AS mean_dist_mm, "
      "round(sigma_mean_mm, 4) AS sigma_mean_mm, round(max_mm, 3) AS max_mm, "
      "round(mean_percent_of_warp_side, 2) AS mean_percent_of_warp_side, "
      "round(mean_percent_of_weft_side, 2) AS mean_percent_of_weft_side, marks, gaps, fabric, "
      "simulator, status, branch, recorded_on, measured FROM v_real_vs_virtual" +
          condition.sql,
      condition.parameters);
}

namespace {

ShownResult show_surface(const StoreReader& store, const std::string& full) {
  const Table row = store.query("SELECT * FROM surface_comparison WHERE sha256 = ?", {full});
  ShownResult shown;
  shown.metrics = metrics_of(store, row);
  shown.provenance = turned(store.query(
      "SELECT p.scene, p.simulator, p.fabric_stated AS fabric, m.rig_name AS rig, m.set_name AS "
      "measured_set, p.marks, m.gaps, p.points, p.triangles, p.sha256 AS comparison_sha256, "
      "p.measured_sha256, p.mesh_sha256, m.detections_sha256, m.calibration_sha256 FROM "
      "surface_comparison AS p JOIN sheet AS m ON m.sha256 = p.measured_sha256 WHERE p.sha256 = ?",
      {full}));
  return shown;
}

}  // namespace

ShownResult show_result(const StoreReader& store, const std::string& key) {
  const StoredKey stored = stored_key(store, key);
  if (stored.table != "comparison") return show_surface(store, stored.sha256);
  const std::string& full = stored.sha256;
  ShownResult shown;
  shown.metrics = metrics_of(
      store, store.query("SELECT c.*, m.sigma_median_mm, m.sigma_max_mm FROM comparison AS c JOIN "
                         "sheet AS m ON m.sha256 = c.measured_sha256 WHERE c.sha256 = ?",
                         {full}));
  shown.provenance = turned(store.query(
      "SELECT s.scene, s.grid_rows || 'x' || s.grid_cols AS grid_size, s.segments, s.simulator, "
      "coalesce(f.name, s.fabric_stated) AS fabric, s.model, s.solver, s.status, m.rig_name AS "
      "rig, m.set_name AS measured_set, "
      "c.marks, m.gaps, k.method AS calibration_method, c.sha256 AS comparison_sha256, "
      "c.measured_sha256, c.simulated_sha256, m.detections_sha256, m.calibration_sha256, "
      "s.scene_sha256, s.fabric_sha256, s.start_sha256, s.certificate_sha256, "
      "s.certificate_json AS certificate FROM comparison AS c JOIN sheet AS m ON m.sha256 = "
      "c.measured_sha256 JOIN simulation AS s ON s.sheet_sha256 = c.simulated_sha256 LEFT JOIN "
      "fabric "
      "AS f ON f.sha256 = s.fabric_sha256 LEFT JOIN calibration_file AS k ON k.calibration_sha256 "
      "= "
      "m.calibration_sha256 WHERE c.sha256 = ?",
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

std::vector<Table> paper_tables(const StoreReader& store, const ResultFilter& filter) {
  ResultFilter scene_filter;
  scene_filter.scene = filter.scene;
  scene_filter.fabric = filter.fabric;
  const Condition condition = condition_of(scene_filter);
  const Table groups =
      store.query("SELECT DISTINCT scene, measured, measured_set FROM v_real_vs_virtual" +
                      condition.sql + " AND branch IS NULL ORDER BY scene, measured",
                  condition.parameters);
  std::vector<Table> tables;
  for (const auto& group : groups.rows) {
    const std::string title = fmt::format("(experiment {}, measured sheet {})", group[0], group[1]);
    Condition same = condition_of(filter);
    same.add("scene", group[0]);
    same.add("measured", group[1]);
    tables.push_back(
        store.query("SELECT grid_size, segments, round(mean_dist_mm, 2) AS mean_dist_mm FROM "
                    "v_real_vs_virtual" +
                        same.sql + " AND branch IS NULL",
                    same.parameters));
    tables.back().title = "Real vs virtual " + title;
    tables.push_back(store.query(
        "SELECT pair, round(mean_dist_mm, 2) AS mean_dist_mm FROM v_virtual_vs_virtual WHERE "
        "scene = ? AND measured = ?",
        {group[0], group[1]}));
    tables.back().title = "Virtual vs virtual " + title;
  }
  const Table branches = store.query(
      "SELECT scene, grid_size, segments, branch, round(energy_uJ, 2) AS energy_uJ, "
      "round(above_least_uJ, 2) AS above_least_uJ, starts, hem_nodes, round(mean_dist_mm, 3) AS "
      "mean_dist_mm, round(match_mm, 3) AS match_mm, least_energy, nearest, measured, comparison "
      "FROM v_branches WHERE (?1 = '' OR scene = ?1) AND (?2 = '' OR fabric = ?2)",
      {filter.scene, filter.fabric});
  if (!branches.rows.empty()) {
    tables.push_back(branches);
    tables.back().title = "Branches (equilibria of one drape, by energy)";
  }
  const Table surfaces = store.query(
      "SELECT scene, simulator, round(to_surface_mean_mm, 3) AS to_surface_mean_mm, "
      "round(real_to_mesh_mean_mm, 3) AS real_to_mesh_mean_mm, round(real_to_mesh_max_mm, 3) AS "
      "real_to_mesh_max_mm, marks, measured, comparison FROM v_real_vs_surface WHERE (?1 = '' OR "
      "scene = ?1) AND (?2 = '' OR fabric = ?2)",
      {filter.scene, filter.fabric});
  if (!surfaces.rows.empty()) {
    tables.push_back(surfaces);
    tables.back().title = "Real vs surface (meshes without material correspondence)";
  }
  const Table alone = store.query(
      "SELECT DISTINCT scene FROM v_virtual_vs_virtual WHERE measured IS NULL AND (?1 = '' OR "
      "scene = ?1) AND (?2 = '' OR fabric = ?2) ORDER BY scene",
      {filter.scene, filter.fabric});
  for (const auto& scene : alone.rows) {
    tables.push_back(store.query(
        "SELECT pair, round(mean_dist_mm, 2) AS mean_dist_mm FROM v_virtual_vs_virtual WHERE scene "
        "= ? AND measured IS NULL",
        {scene[0]}));
    tables.back().title = "Virtual vs virtual (experiment " + scene[0] + ", no real cloth)";
  }
  return tables;
}

Table export_table(const StoreReader& store, const std::string& name) {
  const Table known =
      store.query("SELECT name FROM sqlite_master WHERE type IN ('table', 'view') ORDER BY name");
  std::string names;
  for (const auto& row : known.rows) {
    if (row.front() == name) return store.query(fmt::format("SELECT * FROM \"{}\"", name));
    names += (names.empty() ? "" : ", ") + row.front();
  }
  throw usage_error(fmt::format("the store has no table or view `{}`", name), "it has: " + names);
}

std::string dump_sql(const StoreReader& store) {
  std::string text = fmt::format(
      "PRAGMA application_id = {};\nPRAGMA user_version = {};\nPRAGMA foreign_keys = "
      "OFF;\nBEGIN;\n",
      kApplicationId, kStoreVersion);
  const Table objects = store.query(
      "SELECT type, name, sql FROM sqlite_master WHERE sql IS NOT NULL ORDER BY type = 'view', "
      "type = 'trigger', type = 'index', rowid");
  for (const auto& object : objects.rows) text += object[2] + ";\n";
  for (const auto& object : objects.rows) {
    if (object[0] != "table") continue;
    std::string values;
    for (const auto& column :
         store.query("SELECT name FROM pragma_table_info(?) ORDER BY cid", {object[1]}).rows)
      values += fmt::format("{}quote(\"{}\")", values.empty() ? "" : " || ', ' || ", column[0]);
    const Table rows = store.query(fmt::format("SELECT {} AS line FROM \"{}\"", values, object[1]));
    for (const auto& row : rows.rows)
      text += fmt::format("INSERT INTO \"{}\" VALUES ({});\n", object[1], row[0]);
  }
  return text + "COMMIT;\n";
}

}  // namespace drape::compare
