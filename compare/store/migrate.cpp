// SPDX-License-Identifier: Apache-2.0
#include "compare/store/migrate.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <string_view>

#include "compare/schema/schema.hpp"
#include "compare/store/ledger.hpp"
#include "compare/store/store.hpp"
#include "core/error.hpp"

namespace drape::compare {
namespace {

/// Tables of version 1, children before parents.
constexpr const char* kTablesOf1[] = {
    "mark_error", "simulation_pair",    "comparison",  "simulation", "gap",   "sheet",
    "fabric",     "calibration_camera", "calibration", "rig",        "metric"};

constexpr const char* kCopyFrom1[] = {
    "INSERT INTO rig SELECT name FROM v1_rig",
    "INSERT INTO calibration SELECT sha256, rig_name FROM v1_calibration",
    "INSERT INTO calibration_file SELECT sha256, method FROM v1_calibration WHERE method IS NOT "
    "NULL",
    "INSERT INTO calibration_camera SELECT * FROM v1_calibration_camera",
    "INSERT INTO fabric SELECT sha256, name FROM v1_fabric",
    "INSERT INTO sheet SELECT sha256, kind, rows, cols, patch_warp_mm, patch_weft_mm, marks, gaps, "
    "rig_name, set_name, calibration_sha256, detections_sha256, NULL, sigma_median_mm, "
    "sigma_max_mm FROM v1_sheet",
    "INSERT INTO gap SELECT * FROM v1_gap",
    "INSERT INTO simulation SELECT sheet_sha256, 'drapebench', scene, scene_sha256, fabric_sha256, "
    "NULL, start_sha256, grid_rows, grid_cols, segments, model, solver, status, at_rest, "
    "certificate_sha256, certificate_json FROM v1_simulation",
    "INSERT INTO comparison (sha256, measured_sha256, simulated_sha256, metrics_version, marks, "
    "excluded, mean_mm, sigma_mean_mm, median_mm, rms_mm, p95_mm, max_mm, worst_row, worst_col, "
    "mean_percent_of_warp_side, mean_percent_of_weft_side) SELECT * FROM v1_comparison ORDER BY "
    "sha256",
    "INSERT INTO mark_error SELECT c.id, \"row\", \"col\", material_warp_mm, material_weft_mm, "
    "real_x_mm, real_y_mm, real_z_mm, virtual_x_mm, virtual_y_mm, virtual_z_mm, distance_mm, "
    "along_warp_mm, along_weft_mm, along_normal_mm, sigma_mark_mm, sigma_distance_mm, views FROM "
    "v1_mark_error AS e JOIN comparison AS c ON c.sha256 = e.comparison_sha256",
    "INSERT INTO simulation_pair SELECT *, NULL, NULL, NULL, NULL FROM v1_simulation_pair",
};

void drop_views_and_indexes(SQLite::Database& database) {
  std::vector<std::string> statements;
  SQLite::Statement query(database,
                          "SELECT type, name FROM sqlite_master WHERE type IN ('view', 'index', "
                          "'trigger') AND sql IS NOT NULL");
  while (query.executeStep()) {
    statements.push_back(fmt::format("DROP {} \"{}\"", query.getColumn(0).getString(),
                                     query.getColumn(1).getString()));
  }
  query.reset();
  for (const std::string& statement : statements) database.exec(statement);
}

void run(SQLite::Database& database, const std::vector<std::string>& statements) {
  for (const std::string& statement : statements) database.exec(statement);
}

/// Version 1 had other columns in most tables, and no ledger.
void from_1(SQLite::Database& database) {
  for (const char* table : kTablesOf1)
    database.exec(fmt::format("ALTER TABLE {0} RENAME TO v1_{0}", table));
  run(database, table_statements());
  for (const char* statement : kCopyFrom1) database.exec(statement);
  for (const char* table : kTablesOf1) database.exec(fmt::format("DROP TABLE v1_{}", table));
}

/// Version 2 lacked surface_comparison, version 3 the tables of branches, version 5 those of
/// acceptance and of what a match rests on, version 6 refinement, version 7 run_repetition; every
/// table they had is as it was.
void add_absent_tables(SQLite::Database& database) {
  for (const std::string& statement : table_statements()) {
    const std::size_t begin = std::string_view("CREATE TABLE ").size();
    const std::string name = statement.substr(begin, statement.find(' ', begin) - begin);
    if (!database.tableExists(name)) database.exec(statement);
  }
}

}  // namespace

void create_store(SQLite::Database& database) {
  database.exec(fmt::format("PRAGMA application_id = {}", kApplicationId));
  database.exec(fmt::format("PRAGMA user_version = {}", kStoreVersion));
  run(database, table_statements());
  run(database, surrounding_statements());
  LedgerWriter(database).append_missing();
}

void migrate(SQLite::Database& database, int from_version) {
  SQLite::Transaction transaction(database, SQLite::TransactionBehavior::EXCLUSIVE);
  // Another program may have been faster.
  if (database.execAndGet("PRAGMA user_version").getInt() != from_version) return;
  if (from_version < 1 || from_version >= kStoreVersion)
    throw internal_error(fmt::format("there is no migration from store version {}", from_version));
  drop_views_and_indexes(database);
  from_version == 1 ? from_1(database) : add_absent_tables(database);
  run(database, surrounding_statements());
  LedgerWriter(database).append_missing();
  database.exec(fmt::format("PRAGMA user_version = {}", kStoreVersion));
  transaction.commit();
}

}  // namespace drape::compare
