// SPDX-License-Identifier: Apache-2.0
#include "compare/history/rescue.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <SQLiteCpp/Savepoint.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "compare/history/seal.hpp"
#include "compare/store/ledger.hpp"
#include "compare/store/rows.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

constexpr int kLongestHole = 10000;     ///< entries that may be missing in a row before the last
constexpr int kLeastEntry_bytes = 128;  ///< two hashes, so a file holds no more entries than that

/// Opening a store may move its write-ahead log into it, so a copy is opened.
class StoreCopy {
 public:
  explicit StoreCopy(const fs::path& store) {
    const auto copy = [&](const std::string& end) {
      if (!fs::is_regular_file(store.string() + end)) return;
      fs::copy_file(store.string() + end, file().string() + end);
      most_entries_ +=
          static_cast<long long>(fs::file_size(file().string() + end)) / kLeastEntry_bytes;
    };
    copy("");
    copy("-wal");
  }
  [[nodiscard]] fs::path file() const { return folder_.path() / "store"; }
  [[nodiscard]] long long most_entries() const { return most_entries_; }

 private:
  TemporaryFolder folder_{"a copy of the store cannot be made"};
  long long most_entries_ = 0;
};

/// Gives the copy the header and the schema of an empty store. Both are made by the same
/// statements, so each table has its root on the same page, unless the store was once brought from
/// an older version; the hashes of the ledger say whether what is read so was written.
void take_schema(const fs::path& empty, const fs::path& copy) {
  SQLite::Database database(empty.string(), SQLite::OPEN_READWRITE);
  database.exec("PRAGMA wal_checkpoint(TRUNCATE)");
  const auto size = static_cast<std::size_t>(database.execAndGet("PRAGMA page_size").getInt());
  const std::string good = read_text(empty);
  std::string bytes = read_text(copy);
  for (const auto& [page] :
       rows_of<int>(database, "SELECT pageno FROM dbstat WHERE name = 'sqlite_schema'")) {
    const std::size_t at = size * (static_cast<std::size_t>(page) - 1);
    if (at + size <= bytes.size()) bytes.replace(at, size, good, at, size);
  }
  constexpr std::size_t kPageCount = 28, kFreePages = 32;  // big-endian; SQLite's file format, 1.3
  const std::size_t count = bytes.size() / size;
  for (std::size_t i = 0; i < 4; ++i)
    bytes[kPageCount + i] = static_cast<char>(count >> (24 - 8 * i));
  std::fill_n(bytes.begin() + kFreePages, 8, '\0');
  write_durable(copy, bytes);
}

/// An entry of the damaged ledger that can still be read.
struct Entry {
  std::string kind, key, content;
};

std::optional<Entry> entry_of(SQLite::Database& database, long long sequence) {
  try {
    for (auto& [kind, key, content] : rows_of<std::string, std::string, std::string>(
             database, "SELECT kind, key, content_sha256 FROM ledger WHERE sequence = ?",
             {sequence}))
      return Entry{kind, key, content};
  } catch (const SQLite::Exception&) {  // a page of it is damaged
  }
  return std::nullopt;
}

void copy_rows(SQLite::Database& from, SQLite::Database& to, const UnitTable& table,
               const std::string& query, const std::string& key) {
  SQLite::Statement rows(from, query);
  rows.bind(1, key);
  std::vector<std::string> names, marks;
  for (int i = 0; i < rows.getColumnCount(); ++i) {
    names.push_back(fmt::format("\"{}\"", rows.getColumnName(i)));
    marks.emplace_back("?");
  }
  const std::string insert = fmt::format("INSERT INTO {} ({}) VALUES ({})", table.name,
                                         fmt::join(names, ", "), fmt::join(marks, ", "));
  for (const Cells& row : rest_of(rows)) execute(to, insert, row);
}

