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

inline constexpr int kApplicationId = 0x44726170;  ///< "Drap", recognised by `file`

/// Result of an import.
struct ImportCounts {
  int added = 0;    ///< comparisons that are new in the store
  int present = 0;  ///< comparisons that were already there
};

/// Identity of a recording in the store.
struct RecordingId {
  std::string sha256;                      ///< SHA-256 of recording.json
  std::optional<std::string> recorded_on;  ///< ISO date
  std::string name = {};                   ///< folder of the recording
};

/// The file to which a link leads, or the file itself: its log is beside that file, and paths in
/// the store are relative to it.
[[nodiscard]] std::filesystem::path real_store(std::filesystem::path store);

/// Folder that contains the store.
[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& store);

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

  /// Adds the residuals of the calibration to which measured sheets refer.
  void add(const Calibration& calibration, const std::string& sha256);
  /// Adds all comparisons of one drape. `recording` names the source of the photographs.
  ImportCounts add(const DrapeInput& input, const Report& report,
                   const std::optional<RecordingId>& recording = {});
  /// Adds pairs of simulations without a real cloth.
  ImportCounts add(const VirtualGroup& group);
  /// Adds simulations that are not compared, all in one transaction; counts sheets.
  ImportCounts add(const std::vector<Simulation>& simulations);
  /// Writes rows in one transaction (see writer.hpp), to which everything added meanwhile belongs.
  void write(const std::function<void(class Writer&)>& rows);
  /// Moves everything from the write-ahead log into the one file.
  void close();

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
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
  [[nodiscard]] const std::filesystem::path& file() const;
  /// The file that is read: a copy if this user cannot write the store.
  [[nodiscard]] std::filesystem::path opened() const;
  ~StoreReader();
  StoreReader(const StoreReader&) = delete;
  StoreReader& operator=(const StoreReader&) = delete;

  /// Result of one statement that starts with SELECT, WITH, VALUES or EXPLAIN. Throws Error(usage)
  /// for any other statement or for several, and Error(bad_input) if the store lacks the tables and
  /// views of this program.
  [[nodiscard]] Table query(const std::string& sql, const Cells& parameters = {}) const;

  /// The same as tuples, e.g. rows<std::string, double>(...).
  template <class... Types>
  [[nodiscard]] std::vector<std::tuple<Types...>> rows(const std::string& sql,
                                                       const Cells& parameters = {}) const {
    return typed<Types...>(cells(sql, parameters));
  }

  /// The same for a statement written by a person: if the store refuses it, throws Error(usage).
  [[nodiscard]] Table answer(const std::string& sql) const;

  /// Hashes the rows with these keys in a table (for comparisons and runs including everything
  /// they state) and throws Error(bad_input) if one differs from its manifest. Nothing is
  /// recomputed.
  void require_as_written(const std::string& table, const std::set<std::string>& keys) const;
  void require_as_written(const Printed& printed) const;
  /// The same for whole tables.
  void require_as_written(const std::vector<std::string>& tables) const;

  /// Content by its hash (SHA-256); nullopt if the store does not have it.
  [[nodiscard]] std::optional<std::string> blob(const std::string& sha256) const;
  /// Paths of the content when it was stored.
  [[nodiscard]] std::vector<std::filesystem::path> places_of(const std::string& sha256) const;

  [[nodiscard]] SQLite::Database& database() const;
  [[nodiscard]] bool is_of_older_version() const;

 private:
  /// Makes the error for a refused statement, from what the store reports and what to do.
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
