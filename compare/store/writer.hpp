// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/store/ledger.hpp"
#include "compare/store/rows.hpp"
#include "compare/store/store.hpp"

namespace drape::compare {

/// One write transaction: prepared statements are kept, and what is new goes into the ledger.
class Writer {
 public:
  explicit Writer(SQLite::Database& database);

  /// Inserts one row, its cells in the order of the table's columns; false when it is there
  /// already, which leaves it as it is.
  template <class... Values>
  bool insert(const std::string& table, const Values&... values) {
    return insert_row(table, {Cell(values)...});
  }
  bool insert_row(const std::string& table, const Cells& row);
  /// The same for a row on which no others hang: closes its unit of the ledger.
  template <class... Values>
  bool insert_unit(const std::string& table, const Values&... values) {
    return insert_unit_row(table, {Cell(values)...});
  }
  /// Closes a unit: its row and all that hang on it are there.
  void enter(const std::string& kind, const std::string& key) { ledger_.append(kind, key); }

  [[nodiscard]] bool has(const std::string& table, const std::string& sha256) {
    return value<int>("SELECT 1 FROM " + table + " WHERE sha256 = ?", {sha256}).has_value();
  }
  /// First cell of the first row of a query.
  template <class T>
  [[nodiscard]] std::optional<T> value(const std::string& sql, const Cells& parameters) {
    return first_of<T>(database_, sql, parameters);
  }
  /// Texts that a query with one text in each row gives.
  [[nodiscard]] std::vector<std::string> texts(const std::string& sql, const Cells& parameters);
  [[nodiscard]] int last_id() const { return static_cast<int>(database_.getLastInsertRowid()); }
  void commit();

 private:
  bool insert_unit_row(const std::string& table, const Cells& row);

  SQLite::Database& database_;
  SQLite::Transaction transaction_;
  LedgerWriter ledger_;
  std::map<std::string, SQLite::Statement> statements_;
};

}  // namespace drape::compare
