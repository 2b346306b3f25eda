// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace SQLite {
class Database;
}

namespace drape::compare {

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
