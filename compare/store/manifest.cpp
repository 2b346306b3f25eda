// SPDX-License-Identifier: Apache-2.0
#include "compare/store/manifest.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <SQLiteCpp/Savepoint.h>
#include <fmt/format.h>
#include <zlib.h>

#include <map>

#include "compare/schema/schema.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kLargestBlob = std::int64_t{1} << 30;

std::vector<Manifest> manifests_in(SQLite::Database& database, const char* which) {
  std::vector<Manifest> all;
  for (const auto& [number, previous, last, size, sha256] :
       rows_of<std::int64_t, std::string, std::int64_t, std::int64_t, std::string>(
           database, fmt::format("SELECT number, previous_sha256, last, file_size, sha256 FROM "
                                 "manifest ORDER BY number {}",
                                 which)))
    all.push_back({number, previous, last, size, sha256});
  return all;
}

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

std::vector<Manifest> manifests_of(SQLite::Database& database) {
  return manifests_in(database, "");
}

Manifest last_manifest(SQLite::Database& database) {
  const std::vector<Manifest> last = manifests_in(database, "DESC LIMIT 1");
  return last.empty() ? Manifest() : last.front();
}

std::string hash_of(SQLite::Database& database, const Manifest& manifest,
                    std::int64_t last_before) {
  std::string text = fmt::format("drapebench/manifest/1\n{}\n{}\n{}\n", manifest.number,
                                 manifest.previous_sha256, manifest.file_size);
  SQLite::Statement rows(
      database,
      "SELECT sequence || ' ' || kind || ' ' || coalesce(number, '') || ' ' || "
      "sha256 || ' ' || length(key) || ' ' || key || char(10) FROM listed WHERE sequence > ? AND "
      "sequence <= ? ORDER BY sequence");
  rows.bind(1, last_before);
  rows.bind(2, manifest.last);
  while (rows.executeStep()) text += rows.getColumn(0).getString();
  return sha256_of(std::string_view(text));
}

void write_manifest(SQLite::Database& database, const std::vector<ListedKey>& added) {
  RowReader reader(database);
  const Manifest before = last_manifest(database);
  Manifest manifest{before.number + 1, before.sha256, before.last, 0, {}};
  SQLite::Statement insert(database, "INSERT INTO listed VALUES (?, ?, ?, ?, ?)");
  for (const auto& [table, key] : added) {
    const ListedRows rows = reader.read(*table, key);
    if (rows.count == 0) continue;
    if (first_of<int>(database, "SELECT 1 FROM listed WHERE kind = ? AND key = ?",
                      {table->name, key})) {
      const std::string altered = reader.alteration(*table, key);
      if (altered.empty()) continue;
      throw not_as_written(database.getFilename(), altered);
    }
    insert.reset();
    insert.clearBindings();
    bind_all(insert, {++manifest.last, table->name, key, rows.number, rows.sha256});
    insert.exec();
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
