// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace SQLite {
class Database;
}

namespace drape::compare {

/// Rows of one table that belong to one unit of the ledger.
struct UnitTable {
  std::string name, condition, order;

  /// "main.gap WHERE sheet_sha256 = ?1"; ?1 is the unit's key. `indexed`: by whatever index.
  [[nodiscard]] std::string rows(const std::string& database = "main", bool indexed = true) const;
};

/// A row of the store with the rows that hang on it, as the ledger counts them: a sheet with its
/// gaps, a comparison with its marks.
struct LedgerKind {
  std::string table, key_column;
  std::vector<UnitTable> tables;  ///< its own first
};

/// Every kind, parents before children.
[[nodiscard]] const std::vector<LedgerKind>& ledger_kinds();
/// Null where there is none.
[[nodiscard]] const LedgerKind* ledger_kind(const std::string& table);

/// Way to read a unit of a file with damaged trees: whole; by tables alone, without
/// their indexes; the row without any that hang on it.
enum class Reading { whole, tables, alone };
/// The query of the rows of one table of a unit.
[[nodiscard]] std::string unit_query(const UnitTable& table, Reading reading = Reading::whole,
                                     bool hangs = false);

/// SHA-256 over type and bytes of every value of one unit. A column that came later counts where it
/// has a value, so that older entries stay true.
[[nodiscard]] std::string content_sha256(SQLite::Database& database, const LedgerKind& kind,
                                         const std::string& key, Reading reading = Reading::whole);

/// SHA-256 that links an entry to the one before it; `previous` is empty for the first.
[[nodiscard]] std::string chain_sha256(const std::string& previous, long long sequence,
                                       const std::string& kind, const std::string& key,
                                       const std::string& content);

/// Adds entries to the chain, remembering its end. Inside a write transaction only.
class LedgerWriter {
 public:
  explicit LedgerWriter(SQLite::Database& database);
  void append(const std::string& kind, const std::string& key);
  /// Every unit that has no entry yet, kind by kind in order of its key (after a migration).
  void append_missing();

 private:
  SQLite::Database& database_;
  std::int64_t sequence_ = 0;
  std::string head_;
};

}  // namespace drape::compare
