// SPDX-License-Identifier: Apache-2.0
#include "compare/store/migrate.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

#include "compare/schema/schema.hpp"
#include "compare/store/ledger.hpp"
#include "compare/store/rows.hpp"
#include "compare/store/store.hpp"
#include "core/error.hpp"

namespace drape::compare {
namespace {

/// Values of columns that a store of version 1 has not by name; it had no ledger, no number
/// of a comparison and no table calibration_file.
const std::map<std::string, std::map<std::string, std::string>> kFrom1 = {
    {"mark_error",
     {{"comparison_id", "(SELECT id FROM comparison WHERE sha256 = comparison_sha256)"}}},
    {"simulation", {{"simulator", "'drapebench'"}}}};

/// Brings what the old table holds into the new one: columns of the same name.
void copy_rows(SQLite::Database& database, const Relation& table) {
  std::vector<std::string> names, values;
  for (const RelationColumn& column : table.columns) {
    const bool had = first_of<int>(database, "SELECT 1 FROM pragma_table_info(?) WHERE name = ?",
                                   {"old_" + table.name, column.name})
                         .has_value();
    const auto from_1 = kFrom1.find(table.name);
    const bool made = !had && from_1 != kFrom1.end() && from_1->second.count(column.name) != 0;
    if (!had && !made) continue;
    names.push_back('"' + column.name + '"');
    values.push_back(had ? names.back() : from_1->second.at(column.name));
  }
  database.exec(fmt::format("INSERT INTO {0} ({1}) SELECT {2} FROM old_{0}", table.name,
                            fmt::join(names, ", "), fmt::join(values, ", ")));
}

/// Makes every table that is absent or not as it is made today; its rows are kept.
void make_tables(SQLite::Database& database, int from_version) {
  std::vector<std::string> changed;
  for (const Relation& table : relations()) {
    const auto made = first_of<std::string>(
        database, "SELECT sql FROM sqlite_master WHERE type = 'table' AND name = ?", {table.name});
    if (!made || *made == table.statement) continue;
    database.exec(fmt::format("ALTER TABLE {0} RENAME TO old_{0}", table.name));
    changed.push_back(table.name);
  }
  for (const Relation& table : relations())
    if (!database.tableExists(table.name)) database.exec(table.statement);
  for (const std::string& table : changed) copy_rows(database, relation(table));
  if (from_version == 1)
    database.exec(
        "INSERT INTO calibration_file SELECT sha256, method FROM old_calibration WHERE method IS "
        "NOT NULL");
  for (const std::string& table : changed) database.exec("DROP TABLE old_" + table);
}

/// A definition that is there stays as it is.
void make_metrics(SQLite::Database& database) {
  for (const Relation& table : relations())
    for (const RelationColumn& column : table.columns)
      if (!column.definition.empty())
        execute(database, "INSERT OR IGNORE INTO metric VALUES (?, ?, ?, ?)",
                {column.name, column.unit, column.definition, column.better});
}

void complete(SQLite::Database& database) {
  make_metrics(database);
  for (const std::string& statement : surrounding_statements()) database.exec(statement);
  LedgerWriter(database).append_missing();
  database.exec(fmt::format("PRAGMA user_version = {}", store_version()));
}

}  // namespace

int version_of(SQLite::Database& database, const std::filesystem::path& file) {
  const auto value = [&](const char* sql) { return database.execAndGet(sql).getInt(); };
  const int id = value("PRAGMA application_id"), version = value("PRAGMA user_version");
  if (id == 0 && version == 0 && value("SELECT count(*) FROM sqlite_master") == 0) return 0;
  if (id != kApplicationId)
    throw bad_input("this SQLite file is not a drapebench results store", {.file = file.string()},
                    "name another file with --store");
  const Where where{.file = file.string(), .field = "user_version"};
  if (version < 1)
    throw bad_input(fmt::format("there is no results store of version {}", version), where,
                    "restore the store from a backup");
  if (version > store_version())
    throw bad_input(fmt::format("the results store has version {}, this program knows version {}",
                                version, store_version()),
                    where, "use the newer drapebench that wrote it");
  return version;
}

void create_store(SQLite::Database& database) {
  database.exec(fmt::format("PRAGMA application_id = {}", kApplicationId));
  make_tables(database, store_version());
  complete(database);
}

void migrate(SQLite::Database& database, int from_version) {
  SQLite::Transaction transaction(database, SQLite::TransactionBehavior::EXCLUSIVE);
  // Another program may have been faster.
  if (database.execAndGet("PRAGMA user_version").getInt() != from_version) return;
  if (from_version < 1 || from_version >= store_version())
    throw internal_error(fmt::format("there is no migration from store version {}", from_version));
  for (const auto& [statement] : rows_of<std::string>(
           database,
           "SELECT 'DROP ' || type || ' \"' || name || '\"' FROM sqlite_master WHERE type IN "
           "('view', 'index', 'trigger') AND sql IS NOT NULL"))
    database.exec(statement);
  if (from_version == 1) database.exec("DELETE FROM metric");  // under other definitions
  // References to a table that is made again go to the new one.
  database.exec("PRAGMA legacy_alter_table = ON");
  make_tables(database, from_version);
  database.exec("PRAGMA legacy_alter_table = OFF");
  complete(database);
  transaction.commit();
}

}  // namespace drape::compare
