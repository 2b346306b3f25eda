// SPDX-License-Identifier: Apache-2.0
#include "compare/store/store.hpp"

#include <SQLiteCpp/SQLiteCpp.h>

#include <memory>

#include "compare/store/manifest.hpp"
#include "compare/store/migrate.hpp"
#include "compare/store/rows.hpp"
#include "compare/store/writer.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Creates everything in one transaction, so that a store is either empty or complete.
void create_tables(SQLite::Database& database, const fs::path& file) {
  SQLite::Transaction transaction(database, SQLite::TransactionBehavior::IMMEDIATE);
  if (version_of(database, file) > 0) return;  // another program was faster
  create_store(database);
  transaction.commit();
}

fs::path prepare_folder(const fs::path& file) {
  std::error_code error;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), error);
  if (error) {
    throw bad_input("the folder of the results store cannot be made: " + error.message(),
                    {.file = file.string()}, "name a place that can be written with --store");
  }
  return file;
}

/// Allows only regular files in place of the store and its log, since a pipe would never end.
const fs::path& replaceable(const fs::path& file) {
  const fs::path own = real_store(file);
  for (const char* end : {"", "-wal", "-shm", "-journal"}) require_replaceable(own.string() + end);
  return file;
}

}  // namespace

struct Store::Connection {
  fs::path file;
  SQLite::Database database;
  Writer* writer = nullptr;  ///< writer of the transaction that is open

  explicit Connection(const fs::path& path)
      : file(prepare_folder(replaceable(path))),
        database(path.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE) {
    wait_for_others(database);
    const bool complete = is_complete();
    // The mode is kept in the file; requesting it again would need the write lock unnecessarily.
    if (database.execAndGet("PRAGMA journal_mode").getString() != "wal")
      database.execAndGet("PRAGMA journal_mode = WAL").getString();
    database.exec("PRAGMA synchronous = FULL");
    if (!complete) create_tables(database, file);
    const int version = version_of(database, file);
    if (version < store_version()) migrate(database, version, file);
    database.exec("PRAGMA foreign_keys = ON");
    const SQLite::Transaction snapshot(database, SQLite::TransactionBehavior::DEFERRED);
    std::vector<std::string> findings = schema_findings(database);
    if (findings.empty()) findings.push_back(size_finding(database, real_store(file)));
    if (!findings.front().empty()) throw not_as_written(file, findings.front());
  }

  /// SQLite reports "busy" immediately if waiting could be a deadlock, as in a change of the
  /// journal mode: opening is then tried again.
  static std::unique_ptr<Connection> open_when_free(const fs::path& path) {
    for (;;) {
      try {
        return std::make_unique<Connection>(path);
      } catch (const SQLite::Exception& exception) {
        if (!wait_after(exception)) throw;
      }
    }
  }

 private:
  bool is_complete() {
    const SQLite::Transaction snapshot(database, SQLite::TransactionBehavior::DEFERRED);
    return version_of(database, file) > 0;
  }
};

Store::Store(const fs::path& file) {
  try {
    connection_ = Connection::open_when_free(file);
    stop_waiting();
  } catch (const SQLite::Exception& exception) {
    throw store_error(file, exception);
  }
}

Store::~Store() {
  try {
    if (connection_) close();
  } catch (const Error&) {
    // Everything acknowledged is safe in the write-ahead log, which the next opening moves.
  }
}

void Store::write(const std::function<void(Writer&)>& rows) {
  if (connection_->writer != nullptr) return rows(*connection_->writer);
  struct Closed {
    Writer*& open;
    ~Closed() { open = nullptr; }
  };
  try {
    Writer writer(connection_->database);
    stop_waiting();
    const Closed closed{connection_->writer};
    connection_->writer = &writer;
    rows(writer);
    writer.commit();
  } catch (const SQLite::Exception& exception) {
    throw store_error(connection_->file, exception);
  }
}

void Store::close() {
  if (!connection_) return;
  const fs::path file = connection_->file;
  try {
    // Readers hold a part of the log, which the next program moves.
    connection_->database.setBusyTimeout(0);
    SQLite::Statement(connection_->database, "PRAGMA wal_checkpoint(TRUNCATE)").executeStep();
    connection_.reset();
  } catch (const SQLite::Exception& exception) {
    connection_.reset();
    throw store_error(file, exception);
  }
}

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

}  // namespace drape::compare
