// SPDX-License-Identifier: Apache-2.0
#include "compare/history/verify.hpp"

#include <SQLiteCpp/Savepoint.h>
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "compare/schema/schema.hpp"
#include "compare/store/manifest.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/store.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Writes what `rows` adds into `target`; a store created for this is removed if it fails.
void write_into(const fs::path& target, const std::function<void(Writer&)>& rows) {
  const bool there = fs::exists(target);
  try {
    Store store(target);
    store.write(rows);
    store.close();
  } catch (...) {
    std::error_code ignored;
    for (const char* end : {"", "-wal", "-shm"})
      if (!there) fs::remove(target.string() + end, ignored);
    throw;
  }
}

/// Copies the paths of another store's content, relative to the folder of `target`.
void copy_places(const std::vector<Cells>& files, const fs::path& source, const fs::path& target,
                 Writer& writer) {
  for (const auto& [sha256, path] : typed<std::string, std::string>(files))
    writer.insert_file(
        sha256, fs::proximate((folder_of(source) / path).lexically_normal(), folder_of(target))
                    .generic_string());
}

struct Source {
  explicit Source(const fs::path& file) : reader(file), rows(reader.database()) {}
  StoreReader reader;
  RowReader rows;
};

class Merge {
 public:
  Merge(const fs::path& target, const std::vector<std::unique_ptr<Source>>& sources, Writer& writer)
      : target_(target), sources_(sources), writer_(writer), own_(writer.database()) {}

  MergeCounts run() {
    for (std::size_t i = 0; i < sources_.size(); ++i)
      for (const auto& [kind, key] : rows_of<std::string, std::string>(
               sources_[i]->reader.database(),
               "SELECT kind, key FROM listed WHERE kind <> 'metric' ORDER BY sequence"))
        take(i, listed_table(kind), key);
    return std::move(counts_);
  }

 private:
  void take(std::size_t at, const ListedTable& table, const std::string& key) {
    Source& source = *sources_[at];
    if (table.name == "blob") {
      const bool there = writer_.has("blob", key);
      if (!there) writer_.insert_blob(key, *source.reader.blob(key));
      ++(there ? counts_.present : counts_.added);
      return;
    }
    const ListedRows theirs = source.rows.read(table, key, RowReader::Take::rows);
    if (table.name == "file")
      return copy_places(theirs.rows, source.reader.file(), target_, writer_);
    ListedRows ours = own_.read(table, key, RowReader::Take::rows);
    const bool is_new = ours.count == 0;
    ++(is_new ? counts_.added : counts_.present);
    if (ours.sha256 == theirs.sha256) return;
    std::vector<Cells>& rows = is_new ? (ours.rows = theirs.rows) : ours.rows;
    if (combine(table, key, rows, theirs.rows, at))
      counts_.known_better.insert(fmt::format("{} {}", table.name, key));
    for (std::size_t later = at + 1; later < sources_.size(); ++later)
      combine(table, key, rows, sources_[later]->rows.read(table, key, RowReader::Take::rows).rows,
              later);
    for (const Cells& row : rows)
      if (is_new && !writer_.insert_row(table, row)) contradict(table, key, at);
    if (!is_new && table.name == "run") repeat_run(key, theirs.rows.front()[column(table, "date")]);
  }

  static std::size_t column(const ListedTable& table, const std::string& name) {
    const auto found = std::find(table.columns.begin(), table.columns.end(), '"' + name + '"');
    return static_cast<std::size_t>(found - table.columns.begin());
  }

  /// Fills missing values of `ours`; true if there were any. A sheet can have been given to one
  /// store without the files beside it, which is not a contradiction.
  bool combine(const ListedTable& table, const std::string& key, std::vector<Cells>& ours,
               const std::vector<Cells>& theirs, std::size_t source) const {
    if (theirs.empty()) return false;
    if (ours.size() != theirs.size()) contradict(table, key, source);
    bool filled = false;
    for (std::size_t row = 0; row < ours.size(); ++row)
      for (std::size_t i = 0; i < ours[row].size(); ++i) {
        Cell& own = ours[row][i];
        const Cell& other = theirs[row][i];
        if (own == other || other.is_null()) continue;
        // The same run can have been stored on two days.
        if (table.name == "run" && i == column(table, "date")) continue;
        if (!own.is_null()) contradict(table, key, source);
        own = other;
        filled = true;
      }
    return filled;
  }

