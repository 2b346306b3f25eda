// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "compare/history/results.hpp"

namespace drape::compare {
namespace {

using Names = std::vector<std::string>;

const Names kBehindTables = {
    "comparison",        "sheet", "simulation", "fabric",    "branch",
    "branch_turn",       "run",   "run_drape",  "run_match", "simulation_pair",
    "surface_comparison"};

/// True if a column is redundant: drapebench alone needs no name, model and solver are needed only
/// if they differ within a simulator.
bool is_alike(const Table& table, std::size_t at) {
  const std::string& name = table.names[at];
  const auto simulator = table.column("simulator");
  const bool within = simulator && (name == "model" || name == "solver");
  std::set<std::string> groups;
  std::set<std::pair<std::string, std::string>> values;
  for (const auto& row : table.rows) {
    const std::string group = within ? row[*simulator] : "";
    groups.insert(group);
    values.emplace(group, row[at]);
  }
  return values.size() == groups.size() &&
         (name != "simulator" || values.begin()->second == "drapebench");
}

/// Adds a table without those of the given columns that are redundant; the paper has none of them.
void add_table(std::vector<Table>& tables, Table table, const std::string& title,
               const Names& columns) {
  if (table.rows.empty()) return;
  for (std::size_t at = table.names.size(); at-- > 0;) {
    if (std::find(columns.begin(), columns.end(), table.names[at]) == columns.end() ||
        !is_alike(table, at))
      continue;
    const auto column = static_cast<std::ptrdiff_t>(at);
    table.names.erase(table.names.begin() + column);
    table.numeric.erase(table.numeric.begin() + column);
    for (auto& row : table.rows) row.erase(row.begin() + column);
  }
  table.title = title;
  tables.push_back(std::move(table));
}

const Names kOfPairs = {"fabric", "model", "solver"};

/// Rows of a query grouped by their first column, the title, in the order of the first row of each;
/// the first `taken` columns are removed. Rows with an empty title are left out.
std::vector<Table> by_title(const Table& all, std::ptrdiff_t taken) {
  Table head(Names(all.names.begin() + taken, all.names.end()));
  head.numeric.assign(all.numeric.begin() + taken, all.numeric.end());
  std::vector<Table> tables;
  std::map<std::string, std::size_t> places;
  for (const auto& row : all.rows) {
    if (row.front().empty()) continue;
    const auto [at, is_new] = places.try_emplace(row.front(), tables.size());
    if (is_new) tables.emplace_back(head).title = row.front();
    tables[at->second].add({row.begin() + taken, row.end()});
  }
  return tables;
}

/// Pairs, by title, whose sheets (measured and simulated) are both in `chosen`; `title` is SQL.
std::vector<Table> pairs_of(const StoreReader& store,
                            const std::set<std::pair<std::string, std::string>>& chosen,
                            const std::string& title, const char* measured) {
  Table all = store.query(fmt::format(R"sql(
SELECT 'Virtual vs virtual ' || {}, coalesce(measured, ''), first, second, pair,
  round(mean_dist_mm, 2) AS mean_dist_mm, fabric, model, solver
FROM v_virtual_vs_virtual WHERE measured {})sql",
                                      title, measured));
  std::erase_if(all.rows, [&](const auto& row) {
    return !chosen.contains({row[1], row[2]}) || !chosen.contains({row[1], row[3]});
  });
  return by_title(all, 4);
}

constexpr const char* kDrape = "'(experiment ' || scene || ', measured sheet ' || measured || ')'";

void add_drapes(const StoreReader& store, const Selection& chosen, std::vector<Table>& tables) {
  // A branch has no title: it is in no table of the paper.
  const Table all = store.query(fmt::format(R"sql(
SELECT CASE WHEN branch IS NULL THEN 'Real vs virtual ' || {0} || coalesce('; run ' || s.run ||
    ' of ' || substr(s.date, 1, 10) || ': measurement ' || s.measurement ||
    coalesce(' (' || s.cause || ')', '') || '; match ' || s.match || coalesce(', by ' || nullif((
      SELECT m.rests_on FROM comparison AS c JOIN run AS r ON r.number = s.run JOIN run_match AS m
      ON m.run_sha256 = r.sha256 AND m.measured_sha256 = c.measured_sha256 WHERE c.id = v.id), ''),
    ''), '') END,
  'Virtual vs virtual ' || {0}, measured, v.simulated, discretisation, segments,
  round(mean_dist_mm, 2) AS mean_dist_mm, simulator, fabric, model, solver, begins
FROM {1}{2} {3})sql",
                                            kDrape, chosen.from, chosen.where, kInOrder),
                                chosen.parameters);
  std::set<std::pair<std::string, std::string>> sheets;
  std::map<std::string, std::string> pairs_below;
  for (const auto& row : all.rows) {
    sheets.emplace(row[2], row[3]);
    pairs_below[row[0]] = row[1];
  }
  const std::vector<Table> pairs = pairs_of(store, sheets, kDrape, "IS NOT NULL");
  for (const Table& table : by_title(all, 4)) {
    add_table(tables, table, table.title, {"simulator", "fabric", "model", "solver", "begins"});
    for (const Table& below : pairs)
      if (below.title == pairs_below.at(table.title))
        add_table(tables, below, below.title, kOfPairs);
  }
}

