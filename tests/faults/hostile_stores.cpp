// SPDX-License-Identifier: Apache-2.0
// Results stores of another lab: scripts in every text, their own views and triggers, false sizes.
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include "compare/store/manifest.hpp"
#include "core/files/files.hpp"
#include "tests/faults/hostile_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStore = "out/results.sqlite";

std::vector<std::string> column_of(SQLite::Database& database, const std::string& sql) {
  std::vector<std::string> values;
  SQLite::Statement query(database, sql);
  while (query.executeStep()) values.push_back(query.getColumn(0).getString());
  return values;
}

/// Replaces every text of the store except keys by the name, and lists all rows again, as another
/// lab can.
void rename_rows(const HostileBench& bench, const std::string& to) {
  SQLite::Database store((bench.lab() / kStore).string(), SQLite::OPEN_READWRITE);
  const auto triggers =
      column_of(store, "SELECT sql FROM sqlite_master WHERE type = 'trigger' ORDER BY rowid");
  for (const std::string& trigger :
       column_of(store, "SELECT name FROM sqlite_master WHERE type = 'trigger'"))
    store.exec("DROP TRIGGER \"" + trigger + "\"");
  store.exec("DELETE FROM listed; DELETE FROM manifest");
  for (const std::string& table :
       column_of(store, "SELECT name FROM sqlite_master WHERE type = 'table'")) {
    for (const std::string& column : column_of(
             store, fmt::format("SELECT name FROM pragma_table_info('{}') WHERE type = 'TEXT' "
                                "AND name NOT LIKE '%sha256%'",
                                table))) {
      SQLite::Statement update(
          store, fmt::format("UPDATE OR IGNORE \"{0}\" SET \"{1}\" = ? WHERE \"{1}\" IS NOT NULL",
                             table, column));
      update.bind(1, to);
      try {
        update.exec();
      } catch (const SQLite::Exception&) {  // a text that the table's own checks refuse
      }
    }
  }
  for (const std::string& trigger : triggers) store.exec(trigger);
  std::vector<compare::ListedKey> all;
  for (const compare::ListedTable& table : compare::listed_tables())
    for (const std::string& key :
         column_of(store, fmt::format("SELECT {} FROM {} AS t GROUP BY 1", table.key, table.name)))
      all.emplace_back(&table, key);
  compare::write_manifest(store, all);
}

HostileFile renamed(const std::string& name, const std::string& line,
                    const std::string& to = kScriptName) {
  return {name, [to](const HostileBench& b) { rename_rows(b, to); }, line};
}

HostileFile changed(const std::string& name, const std::string& sql, const std::string& line) {
  return {name,
          [sql](const HostileBench& b) {
            SQLite::Database((b.lab() / kStore).string(), SQLite::OPEN_READWRITE).exec(sql);
          },
          line};
}

/// The file with other bytes from `at` on.
HostileFile overwritten(const std::string& name, std::size_t at, const std::string& bytes,
                        const std::string& line) {
  return {name,
          [at, bytes](const HostileBench& b) {
            std::string text = read_text(b.lab() / kStore);
            text.replace(at, bytes.size(), bytes);
            b.write(kStore, text);
          },
          line};
}

constexpr const char* kEndless =
    "WITH RECURSIVE n(x) AS (VALUES(1) UNION ALL SELECT x + 1 FROM n) SELECT x FROM n";

}  // namespace

std::vector<HostileFile> hostile_stores() {
  const std::string at = " --store out/results.sqlite";
  return {
      renamed("script_in_store_history", "results history --out out/history.html" + at),
      renamed("script_in_store_list", "results list --all" + at),
      renamed("script_in_store_tables", "results tables" + at),
      renamed("formula_in_store_csv", "results --csv list --all" + at, kFormulaName),
      renamed("terminal_commands_in_store", "results list --all" + at, "\x1b]0;owned\x07\x1b[2J"),
      renamed("formula_in_store_query", "results --csv sql \"SELECT * FROM sheet\"" + at,
              kFormulaName),
      changed("endless_view_in_store",
              std::string("DROP VIEW IF EXISTS v_table1; CREATE VIEW v_table1 AS ") + kEndless,
              "results sql 'SELECT count(*) FROM v_table1'" + at),
      changed("blob_of_1_gigabyte_in_view",
              "DROP VIEW IF EXISTS v_table1; CREATE VIEW v_table1 AS SELECT "
              "zeroblob(1000000000) AS x",
              "results sql 'SELECT x FROM v_table1'" + at),
      changed("trigger_in_store",
              "CREATE TRIGGER evil AFTER INSERT ON listed BEGIN DELETE FROM comparison; END",
              "results import out" + at),
      changed("newer_store", "PRAGMA user_version = 99", "results list" + at),
      changed("negative_store_version", "PRAGMA user_version = -1", "results list" + at),
      changed("store_without_tables",
              "PRAGMA writable_schema = ON; DELETE FROM sqlite_master WHERE name = 'comparison'",
              "results list" + at),
      overwritten("store_of_false_page_size", 16, std::string("\x02\x00", 2), "results list" + at),
      overwritten("store_of_false_size", 28, "\xff\xff\xff\xff", "results verify" + at),
      overwritten("store_of_noise", 4096, std::string(20000, '\xa5'), "results export sql" + at),
      {"store_is_text", [](const HostileBench& b) { b.write(kStore, kScriptName); },
       "results list" + at},
      {"store_is_empty", [](const HostileBench& b) { b.write(kStore, ""); }, "results list" + at},
  };
}

}  // namespace drape::test