  /// A run that two stores received at two times was stored at both.
  void repeat_run(const std::string& key, const Cell& date) {
    if (writer_.value<int>("SELECT 1 FROM run WHERE sha256 = ?1 AND date = ?2 UNION ALL SELECT 1 "
                           "FROM run_repetition WHERE run_sha256 = ?1 AND date = ?2",
                           {key, date}))
      return;
    const std::string& moment = std::get<std::string>(date);
    writer_.insert("run_repetition", repetition_key(key, moment, 0), key, moment);
  }

  [[noreturn]] void contradict(const ListedTable& table, const std::string& key,
                               std::size_t source) const {
    throw bad_input(
        fmt::format("two stores contradict each other on {} {}", table.name, key.substr(0, 12)),
        {.file = sources_[source]->reader.file().string()},
        "see what each has by `drape results show`; leave the wrong one out, and import its right "
        "sheets into a new store");
  }

  fs::path target_;
  const std::vector<std::unique_ptr<Source>>& sources_;
  Writer& writer_;
  RowReader own_;
  MergeCounts counts_;
};

}  // namespace

MergeCounts merge_stores(const fs::path& target, const std::vector<fs::path>& stores) {
  std::map<std::string, std::unique_ptr<Source>> by_manifest;
  for (const fs::path& store : stores) {
    if (fs::exists(target) && fs::exists(store) && fs::equivalent(store, target))
      throw usage_error("a store cannot be merged into itself", "name another with --store");
    auto source = std::make_unique<Source>(store);
    if (const auto altered = altered_rows(source->reader); !altered.empty())
      throw not_as_written(store, altered.front());
    by_manifest.try_emplace(last_manifest(source->reader.database()).sha256, std::move(source));
  }
  std::vector<std::unique_ptr<Source>> sources;
  for (auto& [manifest, source] : by_manifest) sources.push_back(std::move(source));
  MergeCounts counts;
  write_into(target, [&](Writer& writer) { counts = Merge(target, sources, writer).run(); });
  return counts;
}

namespace {

constexpr int kLongestHole = 10000;     ///< number of entries that may be missing before the last
constexpr int kLeastEntry_bytes = 128;  ///< two hashes, which bounds the entries in a file

/// A copy of a damaged store, since opening it can move its write-ahead log into it.
class DamagedCopy {
 public:
  explicit DamagedCopy(const fs::path& store) {
    for (const char* end : {"", "-wal"})
      if (fs::is_regular_file(store.string() + end))
        fs::copy_file(store.string() + end, file().string() + end);
  }
  [[nodiscard]] fs::path file() const { return folder_.path() / "store"; }

  /// Gives the copy the header and the schema of an empty store. Both are made by the same
  /// statements, so each table has its root on the same page, unless the store was once migrated
  /// from an older version; the hashes of the rows show whether what is read this way was written.
  void take_schema() {
    const fs::path empty = folder_.path() / "empty";
    Store(empty).close();
    SQLite::Database database(empty.string(), SQLite::OPEN_READWRITE);
    const auto size = static_cast<std::size_t>(database.execAndGet("PRAGMA page_size").getInt());
    const std::string good = read_text(empty);
    std::string bytes = read_text(file());
    if (bytes.size() < size) return;
    for (const auto& [page] :
         rows_of<int>(database, "SELECT pageno FROM dbstat WHERE name = 'sqlite_schema'")) {
      const std::size_t at = size * (static_cast<std::size_t>(page) - 1);
      if (at + size <= bytes.size()) bytes.replace(at, size, good, at, size);
    }
    constexpr std::size_t kPageCount = 28, kFreePages = 32;  // big-endian; SQLite's format, 1.3
    const std::size_t count = bytes.size() / size;
    for (std::size_t i = 0; i < 4; ++i)
      bytes[kPageCount + i] = static_cast<char>(count >> (24 - 8 * i));
    std::fill_n(bytes.begin() + kFreePages, 8, '\0');
    write_durable(file(), bytes);
  }

 private:
  TemporaryFolder folder_{"a copy of the store cannot be made"};
};

/// Table, key and hash of rows that a manifest lists.
using Entry = std::tuple<std::string, std::string, std::string>;

/// A damaged store read in one particular way.
class Damaged {
 public:
  explicit Damaged(const fs::path& file) : database_(file.string(), SQLite::OPEN_READWRITE) {}

  [[nodiscard]] SQLite::Database& database() { return database_; }

  [[nodiscard]] std::optional<Entry> entry(std::int64_t sequence) {
    const auto found = tried([&] {
      return rows_of<std::string, std::string, std::string>(
          database_, "SELECT kind, key, sha256 FROM listed WHERE sequence = ?", {sequence});
    });
    return found.empty() ? std::nullopt : std::optional(found.front());
  }