bool of_runs(const ResultFilter& filter) {
  return filter.run || !filter.since.empty() || !filter.until.empty();
}

Table surfaces_of(const StoreReader& store, const ResultFilter& filter) {
  Selection of{"v_real_vs_surface AS v", " WHERE 1", {}};
  of.add(filter);
  if (!filter.outdated) of.where += " AND coalesce(state, 'current') = 'current'";
  if (!filter.calibration.empty()) {
    of.where += R"sql( AND measured IN (SELECT substr(m.sha256, 1, 12) FROM sheet AS m
  WHERE substr(m.calibration_sha256, 1, length(?)) = ? OR m.sha256 IN (
    SELECT d.measured_sha256 FROM run_drape AS d JOIN run AS r ON r.number = d.run
    WHERE instr(r.calibration_name, ?) > 0)))sql";
    of.parameters.insert(of.parameters.end(), 3, Cell(filter.calibration));
  }
  if (of_runs(filter)) {
    of.where +=
        " AND measured IN (SELECT substr(measured_sha256, 1, 12) FROM run_drape WHERE run IN (";
    of.where += runs_of(filter, of.parameters) + "))";
  }
  return store.query(R"sql(
SELECT scene, simulator, fabric, round(to_surface_mean_mm, 3) AS to_surface_mean_mm,
  round(real_to_mesh_mean_mm, 3) AS real_to_mesh_mean_mm,
  round(real_to_mesh_max_mm, 3) AS real_to_mesh_max_mm, marks, measured, comparison FROM )sql" +
                         of.from + of.where,
                     of.parameters);
}

/// Adds simulations without a real cloth, which belong to no run, rig or calibration.
void add_alone(const StoreReader& store, const ResultFilter& filter, std::vector<Table>& tables) {
  Selection sheets;
  sheets.add(filter);
  std::set<std::pair<std::string, std::string>> chosen;
  for (const std::string& sheet : store.column<std::string>(
           fmt::format("SELECT sheet FROM (SELECT substr(s.sheet_sha256, 1, 12) AS sheet, s.scene "
                       "AS scene, coalesce(f.name, s.fabric_stated) AS fabric, {} AS "
                       "discretisation, s.segments AS segments, s.model AS model, s.simulator AS "
                       "simulator FROM simulation AS s LEFT JOIN fabric AS f ON f.sha256 = "
                       "s.fabric_sha256){}",
                       kDiscretisation, sheets.where),
           sheets.parameters))
    chosen.emplace("", sheet);
  for (const Table& table :
       pairs_of(store, chosen, "'(experiment ' || scene || ', no real cloth)'", "IS NULL"))
    add_table(tables, table, table.title, kOfPairs);
}

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

/// Current comparisons of an experiment (?1) with simulations of its own start, or its pairs:
/// sheet, model, solver, what is compared, mean distance, whether it is at rest, whether its
/// measurement is NO-GO; the spacing of a mesh.
constexpr const char *kReal = R"sql(
SELECT rig || '_' || measured_set || '_' || substr(measured, 1, 6) AS head, measured, model, solver,
  discretisation, CAST(segments AS TEXT), round(mean_dist_mm, 2), status = 'at rest',
  coalesce(measurement, '') = 'NO-GO', spacing_mm, segments
FROM v_real_vs_virtual WHERE scene = ?1 AND simulator = 'drapebench' AND begins = 'scene'
  AND branch IS NULL AND coalesce(state, 'current') = 'current'
ORDER BY head, measured, model, solver, id)sql",
                     *kPairs = R"sql(
SELECT coalesce((SELECT m.rig_name || '_' || m.set_name || '_' || substr(m.sha256, 1, 6)
    FROM sheet AS m WHERE substr(m.sha256, 1, 12) = v.measured), 'virtual') AS head,
  coalesce(measured, ''), model, solver, pair, '', round(mean_dist_mm, 2), both_at_rest,
  coalesce(measurement, '') = 'NO-GO', NULL, NULL
FROM v_virtual_vs_virtual AS v WHERE scene = ?1 AND coalesce(state, 'current') = 'current'
ORDER BY measured IS NOT NULL, head, measured, model, solver, comparison)sql";

/// A column of results: simulations with one model and solver, compared with one measured sheet or
/// (pairs only) without any.
struct PublishedColumn {
  std::vector<std::string> of;  ///< sheet for people, sheet, model, solver
  bool go = true;
  /// Mean distances by grid (or pair) and segments, and whether all of their sheets are at rest.
  std::map<std::pair<std::string, std::string>, std::pair<std::string, bool>> cells = {};
};

