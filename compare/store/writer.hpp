// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/store/ledger.hpp"

namespace drape::compare {

inline void bind_one(SQLite::Statement& statement, int index, const std::string& value) {
  statement.bind(index, value);
}
inline void bind_one(SQLite::Statement& statement, int index, int value) {
  statement.bind(index, value);
}
inline void bind_one(SQLite::Statement& statement, int index, double value) {
  statement.bind(index, value);
}
template <class T>
void bind_one(SQLite::Statement& statement, int index, const std::optional<T>& value) {
  if (value) bind_one(statement, index, *value);  // an unbound parameter is NULL
}

/// One write transaction: prepared statements are kept, and what is new goes into the ledger.
class Writer {
 public:
  explicit Writer(SQLite::Database& database)
      : database_(database),
        transaction_(database, SQLite::TransactionBehavior::IMMEDIATE),
        ledger_(database) {}

  /// Inserts one row; false when it is there already, which leaves it as it is.
  template <class... Values>
  bool insert(const std::string& into, const Values&... values) {
    SQLite::Statement& statement = prepared(into, sizeof...(values));
    int index = 0;
    (bind_one(statement, ++index, values), ...);
    const bool added = statement.exec() > 0;
    statement.reset();
    statement.clearBindings();
    return added;
  }
  /// Closes a unit: its row and all that hang on it are there.
  void enter(const std::string& kind, const std::string& key) { ledger_.append(kind, key); }

  [[nodiscard]] bool has(const std::string& table, const std::string& key) {
    SQLite::Statement query(database_, fmt::format("SELECT 1 FROM {} WHERE sha256 = ?", table));
    query.bind(1, key);
    return query.executeStep();
  }
  /// The number of the row with this hash.
  [[nodiscard]] std::optional<int> id_of(const std::string& table, const std::string& column,
                                         const std::string& sha256) {
    SQLite::Statement query(database_,
                            fmt::format("SELECT {} FROM {} WHERE sha256 = ?", column, table));
    query.bind(1, sha256);
    if (!query.executeStep()) return std::nullopt;
    return query.getColumn(0).getInt();
  }
  /// A text of a row that is there.
  [[nodiscard]] std::string text_of(const std::string& table, const std::string& column,
                                    const std::string& sha256) {
    SQLite::Statement query(database_,
                            fmt::format("SELECT {} FROM {} WHERE sha256 = ?", column, table));
    query.bind(1, sha256);
    return query.executeStep() ? query.getColumn(0).getString() : std::string();
  }
  /// The one number that a query with one number in it gives.
  [[nodiscard]] std::optional<int> number(const char* sql, int parameter) {
    SQLite::Statement query(database_, sql);
    query.bind(1, parameter);
    if (!query.executeStep() || query.isColumnNull(0)) return std::nullopt;
    return query.getColumn(0).getInt();
  }
  /// What a query with one text in it gives, a text in each row.
  [[nodiscard]] std::vector<std::string> texts(const char* sql, const std::string& parameter) {
    SQLite::Statement query(database_, sql);
    query.bind(1, parameter);
    std::vector<std::string> all;
    while (query.executeStep()) all.push_back(query.getColumn(0).getString());
    return all;
  }
  [[nodiscard]] int last_id() const { return static_cast<int>(database_.getLastInsertRowid()); }
  void commit() {
    statements_.clear();
    transaction_.commit();
  }

 private:
  SQLite::Statement& prepared(const std::string& into, std::size_t count) {
    const auto found = statements_.find(into);
    if (found != statements_.end()) return found->second;
    std::string marks = "?";
    for (std::size_t i = 1; i < count; ++i) marks += ", ?";
    return statements_
        .try_emplace(into, database_,
                     fmt::format("INSERT INTO {} VALUES ({}) ON CONFLICT DO NOTHING", into, marks))
        .first->second;
  }

  SQLite::Database& database_;
  SQLite::Transaction transaction_;
  LedgerWriter ledger_;
  std::map<std::string, SQLite::Statement> statements_;
};

}  // namespace drape::compare
