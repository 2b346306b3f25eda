// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "compare/history/results.hpp"
#include "core/error.hpp"
#include "core/files/csv.hpp"

namespace drape::compare {
namespace {

using Names = std::vector<std::string>;

const Names kBehindTables = {
    "comparison",        "sheet", "simulation", "fabric",    "branch",
    "branch_turn",       "run",   "run_drape",  "run_match", "simulation_pair",
    "surface_comparison"};

void drop_column(Table& table, std::size_t at) {
  const auto column = static_cast<std::ptrdiff_t>(at);
  table.names.erase(table.names.begin() + column);
  table.numeric.erase(table.numeric.begin() + column);
  for (auto& row : table.rows) row.erase(row.begin() + column);
}

/// True if a column is redundant: drapebench alone needs no name, model and solver are needed only
/// if they differ within a simulator.
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

/// Removes those of the given columns that are redundant; the paper has none of them.
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

const Names kOfPairs = {"fabric", "model", "solver"};

/// Removes the first columns from the rows of a table, which name the table they belong to.
std::vector<std::string> take_first(std::vector<std::string>& row, std::ptrdiff_t count) {
  std::vector<std::string> first(row.begin(), row.begin() + count);
  row.erase(row.begin(), row.begin() + count);
  return first;
}

/// Rows of a query grouped by title, in the order of the first row of each.
class Apart {
 public:
  Apart(const Table& query, std::size_t taken) : head_(query) {
    head_.rows.clear();
    head_.names.erase(head_.names.begin(),
                      head_.names.begin() + static_cast<std::ptrdiff_t>(taken));
    head_.numeric.erase(head_.numeric.begin(),
                        head_.numeric.begin() + static_cast<std::ptrdiff_t>(taken));
  }
  void add(const std::string& title, std::vector<std::string> row) {
    const auto [at, is_new] = places_.try_emplace(title, tables_.size());
    if (is_new) tables_.emplace_back(title, head_);
    tables_[at->second].second.rows.push_back(std::move(row));
  }
  void add_to(std::vector<Table>& tables, const std::string& title, const Names& columns) const {
    if (const auto at = places_.find(title); at != places_.end())
      add_table(tables, tables_[at->second].second, title, columns);
  }
  [[nodiscard]] const std::vector<std::pair<std::string, Table>>& tables() const { return tables_; }

