// SPDX-License-Identifier: Apache-2.0
#include "compare/store/rows.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

namespace drape::compare {
namespace {

template <class T>
T number_in(const Value& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<T>(*whole);
  const auto* real = std::get_if<double>(&value);
  return real != nullptr ? static_cast<T>(*real) : T{};
}

}  // namespace

void Value::to(std::string& text) const {
  if (const auto* own = std::get_if<std::string>(this)) text = *own;
  if (const auto* whole = std::get_if<std::int64_t>(this)) text = fmt::format("{}", *whole);
  if (const auto* real = std::get_if<double>(this)) text = fmt::format("{}", *real);
}
void Value::to(double& number) const {
  number = number_in<double>(*this);
}
void Value::to(std::int64_t& number) const {
  number = number_in<std::int64_t>(*this);
}
void Value::to(int& number) const {
  number = number_in<int>(*this);
}
void Value::to(bool& truth) const {
  truth = number_in<std::int64_t>(*this) != 0;
}

void bind_all(SQLite::Statement& statement, const Cells& parameters) {
  int index = 0;
  for (const Value& value : parameters) {
    ++index;  // an unbound parameter is NULL
    if (const auto* whole = std::get_if<std::int64_t>(&value)) statement.bind(index, *whole);
    if (const auto* real = std::get_if<double>(&value)) statement.bind(index, *real);
    if (const auto* text = std::get_if<std::string>(&value)) statement.bind(index, *text);
  }
}

std::vector<Cells> rest_of(SQLite::Statement& statement) {
  std::vector<Cells> rows;
  while (statement.executeStep()) {
    Cells& row = rows.emplace_back();
    for (int i = 0; i < statement.getColumnCount(); ++i) {
      const SQLite::Column cell = statement.getColumn(i);
      if (cell.isNull())
        row.emplace_back();
      else if (cell.isInteger())
        row.emplace_back(cell.getInt64());
      else if (cell.isFloat())
        row.emplace_back(cell.getDouble());
      else
        row.emplace_back(cell.getString());
    }
  }
  return rows;
}

std::vector<Cells> cells_of(SQLite::Database& database, const std::string& sql,
                            const Cells& parameters) {
  SQLite::Statement statement(database, sql);
  bind_all(statement, parameters);
  return rest_of(statement);
}

int execute(SQLite::Database& database, const std::string& sql, const Cells& parameters) {
  SQLite::Statement statement(database, sql);
  bind_all(statement, parameters);
  return statement.exec();
}

}  // namespace drape::compare
