// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <chrono>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/error.hpp"

namespace drape::compare {

/// Cell of a row: NULL, INTEGER, REAL or TEXT.
struct Cell : std::variant<std::monostate, std::int64_t, double, std::string> {
  Cell() = default;
  Cell(std::nullopt_t /*null*/) {}
  Cell(std::integral auto number) : variant(static_cast<std::int64_t>(number)) {}
  Cell(double number) : variant(number) {}
  Cell(std::string text) : variant(std::move(text)) {}
  Cell(const char* text) : variant(std::string(text)) {}
  template <class T>
  Cell(const std::optional<T>& value) {
    if (value) *this = Cell(*value);
  }

  [[nodiscard]] bool is_null() const { return index() == 0; }
  /// A number is converted if requested as another kind of number, and NULL if requested as text.
  void to(std::string& text) const;
  template <class T>
  requires std::is_arithmetic_v<T>
  void to(T& number) const {
    const auto* real = std::get_if<double>(this);
    const auto* whole = std::get_if<std::int64_t>(this);
    number =
        real != nullptr ? static_cast<T>(*real) : static_cast<T>(whole != nullptr ? *whole : 0);
  }
  template <class T>
  void to(std::optional<T>& value) const {
    if (!is_null()) to(value.emplace());
  }
};
using Cells = std::vector<Cell>;

/// A length in millimetres, NULL if absent.
[[nodiscard]] Cell in_mm(const std::optional<double>& length_m);

template <class... Types>
std::vector<std::tuple<Types...>> typed(const std::vector<Cells>& rows) {
  std::vector<std::tuple<Types...>> all(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    std::apply([&, at = rows[i].begin()](auto&... cell) mutable { ((at++)->to(cell), ...); },
               all[i]);
  return all;
}

[[nodiscard]] Cell cell_of(const SQLite::Column& value);
/// The row of a statement that was just executed.
[[nodiscard]] Cells row_of(SQLite::Statement& statement);
void bind_all(SQLite::Statement& statement, const Cells& parameters);
[[nodiscard]] std::vector<Cells> cells_of(SQLite::Database& database, const std::string& sql,
                                          const Cells& parameters = {});
/// Rows of a query as tuples, e.g. rows_of<std::string, double>(...).
template <class... Types>
std::vector<std::tuple<Types...>> rows_of(SQLite::Database& database, const std::string& sql,
                                          const Cells& parameters = {}) {
  return typed<Types...>(cells_of(database, sql, parameters));
}
/// The first cell of the first row, if there is one.
template <class T>
std::optional<T> first_of(SQLite::Database& database, const std::string& sql,
                          const Cells& parameters = {}) {
  std::optional<T> first;
  if (const auto rows = cells_of(database, sql, parameters); !rows.empty()) rows[0][0].to(first);
  return first;
}
/// Runs a statement without result rows; returns the number of rows changed.
int execute(SQLite::Database& database, const std::string& sql, const Cells& parameters = {});

/// Longest time for which a connection waits for other programs at a store.
inline constexpr std::chrono::milliseconds store_patience{60000};
/// Tests whether another program holds what was requested.
[[nodiscard]] bool is_busy(const SQLite::Exception& exception);

/// Error with one clear sentence for what SQLite reported about the store.
[[nodiscard]] Error store_error(const std::filesystem::path& file,
                                const SQLite::Exception& exception);

/// Error for rows that differ from their manifest; `altered` names one.
[[nodiscard]] Error not_as_written(const std::filesystem::path& file, const std::string& altered);

/// A table whose rows are listed in manifests, together for each key: a sheet; the gaps of a sheet;
/// the marks of a comparison. Numbers assigned by each store (run.number, comparison.id) are
/// replaced by the key of what they number, so that equal content has equal hashes in every store.
struct ListedTable {
  std::string name;
  std::string key;                   ///< SQL for a row's key; `t` is the table
  std::string with_key;              ///< SQL condition for the rows with key ?1
  std::string number;                ///< SQL for the number assigned by this store; "NULL" if none
  std::vector<std::string> columns;  ///< quoted names, except that number
  std::vector<std::string> values;   ///< SQL for each value
  std::vector<std::string> places;   ///< SQL for the parameter of each at insertion
  std::size_t key_at = 0;            ///< index of the key in these columns
  std::vector<bool> later;           ///< added by a later version: counts only if it has a value
  std::string order;                 ///< SQL order of the rows of one key
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

  [[nodiscard]] ListedRows read(const ListedTable& table, const std::string& key,
                                Take take = Take::hash);
  /// Sentence about rows that differ from their manifest; empty if they agree.
  [[nodiscard]] std::string alteration(const ListedTable& table, const std::string& key);
  /// The same for the whole table, including rows that no manifest lists; counts listed keys.
  [[nodiscard]] std::vector<std::string> alterations(const ListedTable& table, long long& keys);

 private:
  /// `listed`: hash and number in the manifest; empty if in none.
  [[nodiscard]] std::string alteration(const ListedTable& table, const std::string& key,
                                       const Cells& listed, long long& count);
  SQLite::Statement& statement(const ListedTable* table);

  SQLite::Database& database_;
  bool indexed_;
  std::map<const ListedTable*, SQLite::Statement> statements_;  ///< null: that of listed keys
};

/// Record of one addition to the store: it lists the rows added by their hashes and names the
/// previous manifest by its hash, so that the last one covers everything. Anyone who can write the
/// file can recompute all of them: only a signature of the last one shows that nobody did.
struct Manifest {
  std::int64_t number = 0;
  std::string previous_sha256;  ///< empty for the first
  std::int64_t last = 0;        ///< sequence number of the last row that it lists
  std::int64_t file_size = 0;   ///< size of the store including it, bytes
  std::string sha256;
};
/// `which` ends the query, such as "DESC LIMIT 1".
[[nodiscard]] std::vector<Manifest> manifests_of(SQLite::Database& database,
                                                 const char* which = "");
/// The last manifest; its number is 0 if there is none.
[[nodiscard]] Manifest last_manifest(SQLite::Database& database);

using ListedKey = std::pair<const ListedTable*, std::string>;
/// Lists rows in a new manifest, hashed as they are in the store now. A key that is already listed
/// must have its hash. Writes nothing if nothing is new. Requires a write transaction. Throws
/// Error(bad_input).
void write_manifest(SQLite::Database& database, const std::vector<ListedKey>& added);

/// Hash of a manifest over its numbers and the rows listed.
[[nodiscard]] std::string hash_of(SQLite::Database& database, const Manifest& manifest,
                                  std::int64_t last_before);

/// Sentences about tables, views, indexes and triggers that differ from those of this version.
[[nodiscard]] std::vector<std::string> schema_findings(SQLite::Database& database);

/// Sentence about a file whose size differs from its last manifest; empty if it agrees, or if a
/// part is in a write-ahead log beside it.
[[nodiscard]] std::string size_finding(SQLite::Database& database,
                                       const std::filesystem::path& file);

/// Adds content under its hash, compressed by zlib; false if it exists.
bool add_blob(SQLite::Database& database, const std::string& sha256, std::string_view content);
/// The content with that hash; nullopt if the store lacks it or has other bytes instead. `indexed`
/// as in RowReader.
[[nodiscard]] std::optional<std::string> blob_in(SQLite::Database& database,
                                                 const std::string& sha256, bool indexed = true);

/// Appends type and bytes of a value, as hashes of rows cover them.
void append_value(std::string& bytes, const SQLite::Column& value);

/// Migrates the store at `file` from an older version to store_version() in `database`, in one
/// transaction: afterwards it is either untouched or complete. Foreign keys must be off. Nothing is
/// lost: values unknown to the older version are NULL, and the copies of sheets beside the file
/// become blobs. Throws Error(bad_input) if a row differs from the older version's ledger; with
/// `lost` such rows are added there instead, and to no manifest.
void migrate(SQLite::Database& database, int from_version, const std::filesystem::path& file,
             std::vector<std::string>* lost = nullptr);

/// Version of the store in the file; 0 for an empty file. The caller must hold a transaction if
/// others may write. Throws Error(bad_input) for a file that is not a store, and for a newer
/// version.
[[nodiscard]] int version_of(SQLite::Database& database, const std::filesystem::path& file);

/// Creates an empty store: tables, views, and the metric dictionary in the first manifest.
void create_store(SQLite::Database& database);

}  // namespace drape::compare
