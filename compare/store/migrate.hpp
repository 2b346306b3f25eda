// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace SQLite {
class Database;
}

namespace drape::compare {

/// Brings the store at `file`, of an older version, to store_version() in `database`, in one
/// transaction: afterwards it is either untouched or complete. Foreign keys must be off. Nothing is
/// lost: values that the older version did not have are NULL, and the copies of sheets beside the
/// file become blobs. Throws Error(bad_input) where a row is not what the older version's ledger
/// says; with `lost` such rows go there instead and into no manifest.
void migrate(SQLite::Database& database, int from_version, const std::filesystem::path& file,
             std::vector<std::string>* lost = nullptr);

/// Version of the store in the file; 0 for a file that is still empty. The caller holds a
/// transaction where others may write. Throws Error(bad_input) for a foreign file and for a newer
/// version.
[[nodiscard]] int version_of(SQLite::Database& database, const std::filesystem::path& file);

/// Makes an empty store: tables, views, and the metric dictionary in the first manifest.
void create_store(SQLite::Database& database);

}  // namespace drape::compare
