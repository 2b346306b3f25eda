// SPDX-License-Identifier: Apache-2.0
#include "compare/history/rescue.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <stdlib.h>  // mkdtemp

#include <algorithm>
#include <array>
#include <deque>
#include <optional>

#include "compare/history/copies.hpp"
#include "compare/history/seal.hpp"
#include "compare/store/ledger.hpp"
#include "compare/store/sqlite_error.hpp"
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
    std::string name = (fs::temp_directory_path() / "drapebench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw bad_input("a copy of the store cannot be made", {.file = name},
                      "set TMPDIR to a folder that can be written");
    folder_ = name;
    fs::copy_file(store, file());
    const fs::path log = store.string() + "-wal";
    if (fs::is_regular_file(log)) fs::copy_file(log, file().string() + "-wal");
    most_entries_ = static_cast<long long>(fs::file_size(file())) / kLeastEntry_bytes;
    if (fs::is_regular_file(log))
      most_entries_ += static_cast<long long>(fs::file_size(log)) / kLeastEntry_bytes;
  }
  ~StoreCopy() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  StoreCopy(const StoreCopy&) = delete;
  StoreCopy& operator=(const StoreCopy&) = delete;

  [[nodiscard]] fs::path file() const { return folder_ / "store"; }
  [[nodiscard]] long long most_entries() const { return most_entries_; }

 private:
  fs::path folder_;
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
  SQLite::Statement pages(database, "SELECT pageno FROM dbstat WHERE name = 'sqlite_schema'");
  while (pages.executeStep()) {
    const std::size_t at = size * (static_cast<std::size_t>(pages.getColumn(0).getInt()) - 1);
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
    SQLite::Statement entry(database,
                            "SELECT kind, key, content_sha256 FROM ledger WHERE sequence = ?");
    entry.bind(1, static_cast<int64_t>(sequence));
    if (!entry.executeStep()) return std::nullopt;
    return Entry{entry.getColumn(0).getString(), entry.getColumn(1).getString(),
                 entry.getColumn(2).getString()};
  } catch (const SQLite::Exception&) {
    return std::nullopt;
  }
}

void bind(SQLite::Statement& statement, int index, const SQLite::Column& value) {
  if (value.isInteger()) statement.bind(index, static_cast<int64_t>(value.getInt64()));
  if (value.isFloat()) statement.bind(index, value.getDouble());
  if (value.isText()) statement.bind(index, value.getString());
}

/// "gap" of "SELECT * FROM gap WHERE ...".
std::string table_of(const std::string& query) {
  const std::size_t begin = query.find("FROM ") + 5;
  return query.substr(begin, query.find(' ', begin) - begin);
}

void copy_rows(SQLite::Database& from, SQLite::Database& to, const char* query,
               const std::string& key) {
  SQLite::Statement rows(from, query);
  rows.bind(1, key);
  std::string marks = "?";
  for (int i = 1; i < rows.getColumnCount(); ++i) marks += ", ?";
  SQLite::Statement insert(to, fmt::format("INSERT INTO {} VALUES ({})", table_of(query), marks));
  while (rows.executeStep()) {
    for (int i = 0; i < rows.getColumnCount(); ++i) bind(insert, i + 1, rows.getColumn(i));
    insert.exec();
    insert.reset();
    insert.clearBindings();
  }
}

/// All rows of the unit or none.
void copy_unit(SQLite::Database& from, SQLite::Database& to, const LedgerKind& kind,
               const std::string& key) {
  to.exec("SAVEPOINT unit");
  try {
    for (const char* query : kind.queries) copy_rows(from, to, query, key);
  } catch (const SQLite::Exception&) {
    to.exec("ROLLBACK TO unit");
    to.exec("RELEASE unit");
    throw;
  }
  to.exec("RELEASE unit");
}

/// The queries of a kind, and others for the same rows where a tree cannot be read: tables without
/// their indexes, and the row without any that hang on it. The hash in the ledger says which holds.
class Readings {
 public:
  explicit Readings(const LedgerKind& kind) : kinds_{kind, kind, kind} {
    for (std::size_t i = 0; i < kind.queries.size(); ++i) {
      std::string text = kind.queries[i];
      for (const std::string table : {"FROM comparison ", "FROM run "})
        for (std::size_t at = 0; (at = text.find(table, at)) != std::string::npos; at += 1)
          text.insert(at + table.size(), "NOT INDEXED ");
      kinds_[1].queries[i] = texts_.emplace_back(text).c_str();
      if (i > 0) text = "SELECT * FROM " + table_of(text) + " WHERE 0 AND ?1 IS NULL";
      kinds_[2].queries[i] = texts_.emplace_back(text).c_str();
    }
  }
  Readings(const Readings&) = delete;
  Readings& operator=(const Readings&) = delete;
  /// The first that gives what was written; nullptr: none.
  [[nodiscard]] const LedgerKind* of(SQLite::Database& from, const Entry& entry) const {
    for (const LedgerKind& kind : kinds_) {
      try {
        if (content_sha256(from, kind, entry.key) == entry.content) return &kind;
      } catch (const SQLite::Exception&) {  // the next may do without that tree
      }
    }
    return nullptr;
  }

 private:
  std::array<LedgerKind, 3> kinds_;
  std::deque<std::string> texts_;
};

/// True when the unit came over; false when its rows are not those of the entry, or hang on rows
/// that did not come over.
bool carry(SQLite::Database& from, SQLite::Database& to, LedgerWriter& ledger, const Entry& entry) {
  const auto& kinds = ledger_kinds();
  const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                 [&](const LedgerKind& k) { return entry.kind == k.table; });
  if (kind == kinds.end()) return false;
  try {
    const Readings readings(*kind);
    const LedgerKind* reading = readings.of(from, entry);
    if (reading == nullptr) return false;
    // The metrics are written into every new store.
    if (content_sha256(to, *kind, entry.key) == entry.content) return true;
    copy_unit(from, to, *reading, entry.key);
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
