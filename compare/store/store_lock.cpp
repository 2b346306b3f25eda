// SPDX-License-Identifier: Apache-2.0
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

#include "compare/store/sqlite_error.hpp"
#include "compare/store/store.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

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
