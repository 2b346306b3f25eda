// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "compare/history/filter.hpp"
#include "compare/history/results.hpp"

namespace drape::compare {
namespace {

using Names = std::vector<std::string>;

void drop_column(Table& table, std::size_t at) {
  const auto column = static_cast<std::ptrdiff_t>(at);
  table.names.erase(table.names.begin() + column);
  table.numeric.erase(table.numeric.begin() + column);
  for (auto& row : table.rows) row.erase(row.begin() + column);
}

/// Whether a column says nothing: drapebench alone needs no name, model and solver need one
/// only where they differ within a simulator.
bool is_alike(const Table& table, std::size_t at) {
  const std::string& name = table.names[at];
  const auto named = std::find(table.names.begin(), table.names.end(), "simulator");
  const auto simulator = static_cast<std::size_t>(named - table.names.begin());
  const bool within = named != table.names.end() && (name == "model" || name == "solver");
  return std::all_of(table.rows.begin(), table.rows.end(), [&](const auto& row) {
    if (name == "simulator") return row[at] == "drapebench";
    const auto first = std::find_if(table.rows.begin(), table.rows.end(), [&](const auto& other) {
      return !within || other[simulator] == row[simulator];
    });
    return row[at] == (*first)[at];
  });
}

/// Leaves out those of the named columns that are alike: the paper has none of them.
void keep_what_differs(Table& table, const Names& columns) {
  for (std::size_t at = table.names.size(); at-- > 0;)
    if (std::find(columns.begin(), columns.end(), table.names[at]) != columns.end() &&
        is_alike(table, at))
      drop_column(table, at);
}

void add_table(std::vector<Table>& tables, Table table, const std::string& title,
               const Names& columns) {
  if (table.rows.empty()) return;
  keep_what_differs(table, columns);
  table.title = title;
  tables.push_back(std::move(table));
}

constexpr const char* kPairs =
    "SELECT pair, round(mean_dist_mm, 2) AS mean_dist_mm, fabric, model, solver FROM "
    "v_virtual_vs_virtual WHERE scene = ? AND measured ";
const Names kOfPairs = {"fabric", "model", "solver"};

/// The pairs of which `sheets`, a query with its parameters, holds both.
Table pairs_of(const StoreReader& store, const std::string& measured, const std::string& sheets,
               Cells parameters, const Cells& of_sheets) {
  for (int i = 0; i < 2; ++i)
    parameters.insert(parameters.end(), of_sheets.begin(), of_sheets.end());
  return store.query(
      fmt::format("{}{} AND first IN ({}) AND second IN ({})", kPairs, measured, sheets, sheets),
      parameters);
}

void add_drapes(const StoreReader& store, const Selection& chosen, std::vector<Table>& tables) {
  using Text = std::string;
  for (const auto& [scene, measured, verdict, cause, run, date, match, rests_on] :
       store.rows<Text, Text, Text, Text, Text, Text, Text, Text>(
           "SELECT DISTINCT scene, measured, s.measurement, s.cause, s.run, substr(s.date, 1, 10), "
           "s.match, (SELECT m.rests_on FROM comparison AS c JOIN run AS r ON r.number = s.run "
           "JOIN run_match AS m ON m.run_sha256 = r.sha256 AND m.measured_sha256 = "
           "c.measured_sha256 WHERE c.id = v.id) FROM " +
               chosen.from + chosen.where + " AND branch IS NULL ORDER BY scene, measured",
           chosen.parameters)) {
    Text title = fmt::format("(experiment {}, measured sheet {})", scene, measured);
    if (!run.empty())
      title += fmt::format("; run {} of {}: measurement {}{}; match {}{}", run, date, verdict,
                           cause.empty() ? "" : " (" + cause + ")", match,
                           rests_on.empty() ? "" : ", by " + rests_on);
    Selection same = chosen;
    same.add("scene", scene);
    same.add("measured", measured);
    add_table(tables,
              store.query("SELECT grid_size, segments, round(mean_dist_mm, 2) AS mean_dist_mm, "
                          "simulator, fabric, model, solver FROM " +
                              same.from + same.where + " AND branch IS NULL" + kOrder,
                          same.parameters),
              "Real vs virtual " + title, {"simulator", "fabric", "model", "solver"});
    add_table(tables,
              pairs_of(store, "= ?", "SELECT v.simulated FROM " + same.from + same.where,
                       {scene, measured}, same.parameters),
              "Virtual vs virtual " + title, kOfPairs);
  }
}

bool of_particles(const ResultFilter& filter) {
  return !filter.grid.empty() || filter.segments || !filter.model.empty();
}

bool of_runs(const ResultFilter& filter) {
  return filter.run || !filter.since.empty() || !filter.until.empty();
}

Table surfaces_of(const StoreReader& store, const ResultFilter& filter) {
  Selection of{"v_real_vs_surface AS v", " WHERE 1", {}};
  of.add("scene", filter.scene);
  of.add("fabric", filter.fabric);
  of.add("rig", filter.rig);
  of.add("simulator", filter.simulator);
  if (!filter.outdated) of.where += " AND coalesce(state, 'current') = 'current'";
  if (!filter.calibration.empty()) {
    of.where +=
        " AND measured IN (SELECT substr(m.sha256, 1, 12) FROM sheet AS m WHERE "
        "substr(m.calibration_sha256, 1, length(?)) = ? OR m.sha256 IN (SELECT d.measured_sha256 "
        "FROM run_drape AS d JOIN run AS r ON r.number = d.run WHERE instr(r.calibration_name, ?) "
        "> 0))";
    of.parameters.insert(of.parameters.end(), 3, Value(filter.calibration));
  }
  if (of_runs(filter)) {
    of.where +=
        " AND measured IN (SELECT substr(measured_sha256, 1, 12) FROM run_drape WHERE run IN (";
    of.where += runs_of(filter, of.parameters) + "))";
  }
  return store.query(
      "SELECT scene, simulator, fabric, round(to_surface_mean_mm, 3) AS to_surface_mean_mm, "
      "round(real_to_mesh_mean_mm, 3) AS real_to_mesh_mean_mm, round(real_to_mesh_max_mm, 3) AS "
      "real_to_mesh_max_mm, marks, measured, comparison FROM " +
          of.from + of.where,
      of.parameters);
}

/// Simulations without a real cloth, which are of no run, rig or calibration.
void add_alone(const StoreReader& store, const ResultFilter& filter, std::vector<Table>& tables) {
  Selection sheets{
      "simulation AS s LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256", " WHERE 1", {}};
  sheets.add("s.scene", filter.scene);
  sheets.add("coalesce(f.name, s.fabric_stated)", filter.fabric);
  sheets.add("s.grid_rows || 'x' || s.grid_cols", grid_text(filter.grid));
  if (filter.segments) sheets.add("s.segments", *filter.segments);
  sheets.add("s.model", filter.model);
  sheets.add("s.simulator", filter.simulator);
  for (const auto& [scene] : store.rows<std::string>(
           "SELECT DISTINCT scene FROM v_virtual_vs_virtual WHERE measured IS NULL ORDER BY scene"))
    add_table(tables,
              pairs_of(store, "IS NULL",
                       "SELECT substr(s.sheet_sha256, 1, 12) FROM " + sheets.from + sheets.where,
                       {scene}, sheets.parameters),
              "Virtual vs virtual (experiment " + scene + ", no real cloth)", kOfPairs);
}

}  // namespace

std::vector<Table> paper_tables(const StoreReader& store, const ResultFilter& filter) {
  const Selection chosen = selection_of(store, filter);
  std::vector<Table> tables;
  add_drapes(store, chosen, tables);
  add_table(tables,
            store.query("SELECT scene, fabric, grid_size, segments, branch, round(energy_uJ, 2) AS "
                        "energy_uJ, round(above_least_uJ, 2) AS above_least_uJ, starts, hem_nodes, "
                        "round(mean_dist_mm, 3) AS mean_dist_mm, round(match_mm, 3) AS match_mm, "
                        "least_energy, nearest, measured, comparison FROM v_branches WHERE "
                        "comparison IN (SELECT v.comparison FROM " +
                            chosen.from + chosen.where + ")",
                        chosen.parameters),
            "Branches (equilibria of one drape, by energy)", {"fabric"});
  if (!of_particles(filter))
    add_table(tables, surfaces_of(store, filter),
              "Real vs surface (meshes without material correspondence)", {"fabric"});
  if (!of_runs(filter) && filter.rig.empty() && filter.calibration.empty())
    add_alone(store, filter, tables);
  return tables;
}

}  // namespace drape::compare
