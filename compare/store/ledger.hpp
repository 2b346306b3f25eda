// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace SQLite {
class Database;
}

namespace drape::compare {

/// A row of the store with the rows that hang on it, as the ledger counts them: a sheet with its
/// gaps, a comparison with its marks.
struct LedgerKind {
  const char* table;
  const char* key_column;
  std::vector<const char*> queries;  ///< all rows of one unit, in a fixed order; ?1 is its key
};

/// Every kind, parents before children.
[[nodiscard]] const std::vector<LedgerKind>& ledger_kinds();

/// SHA-256 over type and bytes of every value of one unit.
[[nodiscard]] std::string content_sha256(SQLite::Database& database, const LedgerKind& kind,
                                         const std::string& key);

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
  long long sequence_ = 0;
  std::string head_;
};

}  // namespace drape::compare