 private:
  Table head_;
  std::vector<std::pair<std::string, Table>> tables_;
  std::map<std::string, std::size_t> places_;
};

/// Pairs, by title, whose sheets (measured and simulated) are both in `chosen`.
Apart pairs_of(const StoreReader& store,
               const std::set<std::pair<std::string, std::string>>& chosen, const char* measured,
               const std::function<std::string(const std::string&, const std::string&)>& title) {
  constexpr std::size_t kTaken = 4;
  const Table all = store.query(fmt::format(
      "SELECT scene, coalesce(measured, ''), first, second, pair, round(mean_dist_mm, 2) "
      "AS mean_dist_mm, fabric, model, solver FROM v_virtual_vs_virtual WHERE measured {}",
      measured));
  Apart apart(all, kTaken);
  for (std::vector<std::string> row : all.rows) {
    const auto of = take_first(row, kTaken);
    if (chosen.contains({of[1], of[2]}) && chosen.contains({of[1], of[3]}))
      apart.add(title(of[0], of[1]), std::move(row));
  }
  return apart;
}

std::string of_drape(const std::string& scene, const std::string& measured) {
  return fmt::format("(experiment {}, measured sheet {})", scene, measured);
}

void add_drapes(const StoreReader& store, const Selection& chosen, std::vector<Table>& tables) {
  constexpr std::size_t kTaken = 10;
  const Table all = store.query(
      "SELECT scene, measured, s.measurement, s.cause, s.run, substr(s.date, 1, 10), s.match, "
      "(SELECT "
      "m.rests_on FROM comparison AS c JOIN run AS r ON r.number = s.run JOIN run_match AS m ON "
      "m.run_sha256 = r.sha256 AND m.measured_sha256 = c.measured_sha256 WHERE c.id = v.id), "
      "v.simulated, branch, discretisation, segments, round(mean_dist_mm, 2) AS mean_dist_mm, "
      "simulator, fabric, model, solver, begins FROM " +
          chosen.from + chosen.where + in_order(),
      chosen.parameters);
  Apart apart(all, kTaken);
  std::set<std::pair<std::string, std::string>> sheets;
  std::map<std::string, std::string> drapes;
  for (std::vector<std::string> row : all.rows) {
    const auto of = take_first(row, kTaken);
    sheets.emplace(of[1], of[8]);
    if (!of[9].empty()) continue;  // a branch
    const std::string drape = of_drape(of[0], of[1]);
    std::string title = "Real vs virtual " + drape;
    if (!of[4].empty())
      title += fmt::format("; run {} of {}: measurement {}{}; match {}{}", of[4], of[5], of[2],
                           of[3].empty() ? "" : " (" + of[3] + ")", of[6],
                           of[7].empty() ? "" : ", by " + of[7]);
    drapes[title] = "Virtual vs virtual " + drape;
    apart.add(title, std::move(row));
  }
  const Apart pairs =
      pairs_of(store, sheets, "IS NOT NULL", [](const auto& scene, const auto& measured) {
        return "Virtual vs virtual " + of_drape(scene, measured);
      });
  for (const auto& [title, table] : apart.tables()) {
    add_table(tables, table, title, {"simulator", "fabric", "model", "solver", "begins"});
    pairs.add_to(tables, drapes.at(title), kOfPairs);
  }
}

bool of_cloths(const ResultFilter& filter) {
  return !discretisation_of(filter).empty() || filter.segments || !filter.model.empty();
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
    of.parameters.insert(of.parameters.end(), 3, Cell(filter.calibration));
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

/// Adds simulations without a real cloth, which belong to no run, rig or calibration.
void add_alone(const StoreReader& store, const ResultFilter& filter, std::vector<Table>& tables) {
  Selection sheets{
      "simulation AS s LEFT JOIN fabric AS f ON f.sha256 = s.fabric_sha256", " WHERE 1", {}};
  sheets.add("s.scene", filter.scene);
  sheets.add("coalesce(f.name, s.fabric_stated)", filter.fabric);
  sheets.add(kDiscretisation, discretisation_of(filter));
  if (filter.segments) sheets.add("s.segments", *filter.segments);
  sheets.add("s.model", filter.model);
  sheets.add("s.simulator", filter.simulator);
  std::set<std::pair<std::string, std::string>> chosen;
  for (const auto& [sheet] : store.rows<std::string>(
           "SELECT substr(s.sheet_sha256, 1, 12) FROM " + sheets.from + sheets.where,
           sheets.parameters))
    chosen.emplace("", sheet);
  const Apart pairs = pairs_of(store, chosen, "IS NULL", [](const auto& scene, const auto&) {
    return "Virtual vs virtual (experiment " + scene + ", no real cloth)";
  });
  for (const auto& [title, table] : pairs.tables()) add_table(tables, table, title, kOfPairs);
}

}  // namespace

std::vector<Table> paper_tables(const StoreReader& store, const ResultFilter& filter) {
  store.require_as_written(kBehindTables);
  const Selection chosen = selection_of(store, filter);
  std::vector<Table> tables;
  add_drapes(store, chosen, tables);
  add_table(
      tables,
      store.query("SELECT scene, fabric, discretisation, segments, branch, round(energy_uJ, 2) AS "
                  "energy_uJ, round(above_least_uJ, 2) AS above_least_uJ, starts, hem_nodes, "
                  "round(mean_dist_mm, 3) AS mean_dist_mm, round(match_mm, 3) AS match_mm, "
                  "least_energy, nearest, measured, comparison FROM v_branches WHERE "
                  "comparison IN (SELECT v.comparison FROM " +
                      chosen.from + chosen.where + ")",
                  chosen.parameters),
      "Branches (equilibria of one drape, by energy)", {"fabric"});
  if (!of_cloths(filter))
    add_table(tables, surfaces_of(store, filter),
              "Real vs surface (meshes without material correspondence)", {"fabric"});
  if (!of_runs(filter) && filter.rig.empty() && filter.calibration.empty())
    add_alone(store, filter, tables);
  return tables;
}

namespace {

/// A line of published.csv.
struct Published {
  std::string experiment;
  bool real = false;     ///< real against virtual
  std::string grid;      ///< "21x21"; for a pair its label
  std::string segments;  ///< empty for a pair
  std::string mean_mm;
  int table = 0;
};

std::vector<Published> read_published(const std::string& file) {
  const CsvText csv = read_csv_text(file);
  const char* right_one = "give rigs/paper/published.csv";
  if (csv.names.size() != 8 || csv.names[0] != "experiment" || csv.names[7] != "mean_distance_mm")
    throw bad_input("this is not the list of the paper's numbers",
                    {.file = file, .line = csv.head_line}, right_one);
  std::vector<Published> list;
  for (std::size_t i = 0; i < csv.rows.size(); ++i) {
    const std::vector<std::string>& c = csv.rows[i];
    if (c[1].empty() || c[1].size() > 3 ||
        c[1].find_first_not_of("0123456789") != std::string::npos)
      throw bad_input("the number of the table is `" + c[1] + "`",
                      {.file = file, .line = csv.lines[i]}, right_one);
    Published row{c[0], c[2] == "real-virtual", c[3] + "x" + c[3], c[4], c[7], std::stoi(c[1])};
    if (!row.real) {
      row.grid = c[3] == c[5] ? fmt::format("{0}x{0}: {1} seg vs {2} seg", c[3], c[4], c[6])
                              : fmt::format("{0} seg: {1}x{1} vs {2}x{2}", c[4], c[3], c[5]);
      row.segments.clear();
    }
    list.push_back(std::move(row));
  }
  return list;
}

/// A column of results: simulations with one model and solver, compared with one measured sheet or
/// (pairs only) without any.
struct PublishedColumn {
  std::string head, measured, model, solver;
  bool go = true;
};

/// Sheets that were compared for the experiment and not replaced since; the model is named if there
/// are several.
constexpr const char* kRealColumns =
    "SELECT rig || '_' || measured_set || '_' || substr(measured, 1, 6) AS head, measured, model, "
    "solver, max(coalesce(measurement, '') = 'NO-GO') FROM v_real_vs_virtual WHERE scene = ?1 AND "
    "simulator = 'drapebench' AND begins = 'scene' AND branch IS NULL AND coalesce(state, "
    "'current') = 'current' GROUP BY head, measured, model, solver ORDER BY head, model, solver";
constexpr const char* kPairColumns =
    "SELECT coalesce((SELECT m.rig_name || '_' || m.set_name || '_' || substr(m.sha256, 1, 6) FROM "
    "sheet AS m WHERE substr(m.sha256, 1, 12) = v.measured), 'virtual') AS head, "
    "coalesce(measured, ''), model, solver, max(coalesce(measurement, '') = 'NO-GO') FROM "
    "v_virtual_vs_virtual AS v WHERE scene = ?1 AND coalesce(state, 'current') = 'current' GROUP "
    "BY head, measured, model, solver ORDER BY measured IS NOT NULL, head, model, solver";
constexpr const char* kRealCells =
    "SELECT round(mean_dist_mm, 2), status = 'at rest' FROM v_real_vs_virtual WHERE scene = ?1 AND "
    "measured = ?2 AND model = ?3 AND coalesce(solver, '') = ?4 AND discretisation = ?5 AND "
    "CAST(segments AS TEXT) = ?6 AND simulator = 'drapebench' AND begins = 'scene' AND branch IS "
    "NULL AND coalesce(state, 'current') = 'current' ORDER BY id";
/// The finest mesh with the most segments.
constexpr const char* kCloth =
    "SELECT discretisation, segments FROM v_real_vs_virtual WHERE scene = ?1 AND spacing_mm IS NOT "
    "NULL AND begins = 'scene' AND branch IS NULL AND coalesce(state, 'current') = 'current' ORDER "
    "BY spacing_mm, segments DESC LIMIT 1";
constexpr const char* kPairCells =
    "SELECT round(mean_dist_mm, 2), both_at_rest FROM v_virtual_vs_virtual WHERE scene = ?1 AND "
    "coalesce(measured, '') = ?2 AND model = ?3 AND coalesce(solver, '') = ?4 AND pair = ?5 AND "
    "coalesce(state, "
    "'current') = 'current'";

/// Sheets that were compared for the experiment and not replaced since; the model is named if there
/// are several.
std::vector<PublishedColumn> columns_of(const StoreReader& store, const Published& row) {
  using Text = std::string;
  const auto found = store.rows<Text, Text, Text, Text, bool>(
      row.real ? kRealColumns : kPairColumns, {row.experiment});
  std::vector<PublishedColumn> columns;
  for (const auto& [head, measured, model, solver, no_go] : found) {
    const auto same = std::count_if(found.begin(), found.end(), [&](const auto& other) {
      return std::get<1>(other) == std::get<1>(found[columns.size()]);
    });
    std::string name = head;
    if (same > 1) name += "_" + model + (solver.empty() ? "" : "_" + solver);
    columns.push_back({name + "_mm", measured, model, solver, !no_go});
  }
  return columns;
}

/// The mean distances of one column, and whether all of their sheets are at rest.
std::pair<std::string, bool> cell_of(const StoreReader& store, const Published& row,
                                     const PublishedColumn& column) {
  Cells parameters = {row.experiment, column.measured, column.model, column.solver, row.grid};
  if (row.real) parameters.emplace_back(row.segments);
  std::pair<std::string, bool> cell{{}, true};
  for (const auto& [mean_mm, at_rest] :
       store.rows<std::string, bool>(row.real ? kRealCells : kPairCells, parameters)) {
    cell.first += (cell.first.empty() ? "" : " / ") + mean_mm;
    cell.second = cell.second && at_rest;
  }
  return cell;
}

Table head_of(const Published& row, const std::vector<PublishedColumn>& columns) {
  Table table = row.real ? Table({"discretisation", "segments", "published_mm"}, {1, 2})
                         : Table({"pair", "published_mm"}, {1});
  table.title = fmt::format("Table {}. {}, experiment {}{}", row.table,
                            row.real ? "Real vs virtual" : "Virtual vs virtual", row.experiment,
                            !columns.empty() ? ""
                            : row.real       ? " (no measured sheet of it is current in this store)"
                                             : " (no pair of it in this store)");
  for (const PublishedColumn& column : columns) {
    table.names.push_back(column.head);
    if (!column.go) table.title += "; measurement NO-GO: " + column.head;
    table.numeric.push_back(true);
  }
  table.names.emplace_back("not_at_rest");
  table.numeric.push_back(false);
  return table;
}

void add_row(const StoreReader& store, const Published& row,
             const std::vector<PublishedColumn>& columns, Table& table) {
  std::vector<std::string> cells = {row.grid};
  if (row.real) cells.push_back(row.segments);
  cells.push_back(row.mean_mm);
  std::string moving;
  for (const PublishedColumn& column : columns) {
    const auto [mean_mm, at_rest] = cell_of(store, row, column);
    cells.push_back(mean_mm);
    if (!at_rest) moving += (moving.empty() ? "" : ", ") + column.head;
  }
  cells.push_back(moving);
  table.add(std::move(cells));
}

}  // namespace

std::vector<Table> published_tables(const StoreReader& store, const std::string& published_csv,
                                    const std::string& experiment) {
  store.require_as_written(kBehindTables);
  std::vector<Table> tables;
  std::vector<PublishedColumn> columns;
  std::set<std::string> known;
  const std::vector<Published> list = read_published(published_csv);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Published& row = list[i];
    known.insert(row.experiment);
    if (!experiment.empty() && row.experiment != experiment) continue;
    if (i == 0 || tables.empty() || row.table != list[i - 1].table) {
      columns = columns_of(store, row);
      tables.push_back(head_of(row, columns));
    }
    add_row(store, row, columns, tables.back());
    if (!row.real || (i + 1 < list.size() && list[i + 1].table == row.table)) continue;
    for (const auto& [mesh, segments] :
         store.rows<std::string, std::string>(kCloth, {row.experiment}))
      add_row(store, {row.experiment, true, mesh, segments, "", row.table}, columns, tables.back());
  }
  if (tables.empty() && !experiment.empty())
    throw usage_error(fmt::format("the paper has no experiment `{}`", experiment),
                      fmt::format("it has: {}", fmt::join(known, ", ")));
  return tables;
}

}  // namespace drape::compare
