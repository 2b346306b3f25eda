// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
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

/// The file that a link leads to, itself where it is none: its log stands beside that, and paths
/// in the store lead from there, whatever it is called by.
[[nodiscard]] std::filesystem::path real_store(std::filesystem::path store);

/// Folder of the store.
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& store);

/// results.sqlite, opened for writing. Rows are keyed by content hashes and carry no clock time, so
/// importing the same comparison again adds nothing and two undisturbed histories are the same
/// bytes. Each call is one durable transaction (WAL, synchronous FULL): killing the program at any
/// moment loses nothing that was acknowledged and leaves nothing in half. Rows are only ever added,
/// and each transaction lists its own in a manifest. A store of an older version is brought to this
/// one.
class Store {
 public:
  /// Opens or creates the store. Throws Error(bad_input) when it cannot be written, is not a
  /// drapebench store, was made by a newer version, or has another schema or size than it was
  /// written with.
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

/// Rows behind an answer.
struct Printed {
  std::set<std::int64_t> comparisons = {};  ///< comparison.id
  std::set<std::int64_t> runs = {};         ///< run.number
  bool marks = false;                       ///< marks of the comparisons too
  bool values = false;                      ///< values and headlines of the runs too
};

/// results.sqlite, opened for questions only; nothing done through it changes the store. A store of
/// an older version is copied into memory and brought to this one there.
class StoreReader {
 public:
  /// Throws Error(bad_input) where it is no store, or `schema` has to be this program's and is not.
  enum class Schema { own, any };
  explicit StoreReader(const std::filesystem::path& file, Schema schema = Schema::own);
  [[nodiscard]] const std::filesystem::path& file() const;
  /// The file that is read: a copy where this user may not write the store.
  [[nodiscard]] std::filesystem::path opened() const;
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

  /// Hashes the rows of these keys of a table (or comparisons and runs with all that they state)
  /// and throws Error(bad_input) where one is not what its manifest lists. Nothing is computed
  /// again.
  void require_as_written(const std::string& table, const std::set<std::string>& keys) const;
  void require_as_written(const Printed& printed) const;
  /// The same of whole tables.
  void require_as_written(const std::vector<std::string>& tables) const;

  /// Content by its hash (SHA-256); nothing where the store does not have it.
  [[nodiscard]] std::optional<std::string> blob(const std::string& sha256) const;
  /// Paths at which content lay when it was stored.
  [[nodiscard]] std::vector<std::filesystem::path> places_of(const std::string& sha256) const;

  [[nodiscard]] SQLite::Database& database() const;
  [[nodiscard]] bool is_of_older_version() const;

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
};

/// Key of a comparison: hash of the sheets' hashes and the version of the metrics.
[[nodiscard]] std::string comparison_key(const std::vector<std::string>& sheet_hashes);

}  // namespace drape::compare
