// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace SQLite {
class Database;
}

namespace drape::compare {

/// Brings a store of an older version to store_version(), in one transaction: afterwards it is
/// either untouched or complete. Foreign keys must be off. Nothing is lost: values that the older
/// version did not have are NULL.
void migrate(SQLite::Database& database, int from_version);

/// Makes an empty store: tables, views, the metric dictionary and its ledger entries.
void create_store(SQLite::Database& database);

}  // namespace drape::compare
