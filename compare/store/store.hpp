// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>

#include "compare/schema/schema.hpp"
#include "compare/store/manifest.hpp"
#include "core/files/files.hpp"
#include "core/run_report.hpp"

namespace drape::compare {

inline constexpr int kApplicationId = 0x44726170;  ///< "Drap", recognised by `file`

/// The file to which a link leads, or the file itself: its log is beside that file, and paths in
/// the store are relative to it.
[[nodiscard]] std::filesystem::path real_store(std::filesystem::path store);

/// Folder that contains the store.
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& store);

/// One write transaction. Prepared statements are cached; new rows are listed in one manifest, and
/// existing ones are checked against the manifest that lists them.
class Writer {
 public:
  explicit Writer(SQLite::Database& database);

  /// Inserts one row, with cells in the order of the listed table's columns: a run and a comparison
  /// are named by their keys. Returns false if the row already exists, which leaves it unchanged.
  template <class... Values>
  bool insert(const std::string& table, const Values&... values) {
    return insert_row(listed_table(table), {Cell(values)...});
  }
  bool insert_row(const ListedTable& table, const Cells& row);
  /// Adds content under its hash, with its path relative to the store's folder.
  void insert_blob(const std::string& sha256, std::string_view content);
  void insert_file(const std::string& sha256, const std::string& path);

  [[nodiscard]] bool has(const std::string& table, const std::string& sha256);
  [[nodiscard]] int last_id() const { return static_cast<int>(database_.getLastInsertRowid()); }
  [[nodiscard]] SQLite::Database& database() { return database_; }
  /// Throws Error(bad_input) for rows that differ from their manifest.
  void commit();

 private:
  void add(const ListedTable& table, const std::string& key);

  SQLite::Database& database_;
  SQLite::Transaction transaction_;
  std::int64_t manifest_;  ///< number of the manifest to be written
  std::vector<ListedKey> added_;
  std::set<ListedKey> known_;  ///< added or existing before
  std::map<const ListedTable*, SQLite::Statement> statements_;
};

/// results.sqlite, opened for writing. Rows are keyed by content hashes and have no clock time, so
/// importing the same comparison again adds nothing, and two undisturbed histories give the same
/// bytes. Each call is one durable transaction (WAL, synchronous FULL): killing the program at any
/// time loses nothing acknowledged and leaves nothing half done. Rows are only ever added, and
/// each transaction lists its own in a manifest. A store of an older version is migrated to this
/// one.
class Store {
 public:
  /// Opens or creates the store. Throws Error(bad_input) if it cannot be written, is not a
  /// drapebench store, was made by a newer version, or has another schema or size than
  /// written.
  explicit Store(const std::filesystem::path& file);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// Writes rows in one transaction, to which everything added meanwhile belongs.
  void write(const std::function<void(Writer&)>& rows);
  /// Moves everything from the write-ahead log into the one file.
  void close();

 private:
  void open();

  std::filesystem::path file_;
  std::unique_ptr<SQLite::Database> database_;  ///< null if closed
};

/// Rows used in an answer.
struct Printed {
  std::set<std::int64_t> comparisons = {};  ///< values of comparison.id
  std::set<std::int64_t> runs = {};         ///< values of run.number
  bool marks = false;                       ///< true if the marks of the comparisons are used too
  bool values = false;                      ///< values and headlines of the runs too
};

/// results.sqlite, opened for reading; nothing done through it changes the store. A store of an
/// older version is copied into memory and migrated there.
class StoreReader {
 public:
  /// Throws Error(bad_input) if it is no store, or if `schema` must be this program's and is not.
  enum class Schema { own, any };
  explicit StoreReader(const std::filesystem::path& file, Schema schema = Schema::own);
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  /// The file that is read: a copy if this user cannot write the store.
  [[nodiscard]] std::filesystem::path opened() const {
    return copy_ ? copy_->path() / "store" : file_;
  }

  enum class Author { program, person };  ///< of a statement
  /// Result of one statement that starts with SELECT, WITH, VALUES or EXPLAIN. Throws Error(usage)
  /// for any other statement or for several. If the store refuses the statement, throws
  /// Error(usage) for that of a person, otherwise Error(bad_input): the store lacks tables or views
  /// of this program.
  [[nodiscard]] Table query(const std::string& sql, const Cells& parameters = {},
                            Author author = Author::program) const;

  /// The same as tuples, e.g. rows<std::string, double>(...).
  template <class... Types>
  [[nodiscard]] std::vector<std::tuple<Types...>> rows(const std::string& sql,
                                                       const Cells& parameters = {}) const {
    return typed<Types...>(cells(sql, parameters));
  }

  /// The first column of the same.
  template <class T>
  [[nodiscard]] std::vector<T> column(const std::string& sql, const Cells& parameters = {}) const {
    std::vector<T> values;
    for (const Cells& row : cells(sql, parameters)) row[0].to(values.emplace_back());
    return values;
  }

  /// Hashes the rows with these keys in a table (for comparisons and runs including everything
  /// they state) and throws Error(bad_input) if one differs from its manifest. Nothing is
  /// recomputed.
  void require_as_written(const std::string& table, const std::set<std::string>& keys) const;
  void require_as_written(const Printed& printed) const;
  /// The same for whole tables.
  void require_as_written(const std::vector<std::string>& tables) const;

  /// Content by its hash (SHA-256); nullopt if the store does not have it.
  [[nodiscard]] std::optional<std::string> blob(const std::string& sha256) const;

  [[nodiscard]] SQLite::Database& database() const { return database_; }
  [[nodiscard]] bool is_of_older_version() const { return is_older_; }

 private:
  [[nodiscard]] Error refusal(Author author, const std::string& what,
                              const std::string& remedy) const;
  /// `names`: names of the columns; an answer with names has a largest size.
  [[nodiscard]] std::vector<Cells> cells(const std::string& sql, const Cells& parameters,
                                         Author author = Author::program,
                                         std::vector<std::string>* names = nullptr) const;

  std::filesystem::path file_;
  std::unique_ptr<TemporaryFolder> copy_;
  mutable SQLite::Database database_;
  bool is_older_ = false;
};

}  // namespace drape::compare
