// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "compare/store/rows.hpp"

struct sqlite3_stmt;

namespace drape::compare {

/// A table whose rows manifests list, all with one key together: a sheet; the gaps of a sheet; the
/// marks of a comparison. Numbers that each store gives out itself (run.number, comparison.id)
/// count by the key of what they number, so that one content has one hash in every store.
struct ListedTable {
  std::string name;
  std::size_t key_column = 0;        ///< index in the columns of the relation
  std::string key;                   ///< SQL of a row's key; `t` is the table
  std::string with_key;              ///< condition of the rows with key ?1
  std::string number;                ///< SQL of the number that this store gave; "NULL": none
  std::vector<std::string> columns;  ///< quoted names, without that number
  std::vector<std::string> values;   ///< SQL of each
  std::vector<std::string> places;   ///< SQL of its parameter at insertion
  std::vector<bool> later;           ///< came with a later version: counts where it has a value
  std::string order;                 ///< order of the rows of one key
  std::string parent;                ///< table whose number is the key; empty: the key is a column
};
/// Parents before children.
[[nodiscard]] const std::vector<ListedTable>& listed_tables();
[[nodiscard]] const ListedTable& listed_table(const std::string& name);

/// Rows of one table with one key, as the store has them now.
struct ListedRows {
  long long count = 0;
  Cell number;
  std::string sha256;       ///< of type and bytes of every value
  std::vector<Cells> rows;  ///< in the order of ListedTable::columns, where they are asked for
};

/// Reads and hashes rows by their key; keeps its statements.
class RowReader {
 public:
  enum class Take { hash, rows };
  /// `indexed`: by whatever index; else by tables alone, for a file whose indexes are damaged.
  explicit RowReader(SQLite::Database& database, bool indexed = true);
  ~RowReader();
  RowReader(const RowReader&) = delete;
  RowReader& operator=(const RowReader&) = delete;

  [[nodiscard]] ListedRows read(const ListedTable& table, const std::string& key,
                                Take take = Take::hash);
  /// Sentence about rows that are not what a manifest lists of them; empty: they are.
  [[nodiscard]] std::string alteration(const ListedTable& table, const std::string& key);
  /// The same of the whole table, with rows that no manifest lists; counts listed keys.
  [[nodiscard]] std::vector<std::string> alterations(const ListedTable& table, long long& keys);

 private:
  struct Listed {
    std::string sha256;  ///< empty: in no manifest
    Cell number;
  };
  [[nodiscard]] std::string alteration(const ListedTable& table, const std::string& key,
                                       const Listed& listed, long long& count);
  sqlite3_stmt* statement(const ListedTable* table);

  SQLite::Database& database_;
  bool indexed_;
  std::map<const ListedTable*, sqlite3_stmt*> statements_;  ///< null: that of what is listed
};

}  // namespace drape::compare
