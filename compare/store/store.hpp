// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compare/compare.hpp"
#include "compare/schema/schema.hpp"
#include "compare/store/rows.hpp"
#include "compare/tables/tables.hpp"
#include "core/calibration.hpp"

namespace drape::compare {

inline constexpr int kApplicationId = 0x44726170;  ///< "Drap", so that `file` can tell

/// Result of an import.
struct ImportCounts {
  int added = 0;    ///< comparisons that are new in the store
  int present = 0;  ///< comparisons it had already
};

/// A recording as the store knows it.
struct RecordingId {
  std::string sha256;                      ///< SHA-256 of recording.json
  std::optional<std::string> recorded_on;  ///< ISO date
  std::string name = {};                   ///< folder
};

/// The file that a link leads to, itself where it is none: log, lock, seal and copies stand beside
/// that, whatever it is called by.
[[nodiscard]] std::filesystem::path real_store(std::filesystem::path store);

/// Keeps the store and its seal together: an import holds it alone from its first commit until the
/// seal is written, verify holds it with others. Waits for the other programs; the system frees it
/// when one dies. Reading rows needs none.
class StoreLock {
 public:
  enum class Kind { alone, with_others };
  /// Throws Error(bad_input) when the store is still in use after the busy timeout.
  StoreLock(const std::filesystem::path& store, Kind kind);
  ~StoreLock();
  StoreLock(const StoreLock&) = delete;
  StoreLock& operator=(const StoreLock&) = delete;

 private:
  int fd_ = -1;
};

/// results.sqlite, opened for writing. Rows are keyed by content hashes and carry no clock time, so
/// importing the same comparison again adds nothing and two undisturbed histories are the same
/// bytes. Each call is one durable transaction (WAL, synchronous FULL): killing the program at any
/// moment loses nothing that was acknowledged and leaves nothing in half. Rows are only ever added;
/// the table `ledger` chains their hashes. A store of an older version is brought to this one.
class Store {
 public:
  /// Opens or creates the store. Throws Error(bad_input) when it cannot be written, is not a
  /// drapebench store, or was made by a newer version.
  explicit Store(const std::filesystem::path& file);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  /// Residuals of the calibration that measured sheets refer to.
  void add(const Calibration& calibration, const std::string& sha256);
  /// All comparisons of one drape. `recording` names where the photographs come from.
  ImportCounts add(const DrapeInput& input, const Report& report,
                   const std::optional<RecordingId>& recording = {});
  /// Pairs of simulations without a real cloth.
  ImportCounts add(const VirtualGroup& group);
  /// Simulations that are compared with nothing, all in one transaction; counts sheets.
  ImportCounts add(const std::vector<Simulation>& simulations);
  /// Rows of one transaction; see writer.hpp. What is added meanwhile belongs to it.
  void write(const std::function<void(class Writer&)>& rows);
  /// Moves everything from the write-ahead log into the one file.
  void close();

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

/// results.sqlite, opened for questions only; nothing done through it changes the store. A store of
/// an older version is copied into memory and brought to this one there.
class StoreReader {
 public:
  explicit StoreReader(const std::filesystem::path& file);
  [[nodiscard]] const std::filesystem::path& file() const;
  ~StoreReader();
  StoreReader(const StoreReader&) = delete;
  StoreReader& operator=(const StoreReader&) = delete;

  /// Result of one statement that starts with SELECT, WITH, VALUES or EXPLAIN. Throws
  /// Error(usage) for any other statement or for several, and Error(bad_input) where the store has
  /// not the tables and views that the programs make.
  [[nodiscard]] Table query(const std::string& sql, const Cells& parameters = {}) const;

  /// The same as tuples, e.g. rows<std::string, double>(...).
  template <class... Types>
  [[nodiscard]] std::vector<std::tuple<Types...>> rows(const std::string& sql,
                                                       const Cells& parameters = {}) const {
    return typed<Types...>(cells(sql, parameters));
  }

  /// The same for a statement that a person wrote: what the store refuses is Error(usage).
  [[nodiscard]] Table answer(const std::string& sql) const;

 private:
  /// The error for a statement that the store refuses, from what it says and what to do.
  using Refusal = std::function<Error(const std::string&, const std::string&)>;
  [[nodiscard]] Error not_as_made(const std::string& what) const;
  [[nodiscard]] std::vector<Cells> cells(const std::string& sql, const Cells& parameters) const;
  [[nodiscard]] Table table_of(const std::string& sql, const Cells& parameters,
                               const Refusal& refusal) const;
  void run(const std::string& sql, const Cells& parameters, const Refusal& refusal,
           const std::function<void(SQLite::Statement&)>& take) const;

  struct Connection;
  std::unique_ptr<Connection> connection_;

  friend struct LedgerCheck check_ledger(const StoreReader& store);
};

/// State of the store by itself: every entry of the ledger recomputed.
struct LedgerCheck {
  long long entries = 0;
  std::string head;          ///< chain_sha256 of the last entry; empty without one
  std::string bytes_sha256;  ///< hash of the file with all that was committed, see seal.hpp
  std::vector<std::string> findings;  ///< empty: every row is as it was written
};
[[nodiscard]] LedgerCheck check_ledger(const StoreReader& store);

/// SHA-256 of the database file as it is when the write-ahead log is moved into it, whether or not
/// that has happened.
[[nodiscard]] std::string bytes_sha256(SQLite::Database& database);

/// Key of a comparison: hash of the sheets' hashes and the version of the metrics.
[[nodiscard]] std::string comparison_key(const std::vector<std::string>& sheet_hashes);

}  // namespace drape::compare