  /// Copies everything that still has its hash.
  bool carry(const Entry& entry, const fs::path& source, const fs::path& target, Writer& writer) {
    const auto& [kind, key, sha256] = entry;
    if (kind == "blob") {
      auto content = tried([&, &of = key] { return blob_in(database_, of); });
      if (!content) content = tried([&, &of = key] { return blob_in(database_, of, false); });
      if (content) writer.insert_blob(key, *content);
      return content.has_value();
    }
    const auto table = std::find_if(listed_tables().begin(), listed_tables().end(),
                                    [&of = kind](const auto& one) { return one.name == of; });
    if (table == listed_tables().end()) return false;
    if (RowReader(writer.database()).read(*table, key).sha256 == sha256) return true;
    for (RowReader* reader : {&by_index_, &by_table_})
      if (tried([&, &of = key, &written = sha256] {
            const ListedRows found = reader->read(*table, of, RowReader::Take::rows);
            if (found.sha256 != written) return false;
            SQLite::Savepoint unit(writer.database(), "unit");
            if (table->name == "file") copy_places(found.rows, source, target, writer);
            for (const Cells& row : found.rows)
              if (table->name != "file" && !writer.insert_row(*table, row)) return false;
            unit.release();
            return true;
          }))
        return true;
    return false;
  }

 private:
  /// The result; an empty one if a page is damaged.
  template <class Work>
  static auto tried(const Work& work) -> decltype(work()) {
    try {
      return work();
    } catch (const SQLite::Exception&) {
      return {};
    }
  }

  SQLite::Database database_;
  RowReader by_index_{database_}, by_table_{database_, false};
};

/// Ways to read a damaged store: as it is, if its tables are those of this program, and with a new
/// schema. An older version is migrated to this one.
std::vector<std::unique_ptr<Damaged>> ways_to_read(const DamagedCopy& copy, DamagedCopy& mended,
                                                   const fs::path& damaged,
                                                   std::vector<std::string>& lost) {
  std::vector<std::unique_ptr<Damaged>> ways;
  try {
    auto way = std::make_unique<Damaged>(copy.file());
    const int version = version_of(way->database(), damaged);
    if (version > 0 && version < store_version()) migrate(way->database(), version, damaged, &lost);
    const std::vector<std::string> findings = schema_findings(way->database());
    if (std::none_of(findings.begin(), findings.end(),
                     [](const std::string& one) { return one.starts_with("table "); }))
      ways.push_back(std::move(way));
  } catch (const SQLite::Exception&) {  // the next way may not need that page
  } catch (const Error&) {
  }
  mended.take_schema();
  ways.push_back(std::make_unique<Damaged>(mended.file()));
  return ways;
}

}  // namespace

Rescue rescue_store(const fs::path& named, const fs::path& fresh) {
  const fs::path damaged = real_store(named);
  if (!fs::is_regular_file(damaged))
    throw bad_input("there is no results store", {.file = damaged.string()},
                    "name the damaged one");
  if (fs::exists(fresh) && fs::equivalent(fresh, damaged))
    throw usage_error("a store cannot be rescued into itself", "name a new one with --store");
  const DamagedCopy copy(damaged);
  DamagedCopy mended(damaged);
  const auto most_entries = static_cast<std::int64_t>(
      (fs::file_size(copy.file()) + (fs::exists(copy.file().string() + "-wal")
                                         ? fs::file_size(copy.file().string() + "-wal")
                                         : 0)) /
      kLeastEntry_bytes);
  Rescue result;
  const auto ways = ways_to_read(copy, mended, damaged, result.lost);
  write_into(fresh, [&](Writer& writer) {
    std::int64_t last = 0;
    const auto end = [&] { return std::min<std::int64_t>(last + kLongestHole, most_entries); };
    for (std::int64_t sequence = 1; sequence <= end(); ++sequence) {
      std::optional<Entry> entry;
      for (const auto& way : ways)
        if (!entry) entry = way->entry(sequence);
      if (!entry) continue;
      for (++last; last < sequence; ++last)
        result.lost.push_back(fmt::format("listed row {}", last));
      if (std::any_of(ways.begin(), ways.end(),
                      [&](const auto& way) { return way->carry(*entry, damaged, fresh, writer); }))
        ++result.kept;
      else
        result.lost.push_back(std::get<0>(*entry) + " " + std::get<1>(*entry));
    }
    if (result.kept == 0)
      throw bad_input("nothing of the store can be read", {.file = damaged.string()},
                      "import the sheets again: drape results import FOLDER --store NEW");
  });
  return result;
}

}  // namespace drape::compare
