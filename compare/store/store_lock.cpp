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

StoreLock::StoreLock(const fs::path& store, Kind kind) {
  using Clock = std::chrono::steady_clock;
  const fs::path folder = store.has_parent_path() ? store.parent_path() : fs::path(".");
  std::error_code refused;
  if (kind == Kind::alone) fs::create_directories(folder, refused);
  fd_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd_ < 0) return;  // Opening the store itself says why.
  const auto last = Clock::now() + std::chrono::milliseconds(kBusyTimeout_ms);
  const int operation = (kind == Kind::alone ? LOCK_EX : LOCK_SH) | LOCK_NB;
  while (::flock(fd_, operation) != 0) {
    if (Clock::now() > last) {
      ::close(fd_);
      throw bad_input(fmt::format("the results store was in use by another program for {} s",
                                  kBusyTimeout_ms / 1000),
                      {.file = store.string()},
                      "wait for the other program and run this one again; nothing stored is lost");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
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
