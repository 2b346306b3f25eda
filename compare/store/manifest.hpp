// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/store/listed.hpp"

namespace drape::compare {

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
[[nodiscard]] std::vector<Manifest> manifests_of(SQLite::Database& database);
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

}  // namespace drape::compare
