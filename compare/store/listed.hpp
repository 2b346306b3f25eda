// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "compare/store/rows.hpp"

struct sqlite3_stmt;

namespace drape::compare {

/// A table whose rows are listed in manifests, together for each key: a sheet; the gaps of a sheet;
/// the marks of a comparison. Numbers assigned by each store (run.number, comparison.id) are
/// replaced by the key of what they number, so that equal content has equal hashes in every store.
struct ListedTable {
  std::string name;
  std::size_t key_column = 0;        ///< index in the columns of the relation
  std::string key;                   ///< SQL for a row's key; `t` is the table
  std::string with_key;              ///< SQL condition for the rows with key ?1
  std::string number;                ///< SQL for the number assigned by this store; "NULL" if none
  std::vector<std::string> columns;  ///< quoted names, except that number
  std::vector<std::string> values;   ///< SQL for each value
  std::vector<std::string> places;   ///< SQL for the parameter of each at insertion
  std::vector<bool> later;           ///< added by a later version: counts only if it has a value
  std::string order;                 ///< SQL order of the rows of one key
  std::string parent;  ///< table whose number is the key; empty if the key is a column
};
/// Listed tables, parents before children.
[[nodiscard]] const std::vector<ListedTable>& listed_tables();
[[nodiscard]] const ListedTable& listed_table(const std::string& name);

/// Rows of one table with one key, as they are in the store now.
struct ListedRows {
  long long count = 0;
  Cell number;
  std::string sha256;       ///< over type and bytes of every value
  std::vector<Cells> rows;  ///< in the order of ListedTable::columns, if requested
};

/// Reads and hashes rows by their key; caches its statements.
class RowReader {
 public:
  enum class Take { hash, rows };
  /// `indexed` allows any index; otherwise only tables are read, for a file with damaged indexes.
  explicit RowReader(SQLite::Database& database, bool indexed = true);
  ~RowReader();
  RowReader(const RowReader&) = delete;
  RowReader& operator=(const RowReader&) = delete;

  [[nodiscard]] ListedRows read(const ListedTable& table, const std::string& key,
                                Take take = Take::hash);
  /// Sentence about rows that differ from their manifest; empty if they agree.
  [[nodiscard]] std::string alteration(const ListedTable& table, const std::string& key);
  /// The same for the whole table, including rows that no manifest lists; counts listed keys.
  [[nodiscard]] std::vector<std::string> alterations(const ListedTable& table, long long& keys);

 private:
  struct Listed {
    std::string sha256;  ///< empty if in no manifest
    Cell number;
  };
  [[nodiscard]] std::string alteration(const ListedTable& table, const std::string& key,
                                       const Listed& listed, long long& count);
  sqlite3_stmt* statement(const ListedTable* table);

  SQLite::Database& database_;
  bool indexed_;
  std::map<const ListedTable*, sqlite3_stmt*> statements_;  ///< null for the table of listed keys
};

}  // namespace drape::compare
