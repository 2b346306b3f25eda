// SPDX-License-Identifier: Apache-2.0
#include "compare/store/writer.hpp"

#include <fmt/format.h>

#include "compare/schema/schema.hpp"

namespace drape::compare {

Writer::Writer(SQLite::Database& database)
    : database_(database),
      transaction_(database, SQLite::TransactionBehavior::IMMEDIATE),
      ledger_(database) {}

bool Writer::insert_row(const std::string& table, const Cells& row) {
  auto found = statements_.find(table);
  if (found == statements_.end()) {
    std::string names, marks;
    for (const RelationColumn& column : relation(table).columns) {
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", column.name);
      marks += marks.empty() ? "?" : ", ?";
    }
    found = statements_
                .try_emplace(table, database_,
                             fmt::format("INSERT INTO {} ({}) VALUES ({}) ON CONFLICT DO NOTHING",
                                         table, names, marks))
                .first;
  }
  SQLite::Statement& statement = found->second;
  bind_all(statement, row);
  const bool added = statement.exec() > 0;
  statement.reset();
  statement.clearBindings();
  return added;
}

bool Writer::insert_unit_row(const std::string& table, const Cells& row) {
  if (!insert_row(table, row)) return false;
  const std::vector<RelationColumn>& columns = relation(table).columns;
  std::size_t at = 0;
  while (columns[at].name != ledger_kind(table)->key_column) ++at;
  enter(table, std::get<std::string>(row[at]));
  return true;
}

std::vector<std::string> Writer::texts(const std::string& sql, const Cells& parameters) {
  std::vector<std::string> all;
  for (const auto& [text] : rows_of<std::string>(database_, sql, parameters)) all.push_back(text);
  return all;
}

void Writer::commit() {
  statements_.clear();
  transaction_.commit();
}

}  // namespace drape::compare
