// SPDX-License-Identifier: Apache-2.0
#include "compare/store/rows.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include "core/units.hpp"

namespace drape::compare {
namespace {

template <class T>
T number_in(const Cell& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<T>(*whole);
  const auto* real = std::get_if<double>(&value);
  return real != nullptr ? static_cast<T>(*real) : T{};
}

}  // namespace

Cell in_mm(const std::optional<double>& length_m) {
  return length_m ? Cell(*length_m / units::mm) : Cell();
}

void Cell::to(std::string& text) const {
  if (const auto* own = std::get_if<std::string>(this)) text = *own;
  if (const auto* whole = std::get_if<std::int64_t>(this)) text = fmt::format("{}", *whole);
  if (const auto* real = std::get_if<double>(this)) text = fmt::format("{}", *real);
}
void Cell::to(double& number) const {
  number = number_in<double>(*this);
}
void Cell::to(std::int64_t& number) const {
  number = number_in<std::int64_t>(*this);
}
void Cell::to(int& number) const {
  number = number_in<int>(*this);
}
void Cell::to(bool& truth) const {
  truth = number_in<std::int64_t>(*this) != 0;
}

void bind_all(SQLite::Statement& statement, const Cells& parameters) {
  int index = 0;
  for (const Cell& value : parameters) {
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

Error store_error(const std::filesystem::path& file, const SQLite::Exception& exception) {
  const Where where{.file = file.string()};
  const std::string reason = exception.what();
  switch (exception.getErrorCode() & 0xFF) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return bad_input(fmt::format("the results store was in use by another program for {} s",
                                   kBusyTimeout_ms / 1000),
                       where,
                       "wait for the other program and run this one again; nothing stored is lost");
    case SQLITE_FULL:
      return bad_input("the results store cannot grow: " + reason, where,
                       "free disk space and run again; nothing already stored is lost");
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_IOERR:
      return bad_input("the results store cannot be opened or written: " + reason, where,
                       "check the path, the permissions and the disk, then run again; nothing "
                       "already stored is lost");
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return bad_input("this is not a readable results store: " + reason, where,
                       "name another file with --store, or restore this one from a backup");
    case SQLITE_CONSTRAINT:
      if (exception.getExtendedErrorCode() == SQLITE_CONSTRAINT_TRIGGER)
        return bad_input("the results store does not take these rows: " + reason, where,
                         "a trigger of another hand may be in it: run drape results verify");
      [[fallthrough]];
    default:
      return internal_error("the results store answered: " + reason, where);
  }
}

}  // namespace drape::compare
