// SPDX-License-Identifier: Apache-2.0
#include "compare/store/ledger.hpp"

#include <fmt/format.h>

#include <string_view>

#include "compare/schema/schema.hpp"
#include "compare/store/rows.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

void append_value(std::string& bytes, const Cell& value) {
  constexpr const char* kTypes = "nirt";
  bytes += kTypes[value.index()];
  const auto add = [&](const auto* number) {
    if (number != nullptr) bytes.append(reinterpret_cast<const char*>(number), sizeof *number);
  };
  add(std::get_if<std::int64_t>(&value));
  add(std::get_if<double>(&value));
  if (const auto* text = std::get_if<std::string>(&value))
    bytes += std::to_string(text->size()) + ':' + *text;
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
    for (const Cells& row :
         cells_of(database, unit_query(table, reading, &table != &kind.tables.front()), {key})) {
      bytes += '\n';
      for (std::size_t i = 0; i < row.size(); ++i) {
        const bool later = i < columns.size() && columns[i].since > 0;
        if (!later || !row[i].is_null()) append_value(bytes, row[i]);
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
  for (const auto& [sequence, head] : rows_of<std::int64_t, std::string>(
           database, "SELECT sequence, chain_sha256 FROM ledger ORDER BY sequence DESC LIMIT 1")) {
    sequence_ = sequence;
    head_ = head;
  }
}

void LedgerWriter::append(const std::string& kind, const std::string& key) {
  const LedgerKind* known = ledger_kind(kind);
  if (known == nullptr) throw internal_error("the ledger has no kind `" + kind + "`");
  const std::string content = content_sha256(database_, *known, key);
  ++sequence_;
  head_ = chain_sha256(head_, sequence_, kind, key, content);
  execute(database_, "INSERT INTO ledger VALUES (?, ?, ?, ?, ?)",
          {sequence_, kind, key, content, head_});
}

void LedgerWriter::append_missing() {
  for (const LedgerKind& kind : ledger_kinds())
    for (const auto& [key] : rows_of<std::string>(
             database_, fmt::format("SELECT {1} FROM {0} WHERE {1} NOT IN (SELECT key FROM ledger "
                                    "WHERE kind = '{0}') ORDER BY {2}",
                                    kind.table, kind.key_column,
                                    kind.table == "comparison" ? "id" : kind.key_column)))
      append(kind.table, key);
}

}  // namespace drape::compare
