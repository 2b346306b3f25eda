// SPDX-License-Identifier: Apache-2.0
#include "compare/store/rows.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <atomic>
#include <set>
#include <thread>

#include "core/units.hpp"

namespace drape::compare {
Cell in_mm(const std::optional<double>& length_m) {
  return length_m ? Cell(*length_m / units::mm) : Cell();
}

void Cell::to(std::string& text) const {
  if (const auto* own = std::get_if<std::string>(this)) text = *own;
  if (const auto* whole = std::get_if<std::int64_t>(this)) text = fmt::format("{}", *whole);
  if (const auto* real = std::get_if<double>(this)) text = fmt::format("{}", *real);
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

Cell cell_of(const SQLite::Column& value) {
  if (value.isNull()) return {};
  if (value.isInteger()) return value.getInt64();
  if (value.isFloat()) return value.getDouble();
  return value.getString();
}

std::vector<Cells> rest_of(SQLite::Statement& statement) {
  std::vector<Cells> rows;
  while (statement.executeStep()) {
    Cells& row = rows.emplace_back();
    for (int i = 0; i < statement.getColumnCount(); ++i)
      row.push_back(cell_of(statement.getColumn(i)));
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

namespace {

using Clock = std::chrono::steady_clock;
std::atomic<std::int64_t> waiting_since{0};  // ticks of the clock; 0 if not waiting

/// Sleeps briefly; returns 0 when the time is over.
int wait_a_moment(void* /*none*/, int /*times*/) {
  const std::int64_t now = Clock::now().time_since_epoch().count();
  std::int64_t none = 0;
  waiting_since.compare_exchange_strong(none, now);
  if (Clock::duration(now - waiting_since) > store_patience) return 0;
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return 1;
}

bool is_busy(const SQLite::Exception& exception) {
  const int code = exception.getErrorCode() & 0xFF;
  return code == SQLITE_BUSY || code == SQLITE_LOCKED;
}

/// True for a refused lock, or refused memory shared between programs.
bool is_lock_refused(int extended) {
  for (const int code : {SQLITE_IOERR_LOCK, SQLITE_IOERR_RDLOCK, SQLITE_IOERR_UNLOCK,
                         SQLITE_IOERR_CHECKRESERVEDLOCK, SQLITE_IOERR_SHMLOCK, SQLITE_IOERR_SHMMAP,
                         SQLITE_IOERR_SHMOPEN, SQLITE_IOERR_SHMSIZE, SQLITE_PROTOCOL})
    if (extended == code) return true;
  return false;
}

}  // namespace

void wait_for_others(SQLite::Database& database) {
  sqlite3_busy_handler(database.getHandle(), wait_a_moment, nullptr);
}

void stop_waiting() {
  waiting_since = 0;
}

bool wait_after(const SQLite::Exception& exception) {
  return is_busy(exception) && wait_a_moment(nullptr, 0) == 1;
}

Error not_as_written(const std::filesystem::path& file, const std::string& altered) {
  return bad_input("the results store is not as it was written: " + altered,
                   {.file = file.string()},
                   "see `drape results verify`; `drape results rescue` keeps what is whole");
}

Error store_error(const std::filesystem::path& file, const SQLite::Exception& exception) {
  const Where where{.file = file.string()};
  const std::string reason = exception.what();
  stop_waiting();
  if (is_busy(exception))
    return bad_input(
        fmt::format("the results store was in use by another program for {} s",
                    std::chrono::duration_cast<std::chrono::seconds>(store_patience).count()),
        where, "wait for the other program and run this one again; nothing stored is lost");
  if (is_lock_refused(exception.getExtendedErrorCode()))
    return bad_input("the disk of the results store gives no locks on files: " + reason, where,
                     "put the store on a local disk, e.g. with --store");
  const struct {
    std::set<int> codes;
    const char *what, *remedy;
  } known[] = {
      {{SQLITE_FULL},
       "the results store cannot grow: ",
       "free disk space and run again; nothing already stored is lost"},
      {{SQLITE_READONLY, SQLITE_CANTOPEN, SQLITE_PERM, SQLITE_IOERR},
       "the results store cannot be opened or written: ",
       "check the path, the permissions and the disk, then run again; nothing already stored is "
       "lost"},
      {{SQLITE_NOTADB, SQLITE_CORRUPT},
       "this is not a readable results store: ",
       "name another file with --store, restore this one from a backup, or save what is whole: "
       "drape results rescue"},
      {{SQLITE_ERROR, SQLITE_CONSTRAINT, SQLITE_MISMATCH, SQLITE_SCHEMA, SQLITE_TOOBIG},
       "the results store is not as the programs make it: ",
       "run drape results verify; drape results rescue saves what is whole"}};
  for (const auto& [codes, what, remedy] : known)
    if (codes.contains(exception.getErrorCode() & 0xFF))
      return bad_input(what + reason, where, remedy);
  return internal_error("the results store answered: " + reason, where);
}

}  // namespace drape::compare
