// SPDX-License-Identifier: Apache-2.0
#include "compare/store/store.hpp"

#include <SQLiteCpp/Backup.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <thread>

#include "core/matching.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Throws Error(usage) for anything else than one query.
void check_read_only(SQLite::Database& database, const std::string& sql) {
  static const std::regex query(R"([\s(]*(SELECT|WITH|VALUES|EXPLAIN)\b)", std::regex::icase);
  if (!std::regex_search(sql.substr(0, longest_matched), query,
                         std::regex_constants::match_continuous))
    throw usage_error(
        fmt::format("the store is only read here, and `{}` is not a query", printable(sql)),
        "start the statement with SELECT, WITH, VALUES or EXPLAIN; only drape-compare writes");
  if (sql.find(';') == std::string::npos) return;
  const char* rest = "";
  sqlite3_stmt* first = nullptr;
  const int result = sqlite3_prepare_v2(database.getHandle(), sql.c_str(), -1, &first, &rest);
  sqlite3_finalize(first);
  if (result == SQLITE_OK &&
      std::string_view(rest).find_first_not_of(" \t\r\n") != std::string_view::npos)
    throw usage_error("only one SQL statement is run at a time", "remove what follows the `;`");
}

/// A store from elsewhere can have endless views; no file may occupy a program for 10 s of
/// processor time. On a busy machine a long answer may take as long as it needs by the clock.
constexpr std::clock_t kLongestQuery_s = 9;
constexpr std::size_t kMostText = std::size_t{1} << 27;  ///< bytes of an answer
constexpr int kMostValue = 1 << 26;                      ///< bytes of one value

