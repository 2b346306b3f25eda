// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace SQLite {
class Database;
}

namespace drape::compare {

/// Brings a store of an older version to store_version(), in one transaction: afterwards it is
/// either untouched or complete. Foreign keys must be off. Nothing is lost: values that the older
/// version did not have are NULL.
void migrate(SQLite::Database& database, int from_version);

/// Version of the store in the file; 0 for a file that is still empty. The caller holds a
/// transaction where others may write. Throws Error(bad_input) for a foreign file and for a newer
/// version.
[[nodiscard]] int version_of(SQLite::Database& database, const std::filesystem::path& file);

/// Makes an empty store: tables, views, the metric dictionary and its ledger entries.
void create_store(SQLite::Database& database);

}  // namespace drape::compare