/// One table of the paper with a column for each sheet that was compared for the experiment and not
/// replaced since; the model is named if there are several.
Table published_table(const StoreReader& store, std::vector<Published> rows) {
  using Text = std::string;
  const Published first = rows.front();
  std::vector<PublishedColumn> columns;
  std::optional<std::pair<double, int>> finest;  // spacing, and segments below 0
  for (const auto& [head, measured, model, solver, grid, segments, mean_mm, at_rest, no_go,
                    spacing_mm, number] :
       store.rows<Text, Text, Text, Text, Text, Text, Text, bool, bool, std::optional<double>, int>(
           first.real ? kReal : kPairs, {first.experiment})) {
    const std::vector<Text> of = {head, measured, model, solver};
    if (columns.empty() || columns.back().of != of) columns.push_back({of});
    columns.back().go = columns.back().go && !no_go;
    auto& [text, rests] =
        columns.back().cells.try_emplace({grid, segments}, Text(), true).first->second;
    text += (text.empty() ? "" : " / ") + mean_mm;
    rests = rests && at_rest;
    if (!spacing_mm || (finest && *finest <= std::pair(*spacing_mm, -number))) continue;
    if (finest) rows.pop_back();
    finest = {*spacing_mm, -number};
    rows.push_back({first.experiment, true, grid, segments, "", first.table});
  }
  Table table = first.real ? Table({"discretisation", "segments", "published_mm"}, {1, 2})
                           : Table({"pair", "published_mm"}, {1});
  table.title = fmt::format("Table {}. {}, experiment {}{}", first.table,
                            first.real ? "Real vs virtual" : "Virtual vs virtual", first.experiment,
                            !columns.empty() ? ""
                            : first.real     ? " (no measured sheet of it is current in this store)"
                                             : " (no pair of it in this store)");
  for (const PublishedColumn& column : columns) {
    const auto same = std::count_if(columns.begin(), columns.end(),
                                    [&](const auto& other) { return other.of[1] == column.of[1]; });
    Text name = column.of[0];
    if (same > 1) name += "_" + column.of[2] + (column.of[3].empty() ? "" : "_" + column.of[3]);
    table.names.push_back(name + "_mm");
    if (!column.go) table.title += "; measurement NO-GO: " + table.names.back();
    table.numeric.push_back(true);
  }
  const std::size_t before = table.names.size() - columns.size();
  table.names.emplace_back("not_at_rest");
  table.numeric.push_back(false);
  for (const Published& row : rows) {
    std::vector<Text> cells = {row.grid};
    if (row.real) cells.push_back(row.segments);
    cells.push_back(row.mean_mm);
    Text moving;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto found = columns[i].cells.find({row.grid, row.segments});
      const bool there = found != columns[i].cells.end();
      cells.push_back(there ? found->second.first : "");
      if (there && !found->second.second)
        moving += (moving.empty() ? "" : ", ") + table.names[before + i];
    }
    cells.push_back(moving);
    table.add(std::move(cells));
  }
  return table;
}

}  // namespace

std::vector<Table> paper_tables(const StoreReader& store, const ResultFilter& filter) {
  store.require_as_written(kBehindTables);
  const Selection chosen = selection_of(store, filter);
  std::vector<Table> tables;
  add_drapes(store, chosen, tables);
  add_table(tables,
            store.query(fmt::format(R"sql(
SELECT scene, fabric, discretisation, segments, branch, round(energy_uJ, 2) AS energy_uJ,
  round(above_least_uJ, 2) AS above_least_uJ, starts, hem_nodes,
  round(mean_dist_mm, 3) AS mean_dist_mm, round(match_mm, 3) AS match_mm, least_energy, nearest,
  measured, comparison FROM v_branches WHERE comparison IN (SELECT v.comparison FROM {}{}))sql",
                                    chosen.from, chosen.where),
                        chosen.parameters),
            "Branches (equilibria of one drape, by energy)", {"fabric"});
  // A surface without marks has no mesh, segments or model.
  if (discretisation_of(filter).empty() && !filter.segments && filter.model.empty())
    add_table(tables, surfaces_of(store, filter),
              "Real vs surface (meshes without material correspondence)", {"fabric"});
  if (!of_runs(filter) && filter.rig.empty() && filter.calibration.empty())
    add_alone(store, filter, tables);
  return tables;
}

std::vector<Table> published_tables(const StoreReader& store, const std::string& published_csv,
                                    const std::string& experiment) {
  store.require_as_written(kBehindTables);
  std::vector<Table> tables;
  std::set<std::string> known;
  const std::vector<Published> list = read_published(published_csv);
  for (auto row = list.begin(); row != list.end();) {
    const auto end = std::find_if(
        row, list.end(), [&](const Published& other) { return other.table != row->table; });
    known.insert(row->experiment);
    if (experiment.empty() || row->experiment == experiment)
      tables.push_back(published_table(store, {row, end}));
    row = end;
  }
  if (tables.empty() && !experiment.empty())
    throw usage_error(fmt::format("the paper has no experiment `{}`", experiment),
                      fmt::format("it has: {}", fmt::join(known, ", ")));
  return tables;
}

}  // namespace drape::compare
