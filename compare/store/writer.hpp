// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "compare/store/manifest.hpp"
#include "compare/store/rows.hpp"
#include "compare/store/store.hpp"

namespace drape::compare {

/// One write transaction. Prepared statements are cached; new rows are listed in one manifest, and
/// existing ones are checked against the manifest that lists them.
class Writer {
 public:
  explicit Writer(SQLite::Database& database);

  /// Inserts one row, with cells in the order of the table's columns; false if it already exists,
  /// which leaves it unchanged.
  template <class... Values>
  bool insert(const std::string& table, const Values&... values) {
    return insert_row(table, {Cell(values)...});
  }
  bool insert_row(const std::string& table, const Cells& row);
  /// Inserts the rows of one key as they are in another store (RowReader).
  void insert_listed(const ListedTable& table, const std::string& key,
                     const std::vector<Cells>& rows);
  /// Adds content under its hash, with its path relative to the store's folder.
  void insert_blob(const std::string& sha256, std::string_view content);
  void insert_file(const std::string& sha256, const std::string& path);

  [[nodiscard]] bool has(const std::string& table, const std::string& sha256);
  /// First cell of the first row of a query.
  template <class T>
  [[nodiscard]] std::optional<T> value(const std::string& sql, const Cells& parameters) {
    return first_of<T>(database_, sql, parameters);
  }
  /// Texts from a query with one text in each row.
  [[nodiscard]] std::vector<std::string> texts(const std::string& sql, const Cells& parameters);
  [[nodiscard]] int last_id() const { return static_cast<int>(database_.getLastInsertRowid()); }
  [[nodiscard]] SQLite::Database& database() { return database_; }
  /// Throws Error(bad_input) for rows that differ from their manifest.
  void commit();

 private:
  void add(const ListedTable& table, const std::string& key);

  SQLite::Database& database_;
  SQLite::Transaction transaction_;
  std::int64_t manifest_;  ///< number of the manifest to be written
  std::vector<ListedKey> added_;
  std::set<ListedKey> known_;  ///< added or existing before
  std::map<std::string, SQLite::Statement> statements_;
};

}  // namespace drape::compare
