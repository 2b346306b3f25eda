// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "compare/schema/schema.hpp"
#include "compare/store/manifest.hpp"
#include "compare/store/store.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Values of columns that a store of version 1 does not have under these names; it had no ledger,
/// no number of a comparison and no table calibration_file.
const std::map<std::string, std::map<std::string, std::string>> kFrom1 = {
    {"mark_error",
     {{"comparison_id", "(SELECT id FROM comparison WHERE sha256 = comparison_sha256)"}}},
    {"simulation", {{"simulator", "'drapebench'"}}}};

/// Copies the rows of the old table into the new one, by columns of the same name.
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

/// Creates every table that is absent or differs from today's definition, keeping its rows.
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

/// Adds missing definitions; existing ones are unchanged.
void make_metrics(SQLite::Database& database) {
  for (const Relation& table : relations())
    for (const RelationColumn& column : table.columns)
      if (!column.definition.empty())
        execute(database, "INSERT OR IGNORE INTO metric VALUES (?, ?, ?, ?)",
                {column.name, column.unit, column.definition, column.better});
}

/// Creates everything around the tables, and a manifest of all rows except `left_out`, in the order
/// of `former`, a table like the ledger.
void complete(SQLite::Database& database, const std::set<ListedKey>& left_out = {},
              const char* former = "listed") {
  make_metrics(database);
  for (const std::string& statement : surrounding_statements()) database.exec(statement);
  std::vector<ListedKey> all;
  for (const ListedTable& table : listed_tables())
    for (const auto& [key] : rows_of<std::string>(
             database,
             fmt::format(
                 "SELECT {0} AS key FROM {1} AS t GROUP BY 1 ORDER BY (SELECT sequence FROM {2} "
                 "WHERE kind = '{1}' AND key = {0}), min({3}), 1",
                 table.key, table.name, former, table.number)))
      if (!left_out.contains({&table, key})) all.emplace_back(&table, key);
  write_manifest(database, all);
  database.exec(fmt::format("PRAGMA user_version = {}", store_version()));
}

/// Tables of a row of version 2 to 10 and of its dependent rows, as hashed by an entry of its
/// ledger under the name of the first.
using LedgerKind = std::vector<const char*>;
const LedgerKind kLedgerKinds[] = {{"metric"},
                                   {"rig"},
                                   {"calibration"},
                                   {"calibration_file", "calibration_camera"},
                                   {"recording"},
                                   {"fabric"},
                                   {"sheet", "gap"},
                                   {"simulation"},
                                   {"refinement"},
                                   {"drapemeter", "hem_harmonic"},
                                   {"comparison", "mark_error"},
                                   {"simulation_pair"},
                                   {"branch"},
                                   {"branch_turn"},
                                   {"acceptance", "acceptance_figure"},
                                   {"surface_comparison"},
                                   {"run", "run_drape", "run_comparison", "run_value"},
                                   {"run_repetition"},
                                   {"run_match", "match_basis", "real_repeat"}};

std::string ledger_content(SQLite::Database& database, const LedgerKind& kind,
                           const std::string& key) {
  std::string bytes = fmt::format("drapebench/content/1\n{}\n", kind.front());
  for (const char* name : kind) {
    const ListedTable& table = listed_table(name);
    // Ordered by numbers, where today's order is that of what they number.
    const char* order =
        table.name == "run_comparison" ? " ORDER BY comparison_id" : table.order.c_str();
    const std::vector<RelationColumn>& columns = relation(name).columns;
    SQLite::Statement row(
        database, fmt::format("SELECT * FROM {} AS t WHERE {}{}", name, table.with_key, order));
    row.bind(1, key);
    while (row.executeStep()) {
      bytes += '\n';
      for (int i = 0; i < row.getColumnCount(); ++i) {
        const SQLite::Column value = row.getColumn(i);
        if (columns.at(static_cast<std::size_t>(i)).since == 0 || !value.isNull())
          append_value(bytes, value);
      }
    }
    bytes += "\n;";
  }
  return sha256_of(std::string_view(bytes));
}

/// Rows that differ from the ledger, with a sentence about each.
std::map<ListedKey, std::string> altered_since(SQLite::Database& database) {
  std::map<ListedKey, std::string> altered;
  std::string head;
  std::int64_t expected = 0;
  bool chained = true;
  using Text = std::string;
  for (const LedgerKind& kind : kLedgerKinds)
    for (const auto& [key] : rows_of<Text>(
             database, fmt::format("SELECT {1} FROM {0} AS t WHERE {1} NOT IN (SELECT key FROM "
                                   "ledger WHERE kind = '{0}')",
                                   kind.front(), listed_table(kind.front()).key)))
      altered[{&listed_table(kind.front()), key}] =
          fmt::format("{} `{}` was not written by drapebench", kind.front(), key);
  for (const auto& [sequence, name, key, content, written] :
       rows_of<std::int64_t, Text, Text, Text, Text>(
           database,
           "SELECT sequence, kind, key, content_sha256, chain_sha256 FROM ledger ORDER BY "
           "sequence")) {
    const auto* kind =
        std::find_if(std::begin(kLedgerKinds), std::end(kLedgerKinds),
                     [&, &of = name](const LedgerKind& one) { return one.front() == of; });
    head = sha256_of(std::string_view(fmt::format("drapebench/ledger/1\n{}\n{}\n{}\n{}\n{}\n", head,
                                                  sequence, name, key, content)));
    chained = chained && sequence == ++expected && head == written;
    head = written;
    if (kind == std::end(kLedgerKinds)) continue;
    if (chained && ledger_content(database, *kind, key) == content) continue;
    for (const char* table : *kind)
      altered[{&listed_table(table), key}] =
          fmt::format("{} `{}` is not what was written", name, key);
  }
  return altered;
}

/// Stores the sheets and lists that older versions copied beside the store under their hashes.
void take_copies(SQLite::Database& database, const fs::path& file) {
  const fs::path folder = real_store(file).string() + ".files";
  std::error_code absent;
  for (const auto& entry : fs::recursive_directory_iterator(folder, absent)) {
    if (!entry.is_regular_file() || entry.path().extension() != ".json") continue;
    const std::string content = read_text(entry.path());
    if (const std::string sha256 = sha256_of(std::string_view(content));
        sha256 == entry.path().stem().string())
      add_blob(database, sha256, content);
  }
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

void migrate(SQLite::Database& database, int from_version, const fs::path& file,
             std::vector<std::string>* lost) {
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
  // References to a table that is recreated refer to the new one.
  database.exec("PRAGMA legacy_alter_table = ON");
  make_tables(database, from_version);
  database.exec("PRAGMA legacy_alter_table = OFF");
  std::set<ListedKey> left_out;
  if (from_version > 1) {
    for (const auto& [key, why] : altered_since(database)) {
      if (lost == nullptr) throw not_as_written(file, why);
      lost->push_back(why);
      left_out.insert(key);
    }
    database.exec(
        "CREATE TEMP TABLE former (kind, key, sequence, PRIMARY KEY (kind, key)); INSERT "
        "INTO former SELECT kind, key, sequence FROM ledger; DROP TABLE ledger");
  }
  take_copies(database, file);
  complete(database, left_out, from_version > 1 ? "former" : "listed");
  database.exec("DROP TABLE IF EXISTS temp.former");
  const std::vector<std::string> strange = schema_findings(database);
  if (lost == nullptr && !strange.empty()) throw not_as_written(file, strange.front());
  transaction.commit();
}

}  // namespace drape::compare
