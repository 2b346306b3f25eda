// SPDX-License-Identifier: Apache-2.0
#include <SQLiteCpp/Backup.h>
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>

#include "compare/store/ledger.hpp"
#include "compare/store/migrate.hpp"
#include "compare/store/sqlite_error.hpp"
#include "compare/store/store.hpp"

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
    if (version < kStoreVersion) use_migrated_copy(version);
  }

  void use_migrated_copy(int version) {
    SQLite::Database copy(":memory:", SQLite::OPEN_READWRITE);
    SQLite::Backup(copy, database).executeStep();
    migrate(copy, version);
    copy.exec("PRAGMA query_only = ON");
    database = std::move(copy);
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

const fs::path& StoreReader::file() const {
  return connection_->file;
}

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

namespace {

/// Rows without an entry and entries without a row.
void check_counts(SQLite::Database& database, LedgerCheck& check) {
  for (const LedgerKind& kind : ledger_kinds()) {
    SQLite::Statement query(
        database, fmt::format("SELECT {1} FROM {0} WHERE {1} NOT IN (SELECT key FROM ledger WHERE "
                              "kind = '{0}')",
                              kind.table, kind.key_column));
    while (query.executeStep()) {
      check.findings.push_back(fmt::format("{} `{}` was not written by drapebench", kind.table,
                                           query.getColumn(0).getString()));
    }
  }
  SQLite::Statement orphans(database,
                            "SELECT \"table\", count(*) FROM pragma_foreign_key_check() "
                            "GROUP BY \"table\" ORDER BY \"table\"");
  while (orphans.executeStep()) {
    check.findings.push_back(fmt::format("{} rows of {} hang on a row that is not there",
                                         orphans.getColumn(1).getInt(),
                                         orphans.getColumn(0).getString()));
  }
}

void check_chain(SQLite::Database& database, LedgerCheck& check) {
  SQLite::Statement entries(
      database,
      "SELECT sequence, kind, key, content_sha256, chain_sha256 FROM ledger ORDER BY "
      "sequence");
  while (entries.executeStep()) {
    ++check.entries;
    const long long sequence = entries.getColumn(0).getInt64();
    const std::string kind = entries.getColumn(1).getString(),
                      key = entries.getColumn(2).getString();
    const std::string content = entries.getColumn(3).getString();
    if (sequence != check.entries) {
      check.findings.push_back(fmt::format("entry {} of the ledger is not there", check.entries));
      return;
    }
    const auto& kinds = ledger_kinds();
    const auto known = std::find_if(kinds.begin(), kinds.end(),
                                    [&](const LedgerKind& k) { return kind == k.table; });
    if (known == kinds.end() || content_sha256(database, *known, key) != content)
      check.findings.push_back(fmt::format("{} `{}` is not what was written", kind, key));
    const std::string chain = chain_sha256(check.head, sequence, kind, key, content);
    check.head = entries.getColumn(4).getString();
    if (chain != check.head) {
      check.findings.push_back(
          fmt::format("entry {} of the ledger ({} `{}`) was changed", sequence, kind, key));
    }
  }
}

}  // namespace

LedgerCheck check_ledger(const StoreReader& store) {
  SQLite::Database& database = store.connection_->database;
  LedgerCheck check;
  try {
    check_chain(database, check);
    check_counts(database, check);
    const std::string integrity = database.execAndGet("PRAGMA integrity_check").getString();
    if (integrity != "ok") check.findings.push_back("SQLite finds damage: " + integrity);
  } catch (const SQLite::Exception& exception) {
    check.findings.push_back(std::string("the store cannot be read to its end: ") +
                             exception.what());
  }
  return check;
}

}  // namespace drape::compare
