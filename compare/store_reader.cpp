// SPDX-License-Identifier: Apache-2.0
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>

#include "compare/sqlite_error.hpp"
#include "compare/store.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Where the first statement ends: the `;` outside of quotes, or the end of the text.
std::size_t end_of_statement(const std::string& sql) {
  char quote = 0;
  for (std::size_t i = 0; i < sql.size(); ++i) {
    const char c = sql[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '\'' || c == '"' || c == '`') {
      quote = c;
    } else if (c == ';') {
      return i;
    }
  }
  return sql.size();
}

void check_read_only(const std::string& sql) {
  const std::size_t end = end_of_statement(sql);
  if (end < sql.size() && sql.find_first_not_of(" \t\r\n", end + 1) != std::string::npos)
    throw usage_error("only one SQL statement is run at a time", "remove what follows the `;`");
  std::string word;
  for (std::size_t i = sql.find_first_not_of(" \t\r\n("); i < sql.size(); ++i) {
    if (std::isalpha(static_cast<unsigned char>(sql[i])) == 0) break;
    word += static_cast<char>(std::toupper(static_cast<unsigned char>(sql[i])));
  }
  if (word != "SELECT" && word != "WITH" && word != "VALUES" && word != "EXPLAIN") {
    throw usage_error(
        fmt::format("the store is only read here, and `{}` is not a query", word),
        "start the statement with SELECT, WITH, VALUES or EXPLAIN; only drape-compare writes");
  }
}

/// A store on a medium that cannot be written has no lock files to make: SQLite is told so.
std::string address_of(const fs::path& file) {
  std::error_code unreachable;
  if (!fs::is_regular_file(file, unreachable)) {
    throw bad_input("there is no results store", {.file = file.string()},
                    "name an existing store with --store; drape-compare makes one");
  }
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const bool writable = access(file.c_str(), W_OK) == 0 && access(folder.c_str(), W_OK) == 0;
  if (writable) return file.string();
  std::string escaped;
  for (const char c : fs::absolute(file).string()) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '/' || c == '.' ||
                       c == '-' || c == '_';
    escaped += plain ? std::string(1, c)
                     : fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
  }
  return "file:" + escaped + "?immutable=1";
}

int mode_of(const std::string& address) {
  const bool immutable = address.rfind("file:", 0) == 0;
  return immutable ? SQLite::OPEN_READONLY | SQLite::OPEN_URI : SQLite::OPEN_READWRITE;
}

std::string cell_text(const SQLite::Column& column) {
  if (column.isNull()) return {};
  if (column.isFloat()) return fmt::format("{}", column.getDouble());
  return column.getString();
}

}  // namespace

struct StoreReader::Connection {
  fs::path file;
  std::string address;
  SQLite::Database database;

  /// Opened for writing so that a write-ahead log left by a killed program can be replayed, and
  /// then closed to every change.
  explicit Connection(const fs::path& path)
      : file(path),
        address(address_of(path)),
        database(address, mode_of(address), kBusyTimeout_ms) {
    database.exec("PRAGMA query_only = ON");
    if (database.execAndGet("PRAGMA application_id").getInt() != kApplicationId) {
      throw bad_input("this SQLite file is not a drapebench results store", {.file = file.string()},
                      "name another file with --store");
    }
    const int version = database.execAndGet("PRAGMA user_version").getInt();
    if (version > kStoreVersion) {
      throw bad_input(fmt::format("the results store has version {}, this program knows version {}",
                                  version, kStoreVersion),
                      {.file = file.string(), .field = "user_version"},
                      "use the newer drapebench that wrote it");
    }
  }
};

StoreReader::StoreReader(const fs::path& file) {
  try {
    connection_ = std::make_unique<Connection>(file);
  } catch (const SQLite::Exception& exception) {
    throw store_error(file, exception);
  }
}

StoreReader::~StoreReader() = default;

Table StoreReader::query(const std::string& sql, const std::vector<std::string>& parameters) const {
  check_read_only(sql);
  try {
    SQLite::Statement statement(connection_->database, sql);
    int index = 0;
    for (const std::string& parameter : parameters) statement.bind(++index, parameter);
    Table table;
    for (int i = 0; i < statement.getColumnCount(); ++i)
      table.names.emplace_back(statement.getColumnName(i));
    table.numeric.assign(table.names.size(), true);
    while (statement.executeStep()) {
      std::vector<std::string> row;
      for (int i = 0; i < statement.getColumnCount(); ++i) {
        const SQLite::Column column = statement.getColumn(i);
        if (column.isText() || column.isBlob()) table.numeric[static_cast<std::size_t>(i)] = false;
        row.push_back(cell_text(column));
      }
      table.add(std::move(row));
    }
    return table;
  } catch (const SQLite::Exception& exception) {
    if (exception.getErrorCode() == SQLITE_ERROR)
      throw usage_error(std::string("SQLite answered: ") + exception.what(),
                        "see the tables and columns with: drape-results sql \"SELECT name, sql "
                        "FROM sqlite_master\"");
    throw store_error(connection_->file, exception);
  }
}

}  // namespace drape::compare
