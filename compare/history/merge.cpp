// SPDX-License-Identifier: Apache-2.0
#include "compare/history/merge.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string>

#include "compare/history/seal.hpp"
#include "compare/store/ledger.hpp"
#include "compare/store/sqlite_error.hpp"
#include "compare/store/store.hpp"
#include "core/error.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// A table of one unit and which of its rows belong to the unit with key ?1; `{}` is the database.
struct UnitTable {
  std::string name;
  std::string rows;
};

std::vector<UnitTable> tables_of(const LedgerKind& kind) {
  static const std::map<std::string, std::pair<std::string, std::string>> children = {
      {"calibration_file", {"calibration_camera", "calibration_sha256 = ?1"}},
      {"sheet", {"gap", "sheet_sha256 = ?1"}},
      {"drapemeter", {"hem_harmonic", "sheet_sha256 = ?1"}},
      {"comparison",
       {"mark_error", "comparison_id = (SELECT id FROM {}.comparison WHERE sha256 = ?1)"}}};
  std::vector<UnitTable> tables = {{kind.table, std::string(kind.key_column) + " = ?1"}};
  const auto child = children.find(kind.table);
  if (child != children.end()) tables.push_back({child->second.first, child->second.second});
  return tables;
}

/// One store attached to the target as `other`.
class Merge {
 public:
  explicit Merge(SQLite::Database& database) : database_(database) {}

  MergeCounts run(const fs::path& source) {
    MergeCounts counts;
    SQLite::Transaction transaction(database_, SQLite::TransactionBehavior::IMMEDIATE);
    LedgerWriter ledger(database_);
    for (const LedgerKind& kind : ledger_kinds()) {
      const std::vector<UnitTable> tables = tables_of(kind);
      for (const std::string& key : keys_of(kind)) {
        const bool there = has(kind, key);
        if (!there) {
          for (const UnitTable& table : tables) copy(table, key);
          ledger.append(kind.table, key);
        }
        ++(there ? counts.present : counts.added);
        for (const UnitTable& table : tables) check(table, key, source);
      }
    }
    transaction.commit();
    return counts;
  }

 private:
  /// Everything but the short number of a comparison, which each store gives out itself.
  std::string columns_of(const std::string& table) {
    std::string& columns = columns_[table];
    if (!columns.empty()) return columns;
    std::vector<std::string> names;
    SQLite::Statement query(database_, "SELECT name FROM pragma_table_info(?)");
    query.bind(1, table);
    while (query.executeStep()) {
      const std::string name = query.getColumn(0).getString();
      if (name != "id" && name != "comparison_id") names.push_back('"' + name + '"');
    }
    return columns = fmt::format("{}", fmt::join(names, ", "));
  }
  std::vector<std::string> keys_of(const LedgerKind& kind) {
    std::vector<std::string> keys;
    SQLite::Statement query(database_, fmt::format("SELECT {1} FROM other.{0} ORDER BY {1}",
                                                   kind.table, kind.key_column));
    while (query.executeStep()) keys.push_back(query.getColumn(0).getString());
    return keys;
  }
  bool has(const LedgerKind& kind, const std::string& key) {
    SQLite::Statement query(
        database_, fmt::format("SELECT 1 FROM main.{} WHERE {} = ?1", kind.table, kind.key_column));
    query.bind(1, key);
    return query.executeStep();
  }
  [[nodiscard]] static std::string rows(const UnitTable& table, const char* database) {
    return fmt::format(fmt::runtime(table.rows), database);
  }
  void copy(const UnitTable& table, const std::string& key) {
    const std::string columns = columns_of(table.name);
    const bool marks = table.name == "mark_error";
    SQLite::Statement insert(
        database_,
        fmt::format("INSERT INTO main.{0} ({1}{2}) SELECT {3}{2} FROM other.{0} WHERE {4}",
                    table.name, marks ? "comparison_id, " : "", columns,
                    marks ? "(SELECT id FROM main.comparison WHERE sha256 = ?1), " : "",
                    rows(table, "other")));
    insert.bind(1, key);
    insert.exec();
  }
  void check(const UnitTable& table, const std::string& key, const fs::path& source) {
    for (const auto& [a, b] : {std::pair{"main", "other"}, std::pair{"other", "main"}}) {
      SQLite::Statement different(
          database_,
          fmt::format("SELECT {0} FROM {1}.{2} WHERE {3} EXCEPT SELECT {0} FROM "
                      "{4}.{2} WHERE {5}",
                      columns_of(table.name), a, table.name, rows(table, a), b, rows(table, b)));
      different.bind(1, key);
      if (!different.executeStep()) continue;
      throw bad_input(
          fmt::format("two stores say different things of {} {}", table.name, key.substr(0, 12)),
          {.file = source.string()},
          "compare both with `drape results show`; import one of them anew");
    }
  }

  SQLite::Database& database_;
  std::map<std::string, std::string> columns_;
};

/// A copy of the present version, made from one state of the source whoever writes meanwhile.
fs::path copy_of(const fs::path& source, const fs::path& target) {
  const fs::path copy = target.string() + ".merging";
  fs::remove(copy);
  {
    SQLite::Database database(source.string(), SQLite::OPEN_READONLY, kBusyTimeout_ms);
    SQLite::Statement vacuum(database, "VACUUM INTO ?");
    vacuum.bind(1, copy.string());
    vacuum.exec();
  }
  Store(copy).close();  // brings an older version to this one
  return copy;
}

/// Sources by the ends of their chains; throws when a row does not stand as it was written.
std::map<std::string, fs::path> checked(const std::vector<fs::path>& sources) {
  std::map<std::string, fs::path> by_head;
  for (const fs::path& source : sources) {
    const StoreReader reader(source);
    const LedgerCheck ledger = check_ledger(reader);
    if (!ledger.findings.empty())
      throw bad_input("a store to merge was changed: " + ledger.findings.front(),
                      {.file = source.string()}, "see `drape results verify`");
    by_head.emplace(ledger.head, source);
  }
  return by_head;
}

}  // namespace

MergeCounts merge_stores(const fs::path& target, const std::vector<fs::path>& sources) {
  const std::map<std::string, fs::path> by_head = checked(sources);
  MergeCounts counts;
  std::vector<fs::path> files;
  for (const auto& [head, source] : by_head) {
    Store(target).close();
    const fs::path copy = copy_of(source, target);
    try {
      SQLite::Database database(target.string(), SQLite::OPEN_READWRITE, kBusyTimeout_ms);
      database.exec("PRAGMA foreign_keys = ON");
      SQLite::Statement attach(database, "ATTACH ? AS other");
      attach.bind(1, copy.string());
      attach.exec();
      const MergeCounts one = Merge(database).run(source);
      counts.added += one.added;
      counts.present += one.present;
    } catch (const SQLite::Exception& exception) {
      fs::remove(copy);
      throw store_error(target, exception);
    } catch (...) {
      fs::remove(copy);
      throw;
    }
    fs::remove(copy);
    if (!fs::exists(seal_path(source))) continue;
    const fs::path folder = source.has_parent_path() ? source.parent_path() : fs::path(".");
    for (const auto& [file, sha256] : read_seal(source).files) files.push_back(folder / file);
  }
  seal_store(target, files);
  return counts;
}

}  // namespace drape::compare