/// Bytes of store and write-ahead log at the same time. A checkpoint moves bytes from one into the
/// other and can truncate the log during reading, so both are read until nothing changed.
std::pair<std::string, std::string> bytes_of(const fs::path& file) {
  using Steady = std::chrono::steady_clock;
  const fs::path log = file.string() + "-wal";
  const auto last = Steady::now() + store_patience;
  const auto read = [&]() -> std::optional<std::pair<std::string, std::string>> {
    try {
      std::error_code absent;
      std::string store = read_text(file);
      return std::pair(std::move(store),
                       fs::is_regular_file(log, absent) ? read_text(log) : std::string());
    } catch (const Error&) {
      if (Steady::now() > last) throw;
      return std::nullopt;
    }
  };
  for (auto before = read();;) {
    auto now = read();
    if (now && now == before) return std::move(*now);
    if (Steady::now() > last)
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

/// Result of `work`; an exception of SQLite becomes an error that names the store.
template <class Work>
auto reported(const fs::path& store, const Work& work) {
  try {
    return work();
  } catch (const SQLite::Exception& exception) {
    throw store_error(store, exception);
  }
}

}  // namespace

fs::path real_store(fs::path store) {
  constexpr int kMostLinks = 40;  // as followed by the system
  std::error_code error;
  for (int i = 0; i < kMostLinks && fs::is_symlink(store, error); ++i)
    store = (store.parent_path() / fs::read_symlink(store, error)).lexically_normal();
  return store;
}

fs::path folder_of(const fs::path& store) {
  const fs::path file = real_store(store);
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

Writer::Writer(SQLite::Database& database)
    : database_(database),
      transaction_(database, SQLite::TransactionBehavior::IMMEDIATE),
      manifest_(last_manifest(database).number + 1) {}

void Writer::add(const ListedTable& table, const std::string& key) {
  if (known_.emplace(&table, key).second) added_.emplace_back(&table, key);
}

bool Writer::insert_row(const ListedTable& table, const Cells& row) {
  auto found = statements_.find(&table);
  if (found == statements_.end())
    found = statements_
                .try_emplace(&table, database_,
                             fmt::format("INSERT INTO {} ({}) VALUES ({}) ON CONFLICT DO NOTHING",
                                         table.name, fmt::join(table.columns, ", "),
                                         fmt::join(table.places, ", ")))
                .first;
  SQLite::Statement& statement = found->second;
  statement.tryReset();
  statement.clearBindings();
  bind_all(statement, row);
  const bool is_new = statement.exec() > 0;
  const std::string& key = std::get<std::string>(row[table.key_at]);
  is_new ? add(table, key) : void(known_.emplace(&table, key));
  return is_new;
}

void Writer::insert_blob(const std::string& sha256, std::string_view content) {
  if (add_blob(database_, sha256, content)) add(listed_table("blob"), sha256);
}

void Writer::insert_file(const std::string& sha256, const std::string& path) {
  if (execute(database_, "INSERT INTO file VALUES (?, ?, ?) ON CONFLICT DO NOTHING",
              {sha256, path, manifest_}) > 0)
    add(listed_table("file"), std::to_string(manifest_));
}

bool Writer::has(const std::string& table, const std::string& sha256) {
  if (!first_of<int>(database_, "SELECT 1 FROM " + table + " WHERE sha256 = ?", {sha256}))
    return false;
  known_.emplace(&listed_table(table), sha256);
  return true;
}

void Writer::commit() {
  statements_.clear();
  RowReader reader(database_);
  const std::set<ListedKey> added(added_.begin(), added_.end());
  for (const ListedKey& one : known_)
    if (!added.contains(one))
      if (const std::string altered = reader.alteration(*one.first, one.second); !altered.empty())
        throw not_as_written(database_.getFilename(), altered);
  write_manifest(database_, added_);
  transaction_.commit();
}

Store::Store(const fs::path& file) : file_(file) {
  try {
    // Only regular files are allowed in place of the store and its log: a pipe would never end.
    for (const char* end : {"", "-wal", "-shm", "-journal"})
      require_replaceable(real_store(file).string() + end);
    std::error_code error;
    if (file.has_parent_path()) fs::create_directories(file.parent_path(), error);
    if (error)
      throw bad_input("the folder of the results store cannot be made: " + error.message(),
                      {.file = file.string()}, "name a place that can be written with --store");
    // SQLite reports "busy" immediately if waiting could be a deadlock, as in a change of the
    // journal mode: opening is then tried again.
    const auto last = std::chrono::steady_clock::now() + store_patience;
    for (;;) {
      try {
        open();
        return;
      } catch (const SQLite::Exception& exception) {
        if (!is_busy(exception) || std::chrono::steady_clock::now() > last) throw;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
  } catch (const SQLite::Exception& exception) {
    throw store_error(file, exception);
  }
}

void Store::open() {
  database_ = std::make_unique<SQLite::Database>(file_.string(),
                                                 SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  SQLite::Database& database = *database_;
  database.setBusyTimeout(static_cast<int>(store_patience.count()));
  // One statement at a time could see two states of a store that another program creates.
  const auto version_now = [&](SQLite::TransactionBehavior behavior) {
    SQLite::Transaction transaction(database, behavior);
    const int version = version_of(database, file_);
    if (version > 0 || behavior == SQLite::TransactionBehavior::DEFERRED) return version;
    create_store(database);
    transaction.commit();
    return store_version();
  };
  int version = version_now(SQLite::TransactionBehavior::DEFERRED);
  // The mode is kept in the file; requesting it again would need the write lock unnecessarily.
  if (database.execAndGet("PRAGMA journal_mode").getString() != "wal")
    database.execAndGet("PRAGMA journal_mode = WAL").getString();
  database.exec("PRAGMA synchronous = FULL");
  if (version == 0) version = version_now(SQLite::TransactionBehavior::IMMEDIATE);
  if (version < store_version()) migrate(database, version, file_);
  database.exec("PRAGMA foreign_keys = ON");
  const SQLite::Transaction snapshot(database, SQLite::TransactionBehavior::DEFERRED);
  std::vector<std::string> findings = schema_findings(database);
  if (findings.empty()) findings.push_back(size_finding(database, real_store(file_)));
  if (!findings.front().empty()) throw not_as_written(file_, findings.front());
}

Store::~Store() {
  try {
    close();
  } catch (const Error&) {
    // Everything acknowledged is safe in the write-ahead log, which the next opening moves.
  }
}

void Store::write(const std::function<void(Writer&)>& rows) {
  reported(file_, [&] {
    Writer writer(*database_);
    rows(writer);
    writer.commit();
  });
}

void Store::close() {
  const std::unique_ptr<SQLite::Database> database = std::move(database_);
  if (!database) return;
  reported(file_, [&] {
    // Readers hold a part of the log, which the next program moves.
    database->setBusyTimeout(0);
    SQLite::Statement(*database, "PRAGMA wal_checkpoint(TRUNCATE)").executeStep();
  });
}

// Opened for writing so that a write-ahead log left by a killed program can be replayed, then
// closed to every change. Only one thread at a time uses a connection, so it needs no mutex.
StoreReader::StoreReader(const fs::path& file, Schema schema) try
    : file_(real_store(file)),
      copy_(private_copy(file_)),
      database_(opened().string(), SQLite::OPEN_READWRITE | SQLite::OPEN_NOMUTEX) {
  database_.setBusyTimeout(static_cast<int>(store_patience.count()));
  sqlite3_limit(database_.getHandle(), SQLITE_LIMIT_LENGTH, kMostValue);
  database_.exec("PRAGMA query_only = ON");
  database_.exec("BEGIN");  // one state, locked once, for all questions of this reader
  const int version = version_of(database_, file_);
  if (version == 0)
    throw bad_input("this SQLite file is not a drapebench results store", {.file = file_.string()},
                    "name another file with --store");
  if (version < store_version()) {
    is_older_ = true;
    SQLite::Database migrated(":memory:", SQLite::OPEN_READWRITE);
    SQLite::Backup(migrated, database_).executeStep();
    migrate(migrated, version, file_);
    migrated.exec("PRAGMA query_only = ON");
    database_ = std::move(migrated);
  }
  if (schema == Schema::own)
    if (const auto findings = schema_findings(database_); !findings.empty())
      throw not_as_written(file_, findings.front());
} catch (const SQLite::Exception& exception) {
  throw store_error(real_store(file), exception);
}

Error StoreReader::refusal(Author author, const std::string& what,
                           const std::string& remedy) const {
  if (author == Author::person) return usage_error(what, remedy);
  return bad_input("the results store is not as the programs make it: " + what,
                   {.file = file_.string()},
                   "restore it from a backup, or save its rows with: drape results rescue");
}

Table StoreReader::query(const std::string& sql, const Cells& parameters, Author author) const {
  Table table;
  const std::vector<Cells> found = cells(sql, parameters, author, &table.names);
  table.numeric.assign(table.names.size(), true);
  for (const Cells& row : found) {
    table.add(std::vector<std::string>(row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) {
      row[i].to(table.rows.back()[i]);
      if (std::holds_alternative<std::string>(row[i])) table.numeric[i] = false;
    }
  }
  return table;
}

std::vector<Cells> StoreReader::cells(const std::string& sql, const Cells& parameters,
                                      Author author, std::vector<std::string>* names) const {
  check_read_only(database_, sql);
  sqlite3* handle = database_.getHandle();
  const std::unique_ptr<sqlite3, void (*)(sqlite3*)> until_read(
      handle, [](sqlite3* one) { sqlite3_progress_handler(one, 0, nullptr, nullptr); });
  try {
    SQLite::Statement statement(database_, sql);
    bind_all(statement, parameters);
    std::clock_t last = std::clock() + kLongestQuery_s * CLOCKS_PER_SEC;
    const auto is_over = [](void* end) {
      return std::clock() > *static_cast<const std::clock_t*>(end) ? 1 : 0;
    };
    sqlite3_progress_handler(handle, 10000, is_over, &last);  // called every 10,000 steps
    for (int i = 0; names != nullptr && i < statement.getColumnCount(); ++i)
      names->emplace_back(statement.getColumnName(i));
    std::vector<Cells> rows;
    std::size_t size = 0;
    while (statement.executeStep()) {
      for (const Cell& cell : rows.emplace_back(row_of(statement)))
        if (const auto* text = std::get_if<std::string>(&cell)) size += text->size();
      if (names != nullptr && size + rows.size() * names->size() * sizeof(std::string) > kMostText)
        throw refusal(author, "the answer is larger than 128 MiB", "ask for less, e.g. with LIMIT");
    }
    return rows;
  } catch (const SQLite::Exception& exception) {
    if (exception.getErrorCode() == SQLITE_INTERRUPT)
      throw refusal(
          author, fmt::format("the query took longer than {} s of processor time", kLongestQuery_s),
          "ask for less, e.g. with WHERE or LIMIT");
    if (exception.getErrorCode() == SQLITE_TOOBIG)
      throw refusal(author,
                    fmt::format("a value of the answer is larger than {} MiB", kMostValue >> 20),
                    "ask for less, e.g. with substr()");
    if (exception.getErrorCode() == SQLITE_ERROR)
      throw refusal(author, std::string("SQLite answered: ") + exception.what(),
                    "see the tables and columns with: drape-results sql \"SELECT name, sql "
                    "FROM sqlite_master\"");
    throw store_error(file_, exception);
  }
}

void StoreReader::require_as_written(const std::string& table,
                                     const std::set<std::string>& keys) const {
  reported(file_, [&] {
    RowReader reader(database_);
    for (const std::string& key : keys)
      if (const std::string altered = reader.alteration(listed_table(table), key); !altered.empty())
        throw not_as_written(file_, altered);
  });
}

void StoreReader::require_as_written(const Printed& printed) const {
  std::map<std::string, std::set<std::string>> keys;
  for (auto& [table, key] : rows<std::string, std::string>(
           R"sql(WITH r AS MATERIALIZED (SELECT number, sha256 FROM run WHERE number IN
  (SELECT value FROM json_each(?1))),
d AS MATERIALIZED (SELECT r.sha256, measured_sha256, headline_sha256 FROM r JOIN run_drape AS d ON d.run = r.number),
c AS MATERIALIZED (SELECT sha256, measured_sha256, simulated_sha256 FROM comparison WHERE id IN (SELECT value FROM json_each(?2)))
SELECT 'run', sha256 FROM r UNION ALL SELECT 'run_drape', sha256 FROM r
UNION ALL SELECT 'sheet', measured_sha256 FROM d
UNION ALL SELECT 'run_match', m.sha256 FROM d JOIN run_match AS m
  ON m.run_sha256 = d.sha256 AND m.measured_sha256 = d.measured_sha256
UNION ALL SELECT 'run_value', sha256 FROM r WHERE ?3
UNION ALL SELECT 'comparison', headline_sha256 FROM d WHERE ?3 AND headline_sha256 IS NOT NULL
UNION ALL SELECT 'comparison', sha256 FROM c UNION ALL SELECT 'sheet', measured_sha256 FROM c
UNION ALL SELECT 'simulation', simulated_sha256 FROM c
UNION ALL SELECT 'branch', b.sheet_sha256 FROM c JOIN branch AS b
  ON b.sheet_sha256 = c.simulated_sha256
UNION ALL SELECT 'mark_error', sha256 FROM c WHERE ?4)sql",
           {fmt::format("[{}]", fmt::join(printed.runs, ",")),
            fmt::format("[{}]", fmt::join(printed.comparisons, ",")), printed.values,
            printed.marks}))
    keys[table].insert(std::move(key));
  for (const auto& [table, of_table] : keys) require_as_written(table, of_table);
}

void StoreReader::require_as_written(const std::vector<std::string>& tables) const {
  reported(file_, [&] {
    RowReader reader(database_);
    long long keys = 0;
    for (const std::string& table : tables)
      if (const auto altered = reader.alterations(listed_table(table), keys); !altered.empty())
        throw not_as_written(file_, altered.front());
  });
}

std::optional<std::string> StoreReader::blob(const std::string& sha256) const {
  return reported(file_, [&] { return blob_in(database_, sha256); });
}

}  // namespace drape::compare
