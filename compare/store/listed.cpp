// SPDX-License-Identifier: Apache-2.0
#include "compare/store/listed.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "compare/schema/schema.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

/// Columns of the primary key.
std::vector<std::string> primary_key(const Relation& table) {
  const std::string mark = "PRIMARY KEY (";
  const std::size_t at = table.statement.find(mark);
  if (at == std::string::npos) return {table.columns.front().name};
  const std::size_t begin = at + mark.size();
  std::vector<std::string> names;
  std::string name;
  for (const char c : table.statement.substr(begin, table.statement.find(')', begin) - begin + 1)) {
    if (c == ',' || c == ')') {
      names.push_back(name);
      name.clear();
    } else if (c != ' ' && c != '"') {
      name += c;
    }
  }
  return names;
}

ListedTable listed_table_of(const Relation& relation) {
  ListedTable table;
  table.name = relation.name;
  const bool numbered = relation.statement.find(" INTEGER PRIMARY KEY") != std::string::npos;
  const bool of_manifest = relation.name == "file";
  const std::vector<std::string> primary = primary_key(relation);
  // Rows of a run depend on the run, whatever column is first.
  const bool of_run = std::count(primary.begin(), primary.end(), "run") > 0;
  const std::string key = numbered      ? relation.columns[1].name
                          : of_run      ? "run"
                          : of_manifest ? "manifest"
                                        : primary.front();
  table.number = numbered ? "t." + relation.columns[0].name : "NULL";
  std::map<std::string, std::string> value_of;
  for (const RelationColumn& column : relation.columns) {
    if (column.name == key)
      table.key_column = static_cast<std::size_t>(&column - relation.columns.data());
    const std::string quoted = '"' + column.name + '"';
    std::string value = "t." + quoted, place = "?";
    for (const auto& [name, parent, number] : {std::array<const char*, 3>{"run", "run", "number"},
                                               {"comparison_id", "comparison", "id"}})
      if (column.name == name) {
        value = fmt::format("(SELECT sha256 FROM {} WHERE {} = t.{})", parent, number, quoted);
        place = fmt::format("(SELECT {} FROM {} WHERE sha256 = ?)", number, parent);
        if (name == key) table.parent = parent;
      }
    value_of[column.name] = value;
    if ((numbered && column.name == relation.columns[0].name) ||
        (of_manifest && column.name == "manifest") || column.name == "packed")
      continue;
    table.columns.push_back(quoted);
    table.values.push_back(value);
    table.places.push_back(place);
    table.later.push_back(column.since > 0);
  }
  table.key = of_manifest ? "CAST(t.manifest AS TEXT)" : value_of[key];
  table.with_key = of_manifest ? "t.manifest = CAST(?1 AS INTEGER)"
                   : table.parent.empty()
                       ? fmt::format("t.\"{}\" = ?1", key)
                       : fmt::format(
                             "t.\"{0}\" = (SELECT {1} FROM {2} WHERE "
                             "sha256 = ?1)",
                             key, table.parent == "run" ? "number" : "id", table.parent);
  for (const std::string& name : primary)
    if (name != key && !numbered) table.order += (table.order.empty() ? "" : ", ") + value_of[name];
  if (!table.order.empty()) table.order = " ORDER BY " + table.order;
  return table;
}

void append_value(std::string& bytes, sqlite3_stmt* row, int at) {
  const int type = sqlite3_column_type(row, at);
  if (type == SQLITE_NULL) {
    bytes += 'n';
  } else if (type == SQLITE_INTEGER) {
    const sqlite3_int64 value = sqlite3_column_int64(row, at);
    bytes += 'i';
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  } else if (type == SQLITE_FLOAT) {
    const double value = sqlite3_column_double(row, at);
    bytes += 'r';
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  } else {
    const auto* text = static_cast<const char*>(sqlite3_column_blob(row, at));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(row, at));
    bytes += type == SQLITE_TEXT ? 't' : 'b';
    bytes += std::to_string(size) + ':';
    if (size > 0) bytes.append(text, size);
  }
}

Cell cell_of(sqlite3_stmt* row, int at) {
  switch (sqlite3_column_type(row, at)) {
    case SQLITE_NULL:
      return {};
    case SQLITE_INTEGER:
      return sqlite3_column_int64(row, at);
    case SQLITE_FLOAT:
      return sqlite3_column_double(row, at);
    default:
      break;
  }
  const auto* text = static_cast<const char*>(sqlite3_column_blob(row, at));
  return std::string(text == nullptr ? "" : text,
                     static_cast<std::size_t>(sqlite3_column_bytes(row, at)));
}

}  // namespace

const std::vector<ListedTable>& listed_tables() {
  static const std::vector<ListedTable> tables = [] {
    std::vector<ListedTable> list;
    for (const Relation& relation : relations())
      if (relation.name != "listed" && relation.name != "manifest")
        list.push_back(listed_table_of(relation));
    return list;
  }();
  return tables;
}

