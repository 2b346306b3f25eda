// SPDX-License-Identifier: Apache-2.0
#include "compare/history/merge.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <string>
#include <string_view>

#include "compare/history/copies.hpp"
#include "compare/history/seal.hpp"
#include "compare/store/ledger.hpp"
#include "compare/store/sqlite_error.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// "gap" and "sheet_sha256 = ?1" of "SELECT * FROM gap WHERE sheet_sha256 = ?1 ORDER BY ...". The
/// subquery that turns a key into a number of the store reads the same database, `{}`.
struct UnitTable {
  std::string name, rows;

  explicit UnitTable(std::string query) {
    query = query.substr(query.find("FROM ") + 5);
    name = query.substr(0, query.find(' '));
    rows = query.substr(query.find("WHERE ") + 6);
    rows = rows.substr(0, rows.find(" ORDER BY"));
    if (const std::size_t from = rows.find("FROM "); from != std::string::npos)
      rows.insert(from + 5, "{}.");
  }
  [[nodiscard]] std::string rows_in(const char* database) const {
    return fmt::format(fmt::runtime(rows), database);
  }
};

/// How a column is copied and compared: a number that each store gives out itself stands for the
/// key of its row.
struct Column {
  std::string name, copied, compared;
};

Column column_of(const std::string& table, const std::string& name) {
  const std::string quoted = '"' + name + '"';
  if (table == "mark_error" && name == "comparison_id")
    return {quoted, "(SELECT id FROM main.comparison WHERE sha256 = ?1)", ""};
  if (name == "comparison_id")
    return {quoted,
            "(SELECT id FROM main.comparison WHERE sha256 = (SELECT sha256 FROM other.comparison "
            "WHERE id = comparison_id))",
            "(SELECT sha256 FROM {}.comparison WHERE id = comparison_id)"};
  if (name == "run") return {quoted, "(SELECT number FROM main.run WHERE sha256 = ?1)", ""};
  // The same run may have been stored on two days.
  if (table == "run" && name == "date") return {quoted, quoted, ""};
  return {quoted, quoted, quoted};
}

/// One store attached to the target as `other`.
class Merge {
 public:
  Merge(SQLite::Database& database, const fs::path& source)
      : database_(database), source_(source) {}

  void run(MergeCounts& counts) {
    SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
    LedgerWriter ledger(database_);
    for (const LedgerKind& kind : ledger_kinds()) {
      // The dictionary of the metrics is written into every new store.
      if (std::string_view(kind.table) == "metric") continue;
      const std::vector<UnitTable> tables(kind.queries.begin(), kind.queries.end());
      for (const std::string& key : keys_of(kind)) {
        if (has(kind, key)) {
          for (const UnitTable& table : tables) check(table, key);
          ++counts.present;
          continue;
        }
        for (const UnitTable& table : tables) copy(table, key);
        ledger.append(kind.table, key);
        ++counts.added;
      }
    }
    transaction.commit();
  }

 private:
  const std::vector<Column>& columns_of(const std::string& table) {
    std::vector<Column>& columns = columns_[table];
    if (!columns.empty()) return columns;
    SQLite::Statement query(database_, "SELECT name FROM pragma_table_info(?)");
    query.bind(1, table);
    while (query.executeStep()) {
      const std::string name = query.getColumn(0).getString();
      const bool own_number =
          (table == "comparison" && name == "id") || (table == "run" && name == "number");
      if (!own_number) columns.push_back(column_of(table, name));
    }
    return columns;
  }

  /// Runs by date, so that the last one has the greatest number; all else by key.
  std::vector<std::string> keys_of(const LedgerKind& kind) {
    std::vector<std::string> keys;
    const bool runs = std::string_view(kind.table) == "run";
    SQLite::Statement query(database_,
                            fmt::format("SELECT {1} FROM other.{0} ORDER BY {2}{1}", kind.table,
                                        kind.key_column, runs ? "date, " : ""));
    while (query.executeStep()) keys.push_back(query.getColumn(0).getString());
    return keys;
  }

  bool has(const LedgerKind& kind, const std::string& key) {
    SQLite::Statement query(
        database_, fmt::format("SELECT 1 FROM main.{} WHERE {} = ?1", kind.table, kind.key_column));
    query.bind(1, key);
    return query.executeStep();
  }

  void copy(const UnitTable& table, const std::string& key) {
    std::vector<std::string> names, values;
    for (const Column& column : columns_of(table.name)) {
      names.push_back(column.name);
      values.push_back(column.copied);
    }
    SQLite::Statement insert(
        database_,
        fmt::format("INSERT INTO main.{0} ({1}) SELECT {2} FROM other.{0} WHERE {3}", table.name,
                    fmt::join(names, ", "), fmt::join(values, ", "), table.rows_in("other")));
    insert.bind(1, key);
    insert.exec();
  }

