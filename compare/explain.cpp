// SPDX-License-Identifier: Apache-2.0
#include "compare/explain.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "compare/other_mesh.hpp"
#include "compare/provenance.hpp"
#include "compare/results.hpp"
#include "compare/seal.hpp"
#include "core/error.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Where the seal says that a sheet lies.
fs::path sheet_file(const StoreReader& store, const std::string& sha256) {
  const Seal seal = read_seal(store.file());
  const fs::path folder =
      store.file().has_parent_path() ? store.file().parent_path() : fs::path(".");
  for (const auto& [name, hash] : seal.files) {
    const fs::path file = (folder / name).lexically_normal();
    if (hash == sha256) return file;
    const auto other = other_mesh_id(file);
    if (other && other->sha256 == sha256) return file;
  }
  return {};
}

void add_chain(const StoreReader& store, RecordBook& book, const std::string& what,
               const std::string& sha256, Explanation& result) {
  const fs::path file = sheet_file(store, sha256);
  if (file.empty()) {
    result.chain.add({"0", what,
                      "another simulator's mesh, or a sheet imported before there were "
                      "seals",
                      sha256, "not followed"});
    result.complete = false;
    return;
  }
  if (const auto other = other_mesh_id(file); other && other->sha256 == sha256) {
    result.chain.add(
        {"0", file.generic_string(), "written by people", *book.sha256(file), "unchanged"});
    result.chain.add({"1", "  " + other->mesh.generic_string(), "another simulator's mesh",
                      other->mesh_sha256, "unchanged"});
    return;
  }
  for (const ChainLink& link : chain_of(book, file, sha256)) {
    const std::string indent(2 * static_cast<std::size_t>(link.depth), ' ');
    result.chain.add({std::to_string(link.depth), indent + link.file.generic_string(), link.made_by,
                      link.sha256, link.state});
    result.complete = result.complete && link.state == "unchanged";
  }
}

double number_of(const std::string& text) {
  return text.empty() ? 0 : std::stod(text);
}

}  // namespace

Explanation explain(const StoreReader& store, const std::string& key, const std::string& metric) {
  const StoredKey stored = stored_key(store, key);
  const std::string& full = stored.sha256;
  const bool marks = stored.table == "comparison";
  const Table row = store.query("SELECT * FROM " + stored.table + " WHERE sha256 = ?", {full});
  const auto column = std::find(row.names.begin(), row.names.end(), metric);
  const Table meaning = store.query("SELECT unit, definition FROM metric WHERE name = ?", {metric});
  if (column == row.names.end() || meaning.rows.empty()) {
    std::string names;
    for (const auto& known : store
                                 .query("SELECT name FROM metric WHERE name IN (SELECT name FROM "
                                        "pragma_table_info(?))",
                                        {stored.table})
                                 .rows)
      names += (names.empty() ? "" : ", ") + known[0];
    throw usage_error(fmt::format("a comparison has no metric `{}`", metric), "it has: " + names);
  }
  const auto value = [&](const std::string& name) {
    const auto at = std::find(row.names.begin(), row.names.end(), name) - row.names.begin();
    return row.rows[0][static_cast<std::size_t>(at)];
  };
  Explanation result;
  result.number.names = {"what", "value"};
  result.number.numeric = {false, false};
  const std::string number = value(metric);
  result.number.add({metric, number.empty() ? "not known" : number + " " + meaning.rows[0][0]});
  result.number.add({"definition", meaning.rows[0][1]});
  result.number.add({"comparison", full});
  if (marks) {
    result.number.add({"rows", value("marks") + " rows of mark_error (drape-results show " +
                                   full.substr(0, 12) + ")"});
    result.number.add(
        {"worst mark", fmt::format("row {}, col {}", value("worst_row"), value("worst_col"))});
  }
  result.chain.names = {"depth", "file", "made_by", "sha256", "state"};
  result.chain.numeric = {true, false, false, false, false};
  RecordBook book;
  add_chain(store, book, "measured sheet", value("measured_sha256"), result);
  add_chain(store, book, "virtual sheet", value(marks ? "simulated_sha256" : "mesh_sha256"),
            result);
  return result;
}

Difference difference_of(const StoreReader& store, const std::string& first,
                         const std::string& second) {
  const std::string a = full_key(store, first), b = full_key(store, second);
  const Table rows = store.query(
      "SELECT s.scene, s.grid_rows || 'x' || s.grid_cols AS grid_size, s.segments, "
      "s.simulator, s.model, c.* FROM comparison AS c JOIN simulation AS s ON s.sheet_sha256 = "
      "c.simulated_sha256 WHERE c.sha256 IN (?1, ?2) ORDER BY c.sha256 <> ?1",
      {a, b});
  Difference result;
  result.metrics.names = {"what", "A", "B", "B - A", "unit"};
  result.metrics.numeric = {false, true, true, true, false};
  const Table units = store.query("SELECT name, unit FROM metric");
  const auto& one = rows.rows.front();
  const auto& two = rows.rows.back();
  for (std::size_t i = 0; i < rows.names.size(); ++i) {
    const auto unit = std::find_if(units.rows.begin(), units.rows.end(),
                                   [&](const auto& u) { return u[0] == rows.names[i]; });
    if (unit != units.rows.end() && !one[i].empty() && !two[i].empty()) {
      result.metrics.add({rows.names[i], fmt::format("{:.4f}", number_of(one[i])),
                          fmt::format("{:.4f}", number_of(two[i])),
                          fmt::format("{:+.4f}", number_of(two[i]) - number_of(one[i])),
                          (*unit)[1]});
    } else if (unit == units.rows.end() && one[i] != two[i] && rows.names[i] != "id") {
      // Of a hash its beginning, which every command takes.
      const auto shown = [](const std::string& cell) {
        return cell.size() == 64 ? cell.substr(0, 12) : cell;
      };
      result.metrics.add({rows.names[i], shown(one[i]), shown(two[i]), "", ""});
    }
  }
  result.marks = store.query(
      "SELECT a.\"row\", a.\"col\", round(a.distance_mm, 3) AS a_mm, round(b.distance_mm, 3) AS "
      "b_mm, round(b.distance_mm - a.distance_mm, 3) AS b_minus_a_mm FROM mark_error AS a JOIN "
      "mark_error AS b ON b.\"row\" = a.\"row\" AND b.\"col\" = a.\"col\" WHERE a.comparison_id = "
      "(SELECT id FROM comparison WHERE sha256 = ?1) AND b.comparison_id = (SELECT id FROM "
      "comparison WHERE sha256 = ?2) ORDER BY a.\"row\", a.\"col\"",
      {a, b});
  return result;
}

}  // namespace drape::compare
