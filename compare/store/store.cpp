// SPDX-License-Identifier: Apache-2.0
#include "compare/store/store.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <span>
#include <thread>

#include "compare/store/ledger.hpp"
#include "compare/store/migrate.hpp"
#include "compare/store/rows.hpp"
#include "compare/store/writer.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// All in one transaction, so that a store is either empty or complete.
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

const fs::path& replaceable(const fs::path& file) {
  if (!fs::is_symlink(file)) require_replaceable(file);
  return file;
}

bool is_busy(const SQLite::Exception& exception) {
  const int code = exception.getErrorCode() & 0xFF;
  return code == SQLITE_BUSY || code == SQLITE_LOCKED;
}

}  // namespace

struct Store::Connection {
  fs::path file;
  SQLite::Database database;
  Writer* writer = nullptr;  ///< writer of the transaction that is open

  explicit Connection(const fs::path& path)
      : file(prepare_folder(replaceable(path))),
        database(path.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kBusyTimeout_ms) {
    const bool complete = is_complete();
    // The mode is kept in the file; asking again would need the write lock for nothing.
    if (database.execAndGet("PRAGMA journal_mode").getString() != "wal")
      database.execAndGet("PRAGMA journal_mode = WAL").getString();
    database.exec("PRAGMA synchronous = FULL");
    if (!complete) create_tables(database, file);
    const int version = version_of(database, file);
    if (version < store_version()) migrate(database, version);
    database.exec("PRAGMA foreign_keys = ON");
  }

  /// SQLite answers "busy" at once where waiting could be a deadlock, as in the change of the
  /// journal mode: opening is then tried again, until the time of the busy timeout is over.
  static std::unique_ptr<Connection> open_when_free(const fs::path& path) {
    using Clock = std::chrono::steady_clock;
    const auto last = Clock::now() + std::chrono::milliseconds(kBusyTimeout_ms);
    for (;;) {
      try {
        return std::make_unique<Connection>(path);
      } catch (const SQLite::Exception& exception) {
        if (!is_busy(exception) || Clock::now() > last) throw;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
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
  } catch (const SQLite::Exception& exception) {
    throw store_error(file, exception);
  }
}

Store::~Store() {
  try {
    if (connection_) close();
  } catch (const Error&) {
    // Everything acknowledged is safe in the write-ahead log; the next opening moves it.
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
    SQLite::Statement(connection_->database, "PRAGMA wal_checkpoint(TRUNCATE)").executeStep();
    connection_.reset();
  } catch (const SQLite::Exception& exception) {
    connection_.reset();
    throw store_error(file, exception);
  }
}

namespace {

using LockClock = std::chrono::steady_clock;

/// The system frees a lock when its holder dies, so what is waited for is at work.
constexpr auto kPatience = std::chrono::seconds(60);

bool lock_before(int fd, int operation, LockClock::time_point last) {
  while (::flock(fd, operation | LOCK_NB) != 0) {
    if (LockClock::now() > last) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace

fs::path real_store(fs::path store) {
  constexpr int kMostLinks = 40;  // as the system follows
  std::error_code error;
  for (int i = 0; i < kMostLinks && fs::is_symlink(store, error); ++i)
    store = (store.parent_path() / fs::read_symlink(store, error)).lexically_normal();
  return store;
}

/// All pass a gate before the lock; who wants it alone keeps the gate until it has it, so
/// that those who come later, one after the other, cannot keep it away for ever.
StoreLock::StoreLock(const fs::path& named, Kind kind) {
  const fs::path store = real_store(named);
  const fs::path folder = store.has_parent_path() ? store.parent_path() : fs::path(".");
  std::error_code refused;
  if (kind == Kind::alone) fs::create_directories(folder, refused);
  fd_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd_ < 0) return;  // Opening the store itself says why.
  const int operation = kind == Kind::alone ? LOCK_EX : LOCK_SH;
  const fs::path gate = folder / ("." + store.filename().string() + ".lock");
  const int create = kind == Kind::alone ? O_CREAT : 0;
  const int gate_fd = ::open(gate.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | create, 0644);
  const LockClock::time_point last = LockClock::now() + kPatience;
  const bool passed = gate_fd < 0 || lock_before(gate_fd, operation, last);
  const bool locked = passed && lock_before(fd_, operation, last);
  if (gate_fd >= 0) ::close(gate_fd);
  if (locked) return;
  ::close(fd_);
  throw bad_input(
      fmt::format("the results store was in use by other programs for {} s", kPatience.count()),
      {.file = store.string()},
      "wait for the other programs and run this one again; nothing stored is lost");
}

StoreLock::~StoreLock() {
  if (fd_ >= 0) ::close(fd_);
}

std::string bytes_sha256(SQLite::Database& database) {
  sqlite3_int64 size = 0;
  const std::unique_ptr<unsigned char, decltype(&sqlite3_free)> bytes(
      sqlite3_serialize(database.getHandle(), "main", &size, 0), &sqlite3_free);
  if (!bytes) throw SQLite::Exception(database.getHandle());
  return sha256_of(std::span(bytes.get(), static_cast<std::size_t>(size)));
}

}  // namespace drape::compare