const ListedTable& listed_table(const std::string& name) {
  for (const ListedTable& table : listed_tables())
    if (table.name == name) return table;
  throw internal_error("manifests list no table `" + name + "`");
}

RowReader::RowReader(SQLite::Database& database, bool indexed)
    : database_(database), indexed_(indexed) {}

RowReader::~RowReader() {
  for (const auto& [table, statement] : statements_) sqlite3_finalize(statement);
}

sqlite3_stmt* RowReader::statement(const ListedTable* table) {
  sqlite3_stmt*& made = statements_[table];
  if (made == nullptr) {
    std::string with_key = table == nullptr ? "" : table->with_key;
    if (!indexed_ && table != nullptr && !table->parent.empty())
      with_key.insert(with_key.find(" WHERE "), " NOT INDEXED");
    const std::string sql =
        table == nullptr ? "SELECT sha256, number FROM listed WHERE kind = ?2 AND key = ?1"
                         : fmt::format("SELECT {}, {} FROM {} AS t{} WHERE {}{}", table->number,
                                       fmt::join(table->values, ", "), table->name,
                                       indexed_ ? "" : " NOT INDEXED", with_key, table->order);
    if (sqlite3_prepare_v2(database_.getHandle(), sql.c_str(), -1, &made, nullptr) != SQLITE_OK)
      throw SQLite::Exception(database_.getHandle());
  }
  sqlite3_reset(made);
  return made;
}

ListedRows RowReader::read(const ListedTable& table, const std::string& key, Take take) {
  sqlite3_stmt* row = statement(&table);
  sqlite3_bind_text(row, 1, key.data(), static_cast<int>(key.size()), SQLITE_TRANSIENT);
  ListedRows found;
  std::string bytes = "drapebench/rows/1\n" + table.name + "\n";
  int step = 0;
  while ((step = sqlite3_step(row)) == SQLITE_ROW) {
    ++found.count;
    found.number = cell_of(row, 0);
    bytes += '\n';
    for (std::size_t i = 0; i < table.values.size(); ++i) {
      const int at = static_cast<int>(i) + 1;
      if (!table.later[i] || sqlite3_column_type(row, at) != SQLITE_NULL)
        append_value(bytes, row, at);
    }
    if (take != Take::rows) continue;
    Cells& cells = found.rows.emplace_back();
    for (std::size_t i = 0; i < table.values.size(); ++i)
      cells.push_back(cell_of(row, static_cast<int>(i) + 1));
  }
  sqlite3_reset(row);
  if (step != SQLITE_DONE) throw SQLite::Exception(database_.getHandle(), step);
  found.sha256 = sha256_of(std::string_view(bytes));
  return found;
}

std::string RowReader::alteration(const ListedTable& table, const std::string& key,
                                  const Listed& listed, long long& count) {
  const ListedRows found = read(table, key);
  count += found.count;
  const char* how = listed.sha256.empty() ? " is in no manifest: drapebench did not write it"
                    : found.count == 0    ? " was deleted"
                    : found.sha256 != listed.sha256 || found.number != listed.number
                        ? " was altered"
                        : "";
  if (*how == '\0' || (listed.sha256.empty() && found.count == 0)) return {};
  return fmt::format("{} {}{}", table.name, key.substr(0, 12), how);
}

std::string RowReader::alteration(const ListedTable& table, const std::string& key) {
  sqlite3_stmt* row = statement(nullptr);
  sqlite3_bind_text(row, 1, key.data(), static_cast<int>(key.size()), SQLITE_TRANSIENT);
  sqlite3_bind_text(row, 2, table.name.c_str(), -1, SQLITE_STATIC);
  Listed listed;
  if (sqlite3_step(row) == SQLITE_ROW) {
    cell_of(row, 0).to(listed.sha256);
    listed.number = cell_of(row, 1);
  }
  sqlite3_reset(row);
  long long count = 0;
  return alteration(table, key, listed, count);
}

std::vector<std::string> RowReader::alterations(const ListedTable& table, long long& keys) {
  std::vector<std::string> found;
  long long count = 0;
  for (const Cells& row : cells_of(
           database_, "SELECT key, sha256, number FROM listed WHERE kind = ? ORDER BY sequence",
           {table.name})) {
    ++keys;
    std::string key;  // can have any type in a damaged file
    Listed listed;
    row[0].to(key);
    row[1].to(listed.sha256);
    listed.number = row[2];
    if (std::string altered = alteration(table, key, listed, count); !altered.empty())
      found.push_back(std::move(altered));
  }
  const auto all = first_of<std::int64_t>(database_, "SELECT count(*) FROM " + table.name);
  if (*all > count)
    found.push_back(fmt::format("{} rows of {} are in no manifest: drapebench did not write them",
                                *all - count, table.name));
  return found;
}

}  // namespace drape::compare
