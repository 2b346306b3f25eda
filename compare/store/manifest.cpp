// SPDX-License-Identifier: Apache-2.0
#include "compare/store/manifest.hpp"

#include <SQLiteCpp/Savepoint.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <regex>

#include "compare/schema/schema.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

/// Columns of the primary key.
std::vector<std::string> primary_key(const Relation& table) {
  static const std::regex list(R"(PRIMARY KEY \((.*)\))"), name(R"(\w+)");
  std::smatch part;
  if (!std::regex_search(table.statement, part, list)) return {table.columns.front().name};
  const std::string names = part[1];
  return {std::sregex_token_iterator(names.begin(), names.end(), name), {}};
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
  table.key = of_manifest ? "CAST(t.manifest AS TEXT)" : fmt::format("t.\"{}\"", key);
  table.with_key =
      of_manifest ? "t.manifest = CAST(?1 AS INTEGER)" : fmt::format("t.\"{}\" = ?1", key);
  std::map<std::string, std::string> value_of;
  for (const RelationColumn& column : relation.columns) {
    const std::string quoted = '"' + column.name + '"';
    std::string value = "t." + quoted, place = "?";
    for (const auto& [name, parent, number] : {std::array<const char*, 3>{"run", "run", "number"},
                                               {"comparison_id", "comparison", "id"}})
      if (column.name == name) {
        value = fmt::format("(SELECT sha256 FROM {} WHERE {} = t.{})", parent, number, quoted);
        place = fmt::format("(SELECT {} FROM {} WHERE sha256 = ?)", number, parent);
        if (name != key) continue;
        table.key = value;
        table.with_key =
            fmt::format("t.{} = (SELECT {} FROM {} WHERE sha256 = ?1)", quoted, number, parent);
      }
    value_of[column.name] = value;
    if ((numbered && column.name == relation.columns[0].name) ||
        (of_manifest && column.name == "manifest") || column.name == "packed")
      continue;
    if (column.name == key) table.key_at = table.columns.size();
    table.columns.push_back(quoted);
    table.values.push_back(value);
    table.places.push_back(place);
    table.later.push_back(column.since > 0);
  }
  for (const std::string& name : primary)
    if (name != key && !numbered)
      table.order += (table.order.empty() ? " ORDER BY " : ", ") + value_of[name];
  return table;
}

}  // namespace

