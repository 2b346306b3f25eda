// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "compare/history/explain.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

/// One line of published.csv.
struct Published {
  std::string experiment;
  bool real = false;     ///< real against virtual
  std::string grid;      ///< "21x21"; of a pair its label
  std::string segments;  ///< empty for a pair
  std::string mean_mm;
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

int table_number(const std::string& text, const std::string& file, int line) {
  if (!text.empty() && text.size() < 4 && text.find_first_not_of("0123456789") == std::string::npos)
    return std::stoi(text);
  throw bad_input("the number of the table is `" + text + "`", {.file = file, .line = line},
                  "give rigs/paper/published.csv");
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
    Published row{c[0], c[2] == "real-virtual",          c[3] + "x" + c[3], c[4],
                  c[7], table_number(c[1], file, number)};
    if (!row.real) {
      row.grid = c[3] == c[5] ? fmt::format("{0}x{0}: {1} seg vs {2} seg", c[3], c[4], c[6])
                              : fmt::format("{0} seg: {1}x{1} vs {2}x{2}", c[4], c[3], c[5]);
      row.segments.clear();
    }
    list.push_back(std::move(row));
  }
  return list;
}

/// A column of results: simulations of one model and solver, against one measured sheet or (pairs
/// only) without any.
struct PublishedColumn {
  std::string head, measured, model, solver;
  bool go = true;
};

/// Sheets that were compared for the experiment and not replaced since; the model is named where
/// there are several.
std::vector<PublishedColumn> columns_of(const StoreReader& store, const Published& row) {
  const Table found =
      row.real ? store.query(
                     "SELECT rig || '_' || measured_set || '_' || substr(measured, 1, 6) "
                     "AS head, measured, model, solver, max(coalesce(measurement, '') = 'NO-GO') "
                     "FROM v_real_vs_virtual WHERE scene = ?1 AND simulator = 'drapebench' AND "
                     "branch IS NULL AND coalesce(state, 'current') = 'current' GROUP BY head, "
                     "measured, model, solver ORDER BY head, model, solver",
                     {row.experiment})
               : store.query(
                     "SELECT coalesce((SELECT m.rig_name || '_' || m.set_name || '_' || "
                     "substr(m.sha256, 1, 6) FROM sheet AS m WHERE substr(m.sha256, 1, 12) = "
                     "v.measured), 'virtual') AS head, coalesce(measured, ''), model, solver, "
                     "max(coalesce(measurement, '') = 'NO-GO') FROM v_virtual_vs_virtual AS v "
                     "WHERE scene = ?1 AND coalesce(state, 'current') = 'current' GROUP BY head, "
                     "measured, model, solver ORDER BY measured IS NOT NULL, head, model, solver",
                     {row.experiment});
  std::vector<PublishedColumn> columns;
  for (const auto& c : found.rows) {
    const auto same = std::count_if(found.rows.begin(), found.rows.end(),
                                    [&](const auto& other) { return other[1] == c[1]; });
    columns.push_back({same > 1 ? fmt::format("{}_{}_{}_mm", c[0], c[2], c[3]) : c[0] + "_mm", c[1],
                       c[2], c[3], c[4] != "1"});
  }
  return columns;
}

/// The cell of one column, and what has to be said of it.
struct Cell {
  std::string mean_mm;
  bool at_rest = true;
};

Cell cell_of(const StoreReader& store, const Published& row, const PublishedColumn& column) {
  const Table found =
      row.real
          ? store.query(
                "SELECT round(mean_dist_mm, 2), status = 'at rest' FROM v_real_vs_virtual WHERE "
                "scene = ?1 AND measured = ?2 AND model = ?3 AND solver = ?4 AND grid_size = "
                "?5 AND CAST(segments AS TEXT) = ?6 AND simulator = 'drapebench' AND branch "
                "IS NULL AND coalesce(state, 'current') = 'current' ORDER BY id",
                {row.experiment, column.measured, column.model, column.solver, row.grid,
                 row.segments})
          : store.query(
                "SELECT round(mean_dist_mm, 2), both_at_rest FROM v_virtual_vs_virtual WHERE "
                "scene = ?1 AND coalesce(measured, '') = ?2 AND model = ?3 AND solver = ?4 "
                "AND pair = ?5 AND coalesce(state, 'current') = 'current'",
                {row.experiment, column.measured, column.model, column.solver, row.grid});
  Cell cell;
  for (const auto& result : found.rows) {
    cell.mean_mm += (cell.mean_mm.empty() ? "" : " / ") + result[0];
    cell.at_rest = cell.at_rest && result[1] == "1";
  }
  return cell;
}

Table head_of(const Published& row, const std::vector<PublishedColumn>& columns) {
  Table table;
  table.title = fmt::format("Table {}. {}, experiment {}{}", row.table,
                            row.real ? "Real vs virtual" : "Virtual vs virtual", row.experiment,
                            !columns.empty() ? ""
                            : row.real       ? " (no measured sheet of it is current in this store)"
                                             : " (no pair of it in this store)");
  table.names = row.real ? std::vector<std::string>{"grid_size", "segments", "published_mm"}
                         : std::vector<std::string>{"pair", "published_mm"};
  table.numeric = row.real ? std::vector<bool>{false, true, true} : std::vector<bool>{false, true};
  for (const PublishedColumn& column : columns) {
    table.names.push_back(column.head);
    if (!column.go) table.title += "; measurement NO-GO: " + column.head;
    table.numeric.push_back(true);
  }
  table.names.emplace_back("not_at_rest");
  table.numeric.push_back(false);
  return table;
}

}  // namespace

std::vector<Table> published_tables(const StoreReader& store, const std::string& published_csv,
                                    const std::string& experiment) {
  std::vector<Table> tables;
  std::vector<PublishedColumn> columns;
  int number = 0;
  std::set<std::string> known;
  for (const Published& row : read_published(published_csv)) {
    known.insert(row.experiment);
    if (!experiment.empty() && row.experiment != experiment) continue;
    if (row.table != number) {
      number = row.table;
      columns = columns_of(store, row);
      tables.push_back(head_of(row, columns));
    }
    std::vector<std::string> cells = {row.grid};
    if (row.real) cells.push_back(row.segments);
    cells.push_back(row.mean_mm);
    std::string moving;
    for (const PublishedColumn& column : columns) {
      const Cell cell = cell_of(store, row, column);
      cells.push_back(cell.mean_mm);
      if (!cell.at_rest) moving += (moving.empty() ? "" : ", ") + column.head;
    }
    cells.push_back(moving);
    tables.back().add(std::move(cells));
  }
  if (tables.empty() && !experiment.empty())
    throw usage_error(fmt::format("the paper has no experiment `{}`", experiment),
                      fmt::format("it has: {}", fmt::join(known, ", ")));
  return tables;
}

}  // namespace drape::compare