/// All rows of the unit or none.
void copy_unit(SQLite::Database& from, SQLite::Database& to, const LedgerKind& kind,
               Reading reading, const std::string& key) {
  SQLite::Savepoint unit(to, "unit");
  for (const UnitTable& table : kind.tables)
    copy_rows(from, to, table, unit_query(table, reading, &table != &kind.tables.front()), key);
  unit.release();
}

/// The first reading that gives what the ledger says was written.
std::optional<Reading> reading_of(SQLite::Database& from, const LedgerKind& kind,
                                  const Entry& entry) {
  for (const Reading reading : {Reading::whole, Reading::tables, Reading::alone}) {
    try {
      if (content_sha256(from, kind, entry.key, reading) == entry.content) return reading;
    } catch (const SQLite::Exception&) {  // the next may do without that tree
    }
  }
  return std::nullopt;
}

/// True when the unit came over; false when its rows are not those of the entry, or hang on rows
/// that did not come over.
bool carry(SQLite::Database& from, SQLite::Database& to, LedgerWriter& ledger, const Entry& entry) {
  const LedgerKind* kind = ledger_kind(entry.kind);
  if (kind == nullptr) return false;
  try {
    const auto reading = reading_of(from, *kind, entry);
    if (!reading) return false;
    // The metrics are written into every new store.
    if (content_sha256(to, *kind, entry.key) == entry.content) return true;
    copy_unit(from, to, *kind, *reading, entry.key);
  } catch (const SQLite::Exception&) {
    return false;
  }
  ledger.append(entry.kind, entry.key);
  return true;
}

}  // namespace

Rescue rescue_store(const fs::path& named, const fs::path& fresh) {
  const fs::path damaged = real_store(named);
  if (fs::exists(fresh))
    throw bad_input("there is a file already", {.file = fresh.string()},
                    "name a new store with --store");
  if (!fs::is_regular_file(damaged))
    throw bad_input("there is no results store", {.file = damaged.string()},
                    "name the damaged one");
  const StoreCopy copy(damaged), other(damaged);
  const StoreLock lock(fresh, StoreLock::Kind::alone);
  Rescue result;
  try {
    Store(fresh).close();
    take_schema(fresh, other.file());
    SQLite::Database from(copy.file().string(), SQLite::OPEN_READWRITE);
    SQLite::Database mended(other.file().string(), SQLite::OPEN_READWRITE);
    SQLite::Database to(fresh.string(), SQLite::OPEN_READWRITE);
    to.exec("PRAGMA foreign_keys = ON");
    SQLite::Transaction transaction(to, SQLite::TransactionBehavior::IMMEDIATE);
    LedgerWriter ledger(to);
    long long last = 0;
    const auto end = [&] { return std::min(last + kLongestHole, copy.most_entries()); };
    for (long long sequence = 1; sequence <= end(); ++sequence) {
      auto entry = entry_of(from, sequence);
      if (!entry) entry = entry_of(mended, sequence);
      if (!entry) continue;
      for (++last; last < sequence; ++last)
        result.lost.push_back(fmt::format("entry {} of the ledger", last));
      if (carry(from, to, ledger, *entry) || carry(mended, to, ledger, *entry)) {
        ++result.kept;
      } else {
        result.lost.push_back(fmt::format("{} `{}`", entry->kind, entry->key));
      }
    }
    if (last == 0)
      throw bad_input("nothing of the ledger can be read", {.file = damaged.string()},
                      "import the sheets again: drape results import FOLDER --store NEW");
    transaction.commit();
  } catch (const SQLite::Exception& exception) {
    throw store_error(damaged, exception);
  }
  Sealing sealing(lock, fresh);
  sealing.add(take_copies(fresh, damaged));
  try {
    for (const fs::path& file : sealing.take_over(damaged, true))
      result.lost_files.push_back(file.string());
  } catch (const Error& error) {
    result.lost_files.push_back("the list of files: " + error.what_failed());
  }
  sealing.write();
  return result;
}

}  // namespace drape::compare
