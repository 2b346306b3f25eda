// SPDX-License-Identifier: Apache-2.0
#include "compare/store/ledger.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <cstring>
#include <string_view>

#include "compare/schema/schema.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

void append_text(std::string& bytes, char type, const char* text, std::size_t size) {
  bytes += type;
  bytes += std::to_string(size);
  bytes += ':';
  bytes.append(text, size);
}

template <class T>
void append_number(std::string& bytes, char type, T value) {
  static_assert(sizeof(T) == 8);
  char raw[8];
  std::memcpy(raw, &value, 8);
  bytes += type;
  bytes.append(raw, 8);
}

void append_value(std::string& bytes, const SQLite::Column& column) {
  if (column.isNull()) {
    bytes += 'n';
  } else if (column.isInteger()) {
    append_number(bytes, 'i', static_cast<long long>(column.getInt64()));
  } else if (column.isFloat()) {
    append_number(bytes, 'r', column.getDouble());
  } else {
    const char* text = column.getText();
    append_text(bytes, 't', text, static_cast<std::size_t>(column.getBytes()));
  }
}

/// Column of `child` that names the row of `parent` that it hangs on.
std::string reference_to(const Relation& parent, const std::string& key, const Relation& child) {
  const std::size_t at = child.statement.find("REFERENCES " + parent.name + " (");
  if (at == std::string::npos) return key;  // both name one thing by the same hash
  const std::size_t line = child.statement.rfind("\n  ", at) + 3;
  return child.statement.substr(line, child.statement.find(' ', line) - line);
}

/// " ORDER BY " the primary key without `reference`.
std::string order_of(const Relation& table, const std::string& reference) {
  const std::string mark = "PRIMARY KEY (";
  const std::size_t begin = table.statement.find(mark) + mark.size();
  std::string key = table.statement.substr(begin, table.statement.find(')', begin) - begin);
  const std::size_t own = key.find(reference);
  key.erase(own == 0 ? 0 : own - 2, reference.size() + 2);
  return " ORDER BY " + key;
}

LedgerKind kind_of(const std::string& table, const std::vector<std::string>& hanging) {
  const Relation& own = relation(table);
  const bool numbered = own.statement.find(" INTEGER PRIMARY KEY") != std::string::npos;
  const std::string key = own.columns[numbered ? 1 : 0].name;
  LedgerKind kind{table, key, {{table, key + " = ?1", ""}}};
  for (const std::string& name : hanging) {
    const std::string reference = reference_to(own, key, relation(name));
    kind.tables.push_back({name,
                           numbered
                               ? fmt::format("{} = (SELECT {} FROM {{0}}.{}{{1}} WHERE {} = ?1)",
                                             reference, own.columns[0].name, table, key)
                               : reference + " = ?1",
                           order_of(relation(name), reference)});
  }
  return kind;
}

}  // namespace

std::string UnitTable::rows(const std::string& database, bool indexed) const {
  const char* how = indexed ? "" : " NOT INDEXED";
  return fmt::format("{}.{}{} WHERE ", database, name, how) +
         fmt::format(fmt::runtime(condition), database, how);
}

const std::vector<LedgerKind>& ledger_kinds() {
  static const std::vector<LedgerKind> kinds = {
      kind_of("metric", {}),
      kind_of("rig", {}),
      kind_of("calibration", {}),
      kind_of("calibration_file", {"calibration_camera"}),
      kind_of("recording", {}),
      kind_of("fabric", {}),
      kind_of("sheet", {"gap"}),
      kind_of("simulation", {}),
      kind_of("refinement", {}),
      kind_of("drapemeter", {"hem_harmonic"}),
      kind_of("comparison", {"mark_error"}),
      kind_of("simulation_pair", {}),
      kind_of("branch", {}),
      kind_of("branch_turn", {}),
      kind_of("acceptance", {"acceptance_figure"}),
      kind_of("surface_comparison", {}),
      kind_of("run", {"run_drape", "run_comparison", "run_value"}),
      kind_of("run_repetition", {}),
      kind_of("run_match", {"match_basis", "real_repeat"})};
  return kinds;
}

const LedgerKind* ledger_kind(const std::string& table) {
  for (const LedgerKind& kind : ledger_kinds())
    if (kind.table == table) return &kind;
  return nullptr;
}

std::string unit_query(const UnitTable& table, Reading reading, bool hangs) {
  if (hangs && reading == Reading::alone)
    return fmt::format("SELECT * FROM {} WHERE 0 AND ?1 IS NULL", table.name);
  return "SELECT * FROM " + table.rows("main", reading == Reading::whole) + table.order;
}

std::string content_sha256(SQLite::Database& database, const LedgerKind& kind,
                           const std::string& key, Reading reading) {
  std::string bytes = "drapebench/content/1\n" + kind.table + "\n";
  for (const UnitTable& table : kind.tables) {
    const std::vector<RelationColumn>& columns = relation(table.name).columns;
    SQLite::Statement rows(database, unit_query(table, reading, &table != &kind.tables.front()));
    rows.bind(1, key);
    while (rows.executeStep()) {
      bytes += '\n';
      for (std::size_t i = 0; i < static_cast<std::size_t>(rows.getColumnCount()); ++i) {
        const bool later = i < columns.size() && columns[i].since > 0;
        const SQLite::Column value = rows.getColumn(static_cast<int>(i));
        if (!later || !value.isNull()) append_value(bytes, value);
      }
    }
    bytes += "\n;";
  }
  return sha256_of(std::string_view(bytes));
}

std::string chain_sha256(const std::string& previous, long long sequence, const std::string& kind,
                         const std::string& key, const std::string& content) {
  return sha256_of(std::string_view(fmt::format("drapebench/ledger/1\n{}\n{}\n{}\n{}\n{}\n",
                                                previous, sequence, kind, key, content)));
}

LedgerWriter::LedgerWriter(SQLite::Database& database) : database_(database) {
  SQLite::Statement last(
      database, "SELECT sequence, chain_sha256 FROM ledger ORDER BY sequence DESC LIMIT 1");
  if (!last.executeStep()) return;
  sequence_ = last.getColumn(0).getInt64();
  head_ = last.getColumn(1).getString();
}

void LedgerWriter::append(const std::string& kind, const std::string& key) {
  const LedgerKind* known = ledger_kind(kind);
  if (known == nullptr) throw internal_error("the ledger has no kind `" + kind + "`");
  const std::string content = content_sha256(database_, *known, key);
  ++sequence_;
  head_ = chain_sha256(head_, sequence_, kind, key, content);
  SQLite::Statement insert(database_, "INSERT INTO ledger VALUES (?, ?, ?, ?, ?)");
  insert.bind(1, static_cast<int64_t>(sequence_));
  insert.bind(2, kind);
  insert.bind(3, key);
  insert.bind(4, content);
  insert.bind(5, head_);
  insert.exec();
}

void LedgerWriter::append_missing() {
  for (const LedgerKind& kind : ledger_kinds()) {
    std::vector<std::string> keys;
    SQLite::Statement query(
        database_, fmt::format("SELECT {1} FROM {0} WHERE {1} NOT IN (SELECT key FROM ledger WHERE "
                               "kind = '{0}') ORDER BY {2}",
                               kind.table, kind.key_column,
                               kind.table == "comparison" ? "id" : kind.key_column));
    while (query.executeStep()) keys.push_back(query.getColumn(0).getString());
    for (const std::string& key : keys) append(kind.table, key);
  }
}

}  // namespace drape::compare
