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

/// Proof of one addition to the store: it lists the rows added by their hashes and names the
/// manifest before it by its own, so the last one stands for all. Who can write the file can
/// compute all of them again: a signature of the last one alone shows that nobody did.
struct Manifest {
  std::int64_t number = 0;
  std::string previous_sha256;  ///< empty: the first
  std::int64_t last = 0;        ///< sequence of the last row that it lists
  std::int64_t file_size = 0;   ///< bytes of the store with it
  std::string sha256;
};
[[nodiscard]] std::vector<Manifest> manifests_of(SQLite::Database& database);
/// The last one; its number is 0 where there is none.
[[nodiscard]] Manifest last_manifest(SQLite::Database& database);

using ListedKey = std::pair<const ListedTable*, std::string>;
/// Lists rows in a new manifest, hashed as they stand in the store now. A key that is listed
/// already must have its hash. Nothing is written where nothing is new. Inside a write transaction.
/// Throws Error(bad_input).
void write_manifest(SQLite::Database& database, const std::vector<ListedKey>& added);

/// Hash of a manifest, from its numbers and the rows listed.
[[nodiscard]] std::string hash_of(SQLite::Database& database, const Manifest& manifest,
                                  std::int64_t last_before);

/// Sentences about tables, views, indexes and triggers that are not those of this version.
[[nodiscard]] std::vector<std::string> schema_findings(SQLite::Database& database);

/// Sentence about a file whose size is not what its last manifest says; empty: it is, or a
/// write-ahead log beside it holds a part.
[[nodiscard]] std::string size_finding(SQLite::Database& database,
                                       const std::filesystem::path& file);

/// Adds content under its hash, packed by zlib; false where it is there.
bool add_blob(SQLite::Database& database, const std::string& sha256, std::string_view content);
/// The content of that hash; nothing where the store lacks it or has other bytes in its place.
/// `indexed` as of RowReader.
[[nodiscard]] std::optional<std::string> blob_in(SQLite::Database& database,
                                                 const std::string& sha256, bool indexed = true);

}  // namespace drape::compare
