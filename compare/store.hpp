// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compare/compare.hpp"
#include "compare/tables.hpp"
#include "core/calibration.hpp"

namespace drape::compare {

inline constexpr int kStoreVersion = 1;            ///< PRAGMA user_version
inline constexpr int kApplicationId = 0x44726170;  ///< "Drap", so that `file` can tell
inline constexpr int kMetricsVersion = 1;          ///< raised when a metric's definition changes

/// What an import did.
struct ImportCounts {
  int added = 0;    ///< comparisons that are new in the store
  int present = 0;  ///< comparisons it had already
};

/// results.sqlite, opened for writing. Rows are keyed by content hashes and carry no clock time, so
/// importing the same comparison again adds nothing and two undisturbed histories are the same
/// bytes. Each comparison is one durable transaction (WAL, synchronous FULL): killing the program
/// at any moment loses no comparison that was acknowledged and leaves none in half.
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
  /// All comparisons of one drape.
  ImportCounts add(const DrapeInput& input, const Report& report);
  /// Moves everything from the write-ahead log into the one file.
  void close();

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

/// results.sqlite, opened for questions only; nothing done through it changes the store.
class StoreReader {
 public:
  explicit StoreReader(const std::filesystem::path& file);
  ~StoreReader();
  StoreReader(const StoreReader&) = delete;
  StoreReader& operator=(const StoreReader&) = delete;

  /// Result of one statement that starts with SELECT, WITH, VALUES or EXPLAIN, with its parameters
  /// `?` bound as text. Throws Error(usage) for any other statement or for several.
  [[nodiscard]] Table query(const std::string& sql,
                            const std::vector<std::string>& parameters = {}) const;

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

/// Key of a comparison: hash of the sheets' hashes and the version of the metrics.
[[nodiscard]] std::string comparison_key(const std::vector<std::string>& sheet_hashes);

/// The statements that make an empty store.
[[nodiscard]] std::vector<std::string> schema_statements();

}  // namespace drape::compare