  std::string compared(const UnitTable& table, const char* database) {
    std::vector<std::string> values;
    for (const Column& column : columns_of(table.name)) {
      if (!column.compared.empty())
        values.push_back(fmt::format(fmt::runtime(column.compared), database));
    }
    return fmt::format("SELECT {} FROM {}.{} WHERE {}", fmt::join(values, ", "), database,
                       table.name, table.rows_in(database));
  }

  void check(const UnitTable& table, const std::string& key) {
    const std::string ours = compared(table, "main"), theirs = compared(table, "other");
    SQLite::Statement different(
        database_, fmt::format("SELECT * FROM ({0} EXCEPT {1}) UNION ALL SELECT * FROM ({1} EXCEPT "
                               "{0}) LIMIT 1",
                               ours, theirs));
    different.bind(1, key);
    if (!different.executeStep()) return;
    throw bad_input(
        fmt::format("two stores contradict each other on {} {}", table.name, key.substr(0, 12)),
        {.file = source_.string()},
        "see what each has by `drape results show`, and import the sheets of the wrong one again");
  }

  SQLite::Database& database_;
  fs::path source_;
  std::map<std::string, std::vector<Column>> columns_;
};

/// Made empty, whatever a killed merge left there, and removed in the end.
class WorkFolder {
 public:
  explicit WorkFolder(fs::path folder) : path_(std::move(folder)) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~WorkFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// Copies of the sources as they are at one moment, whoever writes meanwhile. All that can be
/// refused of a source is refused here, before the target is touched.
class SourceCopies {
 public:
  SourceCopies(const fs::path& target, const std::vector<fs::path>& sources)
      : folder_(target.string() + ".merging") {
    for (const fs::path& source : sources) add(source);
  }

  struct Source {
    fs::path store, copy;
  };
  /// By the end of the ledger, so that their order on the command line does not matter.
  [[nodiscard]] const std::map<std::string, Source>& by_head() const { return by_head_; }

 private:
  void add(const fs::path& source) {
    if (!fs::is_regular_file(source))
      throw bad_input("there is no results store", {.file = source.string()}, "name another");
    static_cast<void>(StoreReader(source));  // names a foreign or newer one by its own place
    if (fs::exists(seal_path(source))) static_cast<void>(read_seal(source));
    const fs::path copy = folder_.path() / std::to_string(by_head_.size());
    fs::remove(copy);
    try {
      SQLite::Database database(source.string(), SQLite::OPEN_READONLY, kBusyTimeout_ms);
      SQLite::Statement vacuum(database, "VACUUM INTO ?");
      vacuum.bind(1, copy.string());
      vacuum.exec();
    } catch (const SQLite::Exception& exception) {
      throw store_error(source, exception);
    }
    const LedgerCheck ledger = check_ledger(StoreReader(copy));
    if (!ledger.findings.empty())
      throw bad_input("rows of a store are not as they were written: " + ledger.findings.front(),
                      {.file = source.string()},
                      "see `drape results verify`; `drape results rescue` keeps what is whole");
    if (!by_head_.emplace(ledger.head, Source{source, copy}).second) return;
    Store(copy).close();  // brings an older version to this one
  }

  WorkFolder folder_;
  std::map<std::string, Source> by_head_;
};

}  // namespace

MergeCounts merge_stores(const fs::path& target, const std::vector<fs::path>& sources) {
  for (const fs::path& source : sources) {
    if (fs::exists(target) && fs::exists(source) && fs::equivalent(source, target))
      throw usage_error("a store cannot be merged into itself", "name another with --store");
  }
  const StoreLock lock(target, StoreLock::Kind::alone);
  Sealing sealing(lock, target);
  const SourceCopies copies(target, sources);
  Store(target).close();
  MergeCounts counts;
  try {
    for (const auto& [head, source] : copies.by_head()) {
      SQLite::Database database(target.string(), SQLite::OPEN_READWRITE, kBusyTimeout_ms);
      database.exec("PRAGMA foreign_keys = ON; PRAGMA synchronous = FULL");
      SQLite::Statement attach(database, "ATTACH ? AS other");
      attach.bind(1, source.copy.string());
      attach.exec();
      Merge(database, source.store).run(counts);
    }
  } catch (const SQLite::Exception& exception) {
    throw store_error(target, exception);
  }
  Store(target).close();
  for (const auto& [head, source] : copies.by_head()) {
    sealing.add(take_copies(target, source.store));
    if (!fs::exists(seal_path(source.store))) continue;
    constexpr std::size_t kAtATime = 1000;  // bounds the memory
    std::vector<fs::path> files;
    for (const auto& [file, sha256] : read_seal(source.store).files) {
      files.push_back(folder_of(source.store) / file);
      if (files.size() < kAtATime) continue;
      sealing.add(files);
      files.clear();
    }
    sealing.add(files);
  }
  sealing.write();
  return counts;
}

}  // namespace drape::compare