void append_value(std::string& bytes, const SQLite::Column& value) {
  const auto add = [&](char type, const auto& number) {
    bytes += type;
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  if (value.isNull()) {
    bytes += 'n';
  } else if (value.isInteger()) {
    add('i', value.getInt64());
  } else if (value.isFloat()) {
    add('r', value.getDouble());
  } else {
    const auto* text = static_cast<const char*>(value.getBlob());
    const auto size = static_cast<std::size_t>(value.getBytes());
    bytes += value.isText() ? 't' : 'b';
    bytes += std::to_string(size) + ':';
    if (size > 0) bytes.append(text, size);
  }
}

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

SQLite::Statement& RowReader::statement(const ListedTable* table) {
  auto made = statements_.find(table);
  if (made == statements_.end()) {
    std::string sql = "SELECT sha256, number FROM listed WHERE kind = ?2 AND key = ?1";
    if (table != nullptr) {
      std::string with_key = table->with_key;
      if (const auto at = with_key.find(" WHERE "); !indexed_ && at != std::string::npos)
        with_key.insert(at, " NOT INDEXED");
      sql = fmt::format("SELECT {}, {} FROM {} AS t{} WHERE {}{}", table->number,
                        fmt::join(table->values, ", "), table->name, indexed_ ? "" : " NOT INDEXED",
                        with_key, table->order);
    }
    made = statements_.try_emplace(table, database_, sql).first;
  }
  made->second.tryReset();  // an earlier failure, in a damaged file, is not one of this use
  return made->second;
}

ListedRows RowReader::read(const ListedTable& table, const std::string& key, Take take) {
  SQLite::Statement& row = statement(&table);
  row.bind(1, key);
  ListedRows found;
  std::string bytes;
  bytes.reserve(2048);
  bytes += "drapebench/rows/1\n" + table.name + "\n";
  while (row.executeStep()) {
    ++found.count;
    found.number = cell_of(row.getColumn(0));
    bytes += '\n';
    Cells* cells = take == Take::rows ? &found.rows.emplace_back() : nullptr;
    for (std::size_t i = 0; i < table.values.size(); ++i) {
      const SQLite::Column value = row.getColumn(static_cast<int>(i) + 1);
      if (!table.later[i] || !value.isNull()) append_value(bytes, value);
      if (cells != nullptr) cells->push_back(cell_of(value));
    }
  }
  row.reset();
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
  SQLite::Statement& row = statement(nullptr);
  row.bind(1, key);
  row.bind(2, table.name);
  Listed listed;
  if (row.executeStep()) {
    cell_of(row.getColumn(0)).to(listed.sha256);
    listed.number = cell_of(row.getColumn(1));
  }
  row.reset();
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

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kLargestBlob = std::int64_t{1} << 30;

std::int64_t size_of(SQLite::Database& database) {
  return database.execAndGet("PRAGMA page_count").getInt64() *
         database.execAndGet("PRAGMA page_size").getInt64();
}

/// Statements of this version by name, such as "view v_run".
const std::map<std::string, std::string>& own_schema() {
  static const std::map<std::string, std::string> own = [] {
    std::map<std::string, std::string> all;
    const auto add = [&](const std::string& statement) {
      const std::size_t kind = statement.find(' ') + 1, name = statement.find(' ', kind) + 1;
      std::string what = statement.substr(kind, statement.find_first_of(" \n(", name) - kind);
      for (std::size_t i = 0; what[i] != ' '; ++i) what[i] = static_cast<char>(what[i] - 'A' + 'a');
      all[what] = statement;
    };
    for (const Relation& table : relations()) add(table.statement);
    for (const std::string& statement : surrounding_statements()) add(statement);
    return all;
  }();
  return own;
}

}  // namespace

std::vector<Manifest> manifests_of(SQLite::Database& database, const char* which) {
  std::vector<Manifest> all;
  for (const auto& [number, previous, last, size, sha256] :
       rows_of<std::int64_t, std::string, std::int64_t, std::int64_t, std::string>(
           database, fmt::format("SELECT number, previous_sha256, last, file_size, sha256 FROM "
                                 "manifest ORDER BY number {}",
                                 which)))
    all.push_back({number, previous, last, size, sha256});
  return all;
}

Manifest last_manifest(SQLite::Database& database) {
  const std::vector<Manifest> last = manifests_of(database, "DESC LIMIT 1");
  return last.empty() ? Manifest() : last.front();
}

std::string hash_of(SQLite::Database& database, const Manifest& manifest,
                    std::int64_t last_before) {
  std::string text = fmt::format("drapebench/manifest/1\n{}\n{}\n{}\n", manifest.number,
                                 manifest.previous_sha256, manifest.file_size);
  for (const auto& [line] : rows_of<std::string>(
           database,
           "SELECT sequence || ' ' || kind || ' ' || coalesce(number, '') || ' ' || sha256 || ' ' "
           "|| length(key) || ' ' || key || char(10) FROM listed WHERE sequence > ? AND sequence "
           "<= ? ORDER BY sequence",
           {last_before, manifest.last}))
    text += line;
  return sha256_of(std::string_view(text));
}

void write_manifest(SQLite::Database& database, const std::vector<ListedKey>& added) {
  RowReader reader(database);
  const Manifest before = last_manifest(database);
  Manifest manifest{before.number + 1, before.sha256, before.last, 0, {}};
  for (const auto& [table, key] : added) {
    const ListedRows rows = reader.read(*table, key);
    if (rows.count == 0) continue;
    if (first_of<int>(database, "SELECT 1 FROM listed WHERE kind = ? AND key = ?",
                      {table->name, key})) {
      const std::string altered = reader.alteration(*table, key);
      if (altered.empty()) continue;
      throw not_as_written(database.getFilename(), altered);
    }
    execute(database, "INSERT INTO listed VALUES (?, ?, ?, ?, ?)",
            {++manifest.last, table->name, key, rows.number, rows.sha256});
  }
  if (manifest.last == before.last) return;
  // The row of the manifest itself can need another page.
  manifest.file_size = size_of(database);
  for (;;) {
    SQLite::Savepoint trial(database, "manifest");
    manifest.sha256 = hash_of(database, manifest, before.last);
    execute(database, "INSERT INTO manifest VALUES (?, ?, ?, ?, ?)",
            {manifest.number, manifest.previous_sha256, manifest.last, manifest.file_size,
             manifest.sha256});
    const std::int64_t size = size_of(database);
    if (size == manifest.file_size) return trial.release();
    manifest.file_size = size;
  }
}

std::vector<std::string> schema_findings(SQLite::Database& database) {
  std::vector<std::string> findings;
  std::map<std::string, std::string> missing = own_schema();
  for (const auto& [what, sql] : rows_of<std::string, std::string>(
           database, "SELECT type || ' ' || name, sql FROM sqlite_master WHERE sql IS NOT NULL")) {
    const auto own = missing.find(what);
    if (own == missing.end()) {
      findings.push_back(what + " is not of this program");
    } else {
      if (own->second != sql) findings.push_back(what + " was altered");
      missing.erase(own);
    }
  }
  for (const auto& [what, sql] : missing) findings.push_back(what + " is not there");
  return findings;
}

std::string size_finding(SQLite::Database& database, const fs::path& file) {
  const Manifest last = last_manifest(database);
  std::error_code absent;
  const auto log = fs::file_size(file.string() + "-wal", absent);
  const bool in_log = !absent && log > 0;
  const std::int64_t size =
      in_log ? size_of(database) : static_cast<std::int64_t>(fs::file_size(file));
  if (last.number == 0 || size == last.file_size) return {};
  return fmt::format("the file has {} bytes, its last manifest says {}", size, last.file_size);
}

bool add_blob(SQLite::Database& database, const std::string& sha256, std::string_view content) {
  if (first_of<int>(database, "SELECT 1 FROM blob WHERE sha256 = ?", {sha256})) return false;
  uLongf size = compressBound(content.size());
  std::string packed(size, '\0');
  if (compress(reinterpret_cast<Bytef*>(packed.data()), &size,
               reinterpret_cast<const Bytef*>(content.data()), content.size()) != Z_OK)
    throw internal_error("a blob cannot be packed");
  SQLite::Statement insert(database, "INSERT INTO blob VALUES (?, ?, ?)");
  insert.bind(1, sha256);
  insert.bind(2, static_cast<std::int64_t>(content.size()));
  insert.bind(3, packed.data(), static_cast<int>(size));
  return insert.exec() > 0;
}

std::optional<std::string> blob_in(SQLite::Database& database, const std::string& sha256,
                                   bool indexed) {
  SQLite::Statement row(database, fmt::format("SELECT size, packed FROM blob{} WHERE sha256 = ?",
                                              indexed ? "" : " NOT INDEXED"));
  row.bind(1, sha256);
  if (!row.executeStep()) return std::nullopt;
  const std::int64_t stated = row.getColumn(0).getInt64();
  const SQLite::Column packed = row.getColumn(1);
  // zlib compresses by a factor of at most 1,032.
  if (stated < 0 || stated > kLargestBlob || stated / 1100 > packed.getBytes()) return std::nullopt;
  std::string content(static_cast<std::size_t>(stated), '\0');
  auto size = static_cast<uLongf>(stated);
  if (uncompress(reinterpret_cast<Bytef*>(content.data()), &size,
                 static_cast<const Bytef*>(packed.getBlob()),
                 static_cast<uLong>(packed.getBytes())) != Z_OK ||
      size != content.size() || sha256_of(std::string_view(content)) != sha256)
    return std::nullopt;
  return content;
}

}  // namespace drape::compare
