// SPDX-License-Identifier: Apache-2.0
#include <SQLiteCpp/Backup.h>
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <map>
#include <optional>
#include <thread>

#include "compare/store/manifest.hpp"
#include "compare/store/migrate.hpp"
#include "compare/store/rows.hpp"
#include "compare/store/store.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// End of the first statement: the first `;` outside of quotes, or the end of the text.
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

/// A store from elsewhere can have endless views; no file may occupy a program for 10 s.
constexpr auto kLongestQuery = std::chrono::seconds(9);
constexpr std::size_t kMostText = std::size_t{1} << 27;  ///< bytes of an answer
constexpr int kMostValue = 1 << 26;                      ///< bytes of one value

/// Bytes of store and write-ahead log at the same time. A checkpoint moves bytes from one into the
/// other and can truncate the log during reading, so both are read until nothing changed.
std::pair<std::string, std::string> bytes_of(const fs::path& file) {
  using Clock = std::chrono::steady_clock;
  const fs::path log = file.string() + "-wal";
  const auto last = Clock::now() + store_patience;
  const auto read = [&]() -> std::optional<std::pair<std::string, std::string>> {
    try {
      std::error_code absent;
      std::string store = read_text(file);
      return std::pair(std::move(store),
                       fs::is_regular_file(log, absent) ? read_text(log) : std::string());
    } catch (const Error&) {
      if (Clock::now() > last) throw;
      return std::nullopt;
    }
  };
  for (auto before = read();;) {
    auto now = read();
    if (now && now == before) return std::move(*now);
    if (Clock::now() > last)
      throw bad_input("the results store was written all the time", {.file = file.string()},
                      "wait for the other programs and run again");
    before = std::move(now);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

/// Copy of a store that this user cannot write, since SQLite would need lock files beside it. Null
/// if it can be written.
std::unique_ptr<TemporaryFolder> private_copy(const fs::path& file) {
  std::error_code unreachable;
  if (!fs::is_regular_file(file, unreachable)) {
    throw bad_input("there is no results store", {.file = file.string()},
                    "name an existing store with --store; drape-compare makes one");
  }
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (::access(file.c_str(), W_OK) == 0 && ::access(folder.c_str(), W_OK) == 0) return nullptr;
  const auto [store, log] = bytes_of(file);
  auto copy = std::make_unique<TemporaryFolder>("a copy of the store cannot be made");
  write_durable(copy->path() / "store", store);
  if (!log.empty()) write_durable(copy->path() / "store-wal", log);
  return copy;
}

/// Ends a query that takes too long; SQLite calls it every few thousand steps.
class Deadline {
 public:
  explicit Deadline(SQLite::Database& database) : handle_(database.getHandle()) {
    sqlite3_progress_handler(handle_, 10000, &Deadline::is_over, this);
  }
  ~Deadline() { sqlite3_progress_handler(handle_, 0, nullptr, nullptr); }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

 private:
  static int is_over(void* self) {
    return std::chrono::steady_clock::now() > static_cast<Deadline*>(self)->last_ ? 1 : 0;
  }
  sqlite3* handle_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now() + kLongestQuery;
};

}  // namespace

struct StoreReader::Connection {
  fs::path file;
  std::unique_ptr<TemporaryFolder> copy;
  SQLite::Database database;
  bool is_older = false;

  /// Opened for writing so that a write-ahead log left by a killed program can be replayed, then
  /// closed to every change. Only one thread at a time uses a connection, so it needs no mutex.
  Connection(const fs::path& path, Schema schema)
      : file(real_store(path)),
        copy(private_copy(file)),
        database((copy ? copy->path() / "store" : file).string(),
                 SQLite::OPEN_READWRITE | SQLite::OPEN_NOMUTEX) {
    wait_for_others(database);
    sqlite3_limit(database.getHandle(), SQLITE_LIMIT_LENGTH, kMostValue);
    database.exec("PRAGMA query_only = ON");
    const int version = version_of(database, file);
    if (version == 0)
      throw bad_input("this SQLite file is not a drapebench results store", {.file = file.string()},
                      "name another file with --store");
    if (version < store_version()) use_migrated_copy(version);
    if (schema == Schema::any) return;
    if (const auto findings = schema_findings(database); !findings.empty())
      throw not_as_written(file, findings.front());
  }

  void use_migrated_copy(int version) {
    is_older = true;
    SQLite::Database migrated(":memory:", SQLite::OPEN_READWRITE);
    SQLite::Backup(migrated, database).executeStep();
    migrate(migrated, version, file);
    migrated.exec("PRAGMA query_only = ON");
    database = std::move(migrated);
  }
};

StoreReader::StoreReader(const fs::path& file, Schema schema) {
  try {
    connection_ = std::make_unique<Connection>(file, schema);
    stop_waiting();
  } catch (const SQLite::Exception& exception) {
    throw store_error(file, exception);
  }
}

StoreReader::~StoreReader() = default;

const fs::path& StoreReader::file() const {
  return connection_->file;
}

fs::path StoreReader::opened() const {
  return connection_->copy ? connection_->copy->path() / "store" : connection_->file;
}

SQLite::Database& StoreReader::database() const {
  return connection_->database;
}

bool StoreReader::is_of_older_version() const {
  return connection_->is_older;
}

Table StoreReader::answer(const std::string& sql) const {
  return table_of(sql, {}, [](const std::string& what, const std::string& what_to_do) {
    return usage_error(what, what_to_do);
  });
}

Error StoreReader::not_as_made(const std::string& what) const {
  return bad_input("the results store is not as the programs make it: " + what,
                   {.file = connection_->file.string()},
                   "restore it from a backup, or save its rows with: drape results rescue");
}

Table StoreReader::query(const std::string& sql, const Cells& parameters) const {
  return table_of(sql, parameters,
                  [&](const std::string& what, const std::string&) { return not_as_made(what); });
}

std::vector<Cells> StoreReader::cells(const std::string& sql, const Cells& parameters) const {
  std::vector<Cells> rows;
  run(
      sql, parameters,
      [&](const std::string& what, const std::string&) { return not_as_made(what); },
      [&](SQLite::Statement& statement) { rows = rest_of(statement); });
  return rows;
}

Table StoreReader::table_of(const std::string& sql, const Cells& parameters,
                            const Refusal& refusal) const {
  Table table;
  run(sql, parameters, refusal, [&](SQLite::Statement& statement) {
    for (int i = 0; i < statement.getColumnCount(); ++i)
      table.names.emplace_back(statement.getColumnName(i));
    table.numeric.assign(table.names.size(), true);
    std::size_t text = 0;
    while (statement.executeStep()) {
      std::vector<std::string> row(table.names.size());
      for (std::size_t i = 0; i < row.size(); ++i) {
        const SQLite::Column column = statement.getColumn(static_cast<int>(i));
        if (column.isText() || column.isBlob()) table.numeric[i] = false;
        if (!column.isNull())
          row[i] = column.isFloat() ? fmt::format("{}", column.getDouble()) : column.getString();
        text += row[i].size() + sizeof(std::string);
      }
      if (text > kMostText)
        throw refusal("the answer is larger than 128 MiB", "ask for less, e.g. with LIMIT");
      table.add(std::move(row));
    }
  });
  return table;
}

void StoreReader::run(const std::string& sql, const Cells& parameters, const Refusal& refusal,
                      const std::function<void(SQLite::Statement&)>& take) const {
  check_read_only(sql);
  try {
    SQLite::Statement statement(connection_->database, sql);
    bind_all(statement, parameters);
    const Deadline deadline(connection_->database);
    take(statement);
  } catch (const SQLite::Exception& exception) {
    if (exception.getErrorCode() == SQLITE_INTERRUPT)
      throw refusal(fmt::format("the query took longer than {} s", kLongestQuery.count()),
                    "ask for less, e.g. with WHERE or LIMIT");
    if (exception.getErrorCode() == SQLITE_TOOBIG)
      throw refusal(fmt::format("a value of the answer is larger than {} MiB", kMostValue >> 20),
                    "ask for less, e.g. with substr()");
    if (exception.getErrorCode() == SQLITE_ERROR)
      throw refusal(std::string("SQLite answered: ") + exception.what(),
                    "see the tables and columns with: drape-results sql \"SELECT name, sql "
                    "FROM sqlite_master\"");
    throw store_error(connection_->file, exception);
  }
}

void StoreReader::require_as_written(const std::string& table,
                                     const std::set<std::string>& keys) const {
  try {
    RowReader reader(database());
    for (const std::string& key : keys)
      if (const std::string altered = reader.alteration(listed_table(table), key); !altered.empty())
        throw not_as_written(file(), altered);
  } catch (const SQLite::Exception& exception) {
    throw store_error(file(), exception);
  }
}

void StoreReader::require_as_written(const Printed& printed) const {
  std::map<std::string, std::set<std::string>> keys;
  const auto add_rows = [&](const std::set<std::int64_t>& numbers, const char* sql,
                            const std::vector<const char*>& to) {
    if (numbers.empty()) return;
    for (const Cells& row : cells(fmt::format("{} IN ({})", sql, fmt::join(numbers, ", ")), {}))
      for (std::size_t i = 0; i < row.size(); ++i)
        if (std::string key; !row[i].is_null()) {
          row[i].to(key);
          keys[to[i]].insert(key);
        }
  };
  add_rows(printed.runs, "SELECT sha256 FROM run WHERE number", {"run"});
  add_rows(printed.runs,
           "SELECT d.measured_sha256, m.sha256 FROM run_drape AS d JOIN run AS r ON r.number = "
           "d.run LEFT JOIN run_match AS m ON m.run_sha256 = r.sha256 AND m.measured_sha256 = "
           "d.measured_sha256 WHERE d.run",
           {"sheet", "run_match"});
  keys["run_drape"] = keys["run"];
  if (printed.values) {
    keys["run_value"] = keys["run"];
    add_rows(printed.runs, "SELECT headline_sha256 FROM run_drape WHERE run", {"comparison"});
  }
  add_rows(printed.comparisons,
           "SELECT c.sha256, c.measured_sha256, c.simulated_sha256, b.sheet_sha256 FROM "
           "comparison AS c LEFT JOIN branch AS b ON b.sheet_sha256 = c.simulated_sha256 WHERE "
           "c.id",
           {"comparison", "sheet", "simulation", "branch"});
  if (printed.marks) keys["mark_error"] = keys["comparison"];
  for (const auto& [table, of_table] : keys) require_as_written(table, of_table);
}

void StoreReader::require_as_written(const std::vector<std::string>& tables) const {
  try {
    RowReader reader(database());
    long long keys = 0;
    for (const std::string& table : tables)
      if (const auto altered = reader.alterations(listed_table(table), keys); !altered.empty())
        throw not_as_written(file(), altered.front());
  } catch (const SQLite::Exception& exception) {
    throw store_error(file(), exception);
  }
}

std::optional<std::string> StoreReader::blob(const std::string& sha256) const {
  try {
    return blob_in(database(), sha256);
  } catch (const SQLite::Exception& exception) {
    throw store_error(file(), exception);
  }
}

std::vector<fs::path> StoreReader::places_of(const std::string& sha256) const {
  std::vector<fs::path> places;
  for (const auto& [path] :
       rows<std::string>("SELECT path FROM file WHERE sha256 = ? ORDER BY path", {sha256}))
    places.push_back((folder_of(file()) / path).lexically_normal());
  return places;
}

}  // namespace drape::compare
