// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "compare/history/explain.hpp"
#include "core/error.hpp"
#include "core/files/csv.hpp"

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

/// A column of results: simulations of one model and solver, against one measured sheet or (pairs
/// only) without any.
struct PublishedColumn {
  std::string head, measured, model, solver;
  bool go = true;
};

/// Sheets that were compared for the experiment and not replaced since; the model is named where
/// there are several.
constexpr const char* kRealColumns =
    "SELECT rig || '_' || measured_set || '_' || substr(measured, 1, 6) AS head, measured, model, "
    "solver, max(coalesce(measurement, '') = 'NO-GO') FROM v_real_vs_virtual WHERE scene = ?1 AND "
    "simulator = 'drapebench' AND branch IS NULL AND coalesce(state, 'current') = 'current' GROUP "
    "BY head, measured, model, solver ORDER BY head, model, solver";
constexpr const char* kPairColumns =
    "SELECT coalesce((SELECT m.rig_name || '_' || m.set_name || '_' || substr(m.sha256, 1, 6) FROM "
    "sheet AS m WHERE substr(m.sha256, 1, 12) = v.measured), 'virtual') AS head, "
    "coalesce(measured, ''), model, solver, max(coalesce(measurement, '') = 'NO-GO') FROM "
    "v_virtual_vs_virtual AS v WHERE scene = ?1 AND coalesce(state, 'current') = 'current' GROUP "
    "BY head, measured, model, solver ORDER BY measured IS NOT NULL, head, model, solver";
constexpr const char* kRealCells =
    "SELECT round(mean_dist_mm, 2), status = 'at rest' FROM v_real_vs_virtual WHERE scene = ?1 AND "
    "measured = ?2 AND model = ?3 AND solver = ?4 AND grid_size = ?5 AND CAST(segments AS TEXT) = "
    "?6 AND simulator = 'drapebench' AND branch IS NULL AND coalesce(state, 'current') = 'current' "
    "ORDER BY id";
constexpr const char* kPairCells =
    "SELECT round(mean_dist_mm, 2), both_at_rest FROM v_virtual_vs_virtual WHERE scene = ?1 AND "
    "coalesce(measured, '') = ?2 AND model = ?3 AND solver = ?4 AND pair = ?5 AND coalesce(state, "
    "'current') = 'current'";

/// Sheets that were compared for the experiment and not replaced since; the model is named where
/// there are several.
std::vector<PublishedColumn> columns_of(const StoreReader& store, const Published& row) {
  using Text = std::string;
  const auto found = store.rows<Text, Text, Text, Text, bool>(
      row.real ? kRealColumns : kPairColumns, {row.experiment});
  std::vector<PublishedColumn> columns;
  for (const auto& [head, measured, model, solver, no_go] : found) {
    const auto same = std::count_if(found.begin(), found.end(), [&](const auto& other) {
      return std::get<1>(other) == std::get<1>(found[columns.size()]);
    });
    columns.push_back({same > 1 ? fmt::format("{}_{}_{}_mm", head, model, solver) : head + "_mm",
                       measured, model, solver, !no_go});
  }
  return columns;
}

/// The mean distances of one column, and whether all of them are of sheets at rest.
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
  Table table = row.real ? Table({"grid_size", "segments", "published_mm"}, {1, 2})
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
      const auto [mean_mm, at_rest] = cell_of(store, row, column);
      cells.push_back(mean_mm);
      if (!at_rest) moving += (moving.empty() ? "" : ", ") + column.head;
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
