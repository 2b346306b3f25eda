// SPDX-License-Identifier: Apache-2.0
#include "compare/history/merge.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <set>
#include <string>

#include "compare/history/seal.hpp"
#include "compare/schema/schema.hpp"
#include "compare/store/ledger.hpp"
#include "compare/store/rows.hpp"
#include "compare/store/runs.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// SQL that copies and compares a column: a number that each store gives out itself stands for the
/// key of its row.
struct MergedColumn {
  std::string name, copied, compared;
};

MergedColumn column_of(const std::string& table, const std::string& name) {
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

  /// Into a copy, which is completed: what is there already is compared value by value, and gets
  /// what only the source knows of it.
  void stage(MergeCounts& counts) {
    for (const auto& [trigger] : rows_of<std::string>(
             database_, "SELECT name FROM main.sqlite_schema WHERE type = 'trigger'"))
      database_.exec("DROP TRIGGER main." + trigger);
    run(counts, true);
  }

  /// From such a copy into the target, which was its beginning: rows that are there stay as they
  /// are.
  void finish(MergeCounts& counts) { run(counts, false); }

 private:
  void run(MergeCounts& counts, bool staged) {
    SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
    LedgerWriter ledger(database_);
    const std::set<std::string> completed = std::move(counts.known_better);
    counts.known_better = staged ? completed : std::set<std::string>();
    for (const LedgerKind& kind : ledger_kinds()) {
      // The dictionary of the metrics is written into every new store.
      if (kind.table == "metric") continue;
      for (const auto& [key] : keys_of(kind)) {
        if (has(kind, key)) {
          const std::string name = fmt::format("{} {}", kind.table, key);
          if (!staged && completed.count(name) != 0) counts.known_better.insert(name);
          if (!staged) continue;
          bool knows_more = false;
          for (const UnitTable& table : kind.tables) knows_more = check(table, key) || knows_more;
          ++counts.present;
          if (knows_more) {
            complete(kind.tables.front(), key);
            counts.known_better.insert(name);
          }
          if (name.starts_with("run ")) repeat_run(ledger, key);
          continue;
        }
        for (const UnitTable& table : kind.tables) copy(table, key);
        ledger.append(kind.table, key);
        ++counts.added;
      }
    }
    transaction.commit();
  }

  const std::vector<MergedColumn>& columns_of(const std::string& table) {
    std::vector<MergedColumn>& columns = columns_[table];
    if (!columns.empty()) return columns;
    for (const RelationColumn& one : relation(table).columns) {
      const bool own_number =
          (table == "comparison" && one.name == "id") || (table == "run" && one.name == "number");
      if (!own_number) columns.push_back(column_of(table, one.name));
    }
    return columns;
  }

  /// Runs by date, those of one second as the other store got them; all else by key.
  std::vector<std::tuple<std::string>> keys_of(const LedgerKind& kind) {
    const bool dated = kind.table == "run" || kind.table == "run_repetition";
    return rows_of<std::string>(
        database_, fmt::format("SELECT t.{1} FROM other.{0} AS t JOIN other.ledger AS l ON l.kind "
                               "= '{0}' AND l.key = t.{1} ORDER BY {2}t.{1}",
                               kind.table, kind.key_column, dated ? "t.date, l.sequence, " : ""));
  }

  bool has(const LedgerKind& kind, const std::string& key) {
    return first_of<int>(database_, "SELECT 1 FROM " + kind.tables.front().rows(), {key})
        .has_value();
  }

  void copy(const UnitTable& table, const std::string& key) {
    std::vector<std::string> names, values;
    for (const MergedColumn& column : columns_of(table.name)) {
      names.push_back(column.name);
      values.push_back(column.copied);
    }
    execute(database_,
            fmt::format("INSERT INTO main.{} ({}) SELECT {} FROM {}", table.name,
                        fmt::join(names, ", "), fmt::join(values, ", "), table.rows("other")),
            {key});
  }

  std::string compared(const UnitTable& table, const char* database) {
    std::vector<std::string> values;
    for (const MergedColumn& column : columns_of(table.name)) {
      if (!column.compared.empty())
        values.push_back(fmt::format(fmt::runtime(column.compared), database));
    }
    // In the order of their keys, which stand first in each table.
    std::string order;
    for (std::size_t i = 1; i <= values.size(); ++i)
      order += fmt::format("{}{}", order.empty() ? "" : ", ", i);
    return fmt::format("SELECT {} FROM {} ORDER BY {}", fmt::join(values, ", "),
                       table.rows(database), order);
  }

  /// True when the source has a value that the target has not: a sheet may have been given to one
  /// of them without the files beside it, which contradicts nothing.
  bool check(const UnitTable& table, const std::string& key) {
    const auto ours = cells_of(database_, compared(table, "main"), {key});
    const auto theirs = cells_of(database_, compared(table, "other"), {key});
    if (ours.size() != theirs.size()) contradict(table, key);
    bool knows_more = false;
    for (std::size_t row = 0; row < ours.size(); ++row)
      for (std::size_t i = 0; i < ours[row].size(); ++i) {
        const Cell &a = ours[row][i], &b = theirs[row][i];
        knows_more = knows_more || (a.is_null() && !b.is_null());
        if (!a.is_null() && !b.is_null() && a != b) contradict(table, key);
      }
    return knows_more;
  }

  /// Fills the row itself; rows that hang on it are of one file with it.
  void complete(const UnitTable& table, const std::string& key) {
    std::vector<std::string> values;
    for (const MergedColumn& column : columns_of(table.name))
      if (column.compared == column.name)
        values.push_back(fmt::format("{0} = coalesce({0}, (SELECT {0} FROM {1}))", column.name,
                                     table.rows("other")));
    execute(database_,
            fmt::format("UPDATE main.{} SET {} WHERE {}", table.name, fmt::join(values, ", "),
                        table.condition),
            {key});
  }

  /// A run that two stores got at two moments was stored at both.
  void repeat_run(LedgerWriter& ledger, const std::string& key) {
    const auto date = first_of<std::string>(
        database_,
        "SELECT o.date FROM other.run AS o JOIN main.run AS m ON m.sha256 = o.sha256 WHERE "
        "o.sha256 = ?1 AND o.date <> m.date AND NOT EXISTS (SELECT 1 FROM main.run_repetition AS a "
        "WHERE a.run_sha256 = ?1 AND a.date = o.date)",
        {key});
    if (!date) return;
    const std::string repetition = repetition_key(key, *date, 0);
    execute(database_, "INSERT INTO main.run_repetition VALUES (?, ?, ?)",
            {repetition, key, *date});
    ledger.append("run_repetition", repetition);
  }

  [[noreturn]] void contradict(const UnitTable& table, const std::string& key) const {
    throw bad_input(
        fmt::format("two stores contradict each other on {} {}", table.name, key.substr(0, 12)),
        {.file = source_.string()},
        "see what each has by `drape results show`; leave the wrong one out, and import its right "
        "sheets into a new store");
  }

  SQLite::Database& database_;
  fs::path source_;
  std::map<std::string, std::vector<MergedColumn>> columns_;
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

void copy_store(const fs::path& from, const fs::path& to) {
  try {
    SQLite::Database database(from.string(), SQLite::OPEN_READONLY, kBusyTimeout_ms);
    execute(database, "VACUUM INTO ?", {to.string()});
  } catch (const SQLite::Exception& exception) {
    throw store_error(from, exception);
  }
}

/// In one transaction. `source` is what `copy` is called in an error.
void merge_one(const fs::path& target, const fs::path& copy, const fs::path& source,
               void (Merge::*how)(MergeCounts&), MergeCounts& counts) {
  try {
    SQLite::Database database(target.string(), SQLite::OPEN_READWRITE, kBusyTimeout_ms);
    database.exec("PRAGMA foreign_keys = ON; PRAGMA synchronous = FULL");
    execute(database, "ATTACH ? AS other", {copy.string()});
    Merge merge(database, source);
    (merge.*how)(counts);
  } catch (const SQLite::Exception& exception) {
    throw store_error(target, exception);
  }
}

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
  /// A place for a store that is gone when the merge is over.
  [[nodiscard]] fs::path staged() const { return folder_.path() / "all"; }
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
    copy_store(source, copy);
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

MergeCounts merge_stores(const fs::path& named, const std::vector<fs::path>& sources) {
  const fs::path target = real_store(named);
  for (const fs::path& source : sources) {
    if (fs::exists(target) && fs::exists(source) && fs::equivalent(source, target))
      throw usage_error("a store cannot be merged into itself", "name another with --store");
  }
  const StoreLock lock(target, StoreLock::Kind::alone);
  Sealing sealing(lock, target);
  const SourceCopies copies(target, sources);
  // All into a copy first: what contradicts is found before the target is touched.
  if (fs::exists(target)) {
    static_cast<void>(StoreReader(target));  // names a foreign or newer one by its own place
    copy_store(target, copies.staged());
  }
  Store(copies.staged()).close();
  MergeCounts counts;
  for (const auto& [head, source] : copies.by_head())
    merge_one(copies.staged(), source.copy, source.store, &Merge::stage, counts);
  Store(target).close();
  counts.added = 0;  // counts the target now
  merge_one(target, copies.staged(), target, &Merge::finish, counts);
  Store(target).close();
  for (const auto& [head, source] : copies.by_head()) {
    sealing.add(take_copies(target, source.store));
    // Photographs and curves may have stayed where the store comes from.
    if (fs::exists(seal_path(source.store))) (void)sealing.take_over(source.store, false);
  }
  sealing.write();
  return counts;
}

}  // namespace drape::compare
