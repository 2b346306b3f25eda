// SPDX-License-Identifier: Apache-2.0
#include "compare/store/ledger.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

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

const LedgerKind& kind_called(const std::string& name) {
  const auto& kinds = ledger_kinds();
  const auto found = std::find_if(kinds.begin(), kinds.end(),
                                  [&](const LedgerKind& kind) { return kind.table == name; });
  if (found == kinds.end()) throw internal_error("the ledger has no kind `" + name + "`");
  return *found;
}

}  // namespace

const std::vector<LedgerKind>& ledger_kinds() {
  static const std::vector<LedgerKind> kinds = {
      {"metric", "name", {"SELECT * FROM metric WHERE name = ?1"}},
      {"rig", "name", {"SELECT * FROM rig WHERE name = ?1"}},
      {"calibration", "sha256", {"SELECT * FROM calibration WHERE sha256 = ?1"}},
      {"calibration_file",
       "calibration_sha256",
       {"SELECT * FROM calibration_file WHERE calibration_sha256 = ?1",
        "SELECT * FROM calibration_camera WHERE calibration_sha256 = ?1 ORDER BY camera"}},
      {"recording", "sha256", {"SELECT * FROM recording WHERE sha256 = ?1"}},
      {"fabric", "sha256", {"SELECT * FROM fabric WHERE sha256 = ?1"}},
      {"sheet",
       "sha256",
       {"SELECT * FROM sheet WHERE sha256 = ?1",
        "SELECT * FROM gap WHERE sheet_sha256 = ?1 ORDER BY \"row\", \"col\""}},
      {"simulation", "sheet_sha256", {"SELECT * FROM simulation WHERE sheet_sha256 = ?1"}},
      {"refinement", "sheet_sha256", {"SELECT * FROM refinement WHERE sheet_sha256 = ?1"}},
      {"drapemeter",
       "sheet_sha256",
       {"SELECT * FROM drapemeter WHERE sheet_sha256 = ?1",
        "SELECT * FROM hem_harmonic WHERE sheet_sha256 = ?1 ORDER BY \"order\""}},
      {"comparison",
       "sha256",
       {"SELECT * FROM comparison WHERE sha256 = ?1",
        "SELECT * FROM mark_error WHERE comparison_id = (SELECT id FROM comparison WHERE sha256 = "
        "?1) ORDER BY \"row\", \"col\""}},
      {"simulation_pair", "sha256", {"SELECT * FROM simulation_pair WHERE sha256 = ?1"}},
      {"branch", "sheet_sha256", {"SELECT * FROM branch WHERE sheet_sha256 = ?1"}},
      {"branch_turn",
       "comparison_sha256",
       {"SELECT * FROM branch_turn WHERE comparison_sha256 = ?1"}},
      {"acceptance",
       "sha256",
       {"SELECT * FROM acceptance WHERE sha256 = ?1",
        "SELECT * FROM acceptance_figure WHERE acceptance_sha256 = ?1 ORDER BY name"}},
      {"surface_comparison", "sha256", {"SELECT * FROM surface_comparison WHERE sha256 = ?1"}},
      {"run",
       "sha256",
       {"SELECT * FROM run WHERE sha256 = ?1",
        "SELECT * FROM run_drape WHERE run = (SELECT number FROM run WHERE sha256 = ?1) ORDER BY "
        "measured_sha256",
        "SELECT * FROM run_comparison WHERE run = (SELECT number FROM run WHERE sha256 = ?1) ORDER "
        "BY comparison_id",
        "SELECT * FROM run_value WHERE run = (SELECT number FROM run WHERE sha256 = ?1) ORDER BY "
        "owner, key"}},
      {"run_repetition", "sha256", {"SELECT * FROM run_repetition WHERE sha256 = ?1"}},
      {"run_match",
       "sha256",
       {"SELECT * FROM run_match WHERE sha256 = ?1",
        "SELECT * FROM match_basis WHERE match_sha256 = ?1 ORDER BY basis",
        "SELECT * FROM real_repeat WHERE match_sha256 = ?1 ORDER BY sheet_sha256"}},
  };
  return kinds;
}

std::string content_sha256(SQLite::Database& database, const LedgerKind& kind,
                           const std::string& key) {
  std::string bytes = std::string("drapebench/content/1\n") + kind.table + "\n";
  for (const char* query : kind.queries) {
    SQLite::Statement rows(database, query);
    rows.bind(1, key);
    const int columns = rows.getColumnCount();
    while (rows.executeStep()) {
      bytes += '\n';
      for (int i = 0; i < columns; ++i) append_value(bytes, rows.getColumn(i));
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
  const std::string content = content_sha256(database_, kind_called(kind), key);
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
        database_,
        fmt::format("SELECT {1} FROM {0} WHERE {1} NOT IN (SELECT key FROM ledger WHERE "
                    "kind = '{0}') ORDER BY {2}",
                    kind.table, kind.key_column,
                    std::string_view(kind.table) == "comparison" ? "id" : kind.key_column));
    while (query.executeStep()) keys.push_back(query.getColumn(0).getString());
    for (const std::string& key : keys) append(kind.table, key);
  }
}

}  // namespace drape::compare
