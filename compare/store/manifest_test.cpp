// SPDX-License-Identifier: Apache-2.0
// Long-term guarantees of the store: nothing changes, nothing is lost, old stores open.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <iostream>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;
using units::mm;

using test::one;

void import_height(const fs::path& file, double height_m) {
  const test::Shape raised = test::raised(height_m);
  test::add_drape(file, test::measured_sheet(),
                  {test::simulated_sheet(11, 1, raised), test::simulated_sheet(11, 5, raised)});
}

TEST(Manifests, ListEveryRow) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  import_height(file, 5 * mm);
  const StoreReader reader(file);
  EXPECT_THAT(altered_rows(reader), IsEmpty());
  EXPECT_EQ(one(reader, "SELECT count(*) FROM listed WHERE kind = 'comparison'"), "2");
  EXPECT_EQ(one(reader, "SELECT count(*) FROM listed WHERE kind = 'metric'"),
            one(reader, "SELECT count(*) FROM metric"));
  EXPECT_EQ(one(reader, "SELECT count(*) FROM manifest"), "2");
  EXPECT_EQ(one(reader, "SELECT file_size FROM manifest WHERE number = 2"),
            std::to_string(fs::file_size(file)));
}

TEST(Manifests, RowsCannotBeChangedOrRemovedByAccident) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  import_height(file, 5 * mm);
  SQLite::Database database(file.string(), SQLite::OPEN_READWRITE);
  // A trigger needs a row to fire; this example has no gap of its own.
  database.exec("SAVEPOINT with_gap");
  database.exec("INSERT INTO gap SELECT sha256, 0, 0, 'hidden' FROM sheet LIMIT 1");
  for (const char* sql :
       {"UPDATE comparison SET mean_mm = 1", "DELETE FROM mark_error", "DELETE FROM listed",
        "UPDATE metric SET unit = 'm'", "UPDATE sheet SET gaps = 0", "DELETE FROM gap"}) {
    EXPECT_THROW(database.exec(sql), SQLite::Exception) << sql;
  }
  database.exec("ROLLBACK TO with_gap");
  database.exec("RELEASE with_gap");
  EXPECT_THAT(altered_rows(StoreReader(file)), IsEmpty());
}

TEST(Manifests, FindsEveryChangeMadeAroundTheTriggers) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite", copy = folder.path() / "copy.sqlite";
  import_height(file, 5 * mm);
  for (const std::string sql :
       {"UPDATE mark_error SET distance_mm = distance_mm + 1e-9 WHERE \"row\" = 3 AND \"col\" = 4",
        "DELETE FROM mark_error WHERE \"row\" = 10 AND \"col\" = 10 AND comparison_id = 1",
        "UPDATE comparison SET sigma_mean_mm = NULL WHERE id = 2",
        "UPDATE metric SET definition = definition || '.' WHERE name = 'mean_mm'",
        "INSERT INTO rig VALUES ('another')",
        "INSERT INTO gap SELECT sha256, 1, 1, 'invented' FROM sheet WHERE kind = 'measured'",
        "DELETE FROM listed WHERE sequence = 4",
        "UPDATE listed SET sha256 = (SELECT sha256 FROM manifest) WHERE sequence = 4",
        "UPDATE manifest SET file_size = file_size + 1 WHERE number = 1",
        "DELETE FROM manifest WHERE number = 2",
        "PRAGMA foreign_keys = OFF; UPDATE comparison SET id = 3 - id + 10; UPDATE mark_error SET "
        "comparison_id = 13 - comparison_id",
        "UPDATE simulation SET segments = 7 WHERE segments = 5",
        "DELETE FROM comparison WHERE id = 2"}) {
    fs::copy_file(file, copy, fs::copy_options::overwrite_existing);
    {
      SQLite::Database database(copy.string(), SQLite::OPEN_READWRITE);
      std::vector<std::string> drops;
      SQLite::Statement triggers(database, "SELECT name FROM sqlite_master WHERE type = 'trigger'");
      while (triggers.executeStep()) drops.push_back(triggers.getColumn(0).getString());
      triggers.reset();
      for (const std::string& name : drops) database.exec("DROP TRIGGER " + name);
      database.exec(sql);
    }
    EXPECT_FALSE(altered_rows(StoreReader(copy, StoreReader::Schema::any)).empty()) << sql;
  }
}

TEST(Manifests, EightWritersAtOnceLoseNothing) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  constexpr int kWriters = 8, kDrapes = 3;
  std::vector<pid_t> children;
  for (int writer = 0; writer < kWriters; ++writer) {
    const pid_t child = fork();
    if (child == 0) {
      try {
        for (int i = 0; i < kDrapes; ++i) import_height(file, (1 + writer * kDrapes + i) * mm);
      } catch (const std::exception& error) {
        std::cerr << "writer " << writer << ": " << error.what() << std::endl;
        _exit(1);
      }
      _exit(0);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
  const StoreReader reader(file);
  EXPECT_EQ(one(reader, "SELECT count(*) FROM comparison"), std::to_string(2 * kWriters * kDrapes));
  EXPECT_EQ(one(reader, "SELECT count(*) FROM mark_error"),
            std::to_string(121 * 2 * kWriters * kDrapes));
  EXPECT_EQ(one(reader, "SELECT count(DISTINCT round(mean_mm)) FROM comparison"),
            std::to_string(kWriters * kDrapes));
  EXPECT_THAT(altered_rows(reader), IsEmpty());
}

/// A store as drapebench wrote it: version 1 before there was a ledger, version 2 before surfaces
/// without marks were kept, version 3 before branches were, version 4 (drapebench 0.1.0, bench1)
/// before runs were, version 5 (drapebench 0.2.0, bench1's C) before what a match rests on was,
/// version 8 before meshes were, version 10 before manifests were.
void make_version(int version, const fs::path& file) {
  fs::copy_file(drape::test::source_root() /
                    ("compare/test_data/store_v" + std::to_string(version) + ".sqlite"),
                file);
}

void make_version_1(const fs::path& file) {
  make_version(1, file);
}

TEST(Migration, AReaderUnderstandsVersion1AndLeavesItAsItIs) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "old.sqlite";
  make_version_1(file);
  const std::string before = sha256_of_file(file);
  const StoreReader reader(file);
  const Table list = list_results(reader, {});
  ASSERT_EQ(list.rows.size(), 2U);
  EXPECT_EQ(one(reader, "SELECT count(*) FROM mark_error"), "156");
  EXPECT_EQ(sha256_of_file(file), before);
}

TEST(Migration, Version1KeepsEveryNumber) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "old.sqlite";
  make_version_1(file);
  const auto numbers = [&](const std::string& table, const std::string& columns) {
    SQLite::Database database(file.string());
    SQLite::Statement query(database, "SELECT " + columns + " FROM " + table + " ORDER BY 1, 2, 3");
    std::string text;
    while (query.executeStep())
      for (int i = 0; i < query.getColumnCount(); ++i) text += query.getColumn(i).getString() + "|";
    return text;
  };
  const std::string comparison_columns =
      "sha256, measured_sha256, simulated_sha256, metrics_version, marks, excluded, mean_mm, "
      "sigma_mean_mm, median_mm, rms_mm, p95_mm, max_mm, worst_row, worst_col";
  const std::string mark_columns =
      "distance_mm, \"row\", \"col\", real_x_mm, virtual_z_mm, along_normal_mm, sigma_mark_mm, "
      "views";
  const std::string comparisons = numbers("comparison", comparison_columns);
  const std::string marks = numbers("mark_error", mark_columns);
  const std::string cameras = numbers("calibration_camera", "*");
  const std::string pairs = numbers("simulation_pair", "sha256, label, mean_mm, max_mm");
  const std::string gaps = numbers("gap", "*");
  Store(file).close();
  EXPECT_EQ(numbers("comparison", comparison_columns), comparisons);
  EXPECT_EQ(numbers("mark_error", mark_columns), marks);
  EXPECT_EQ(numbers("calibration_camera", "*"), cameras);
  EXPECT_EQ(numbers("simulation_pair", "sha256, label, mean_mm, max_mm"), pairs);
  EXPECT_EQ(numbers("gap", "*"), gaps);
  const StoreReader reader(file);
  EXPECT_EQ(one(reader, "SELECT user_version FROM pragma_user_version"),
            std::to_string(store_version()));
  EXPECT_EQ(one(reader, "SELECT count(*) FROM comparison WHERE mean_low_mm IS NOT NULL"), "0")
      << "what version 1 did not have is not invented";
  EXPECT_EQ(one(reader, "SELECT count(*) FROM sqlite_master WHERE name LIKE 'v1_%'"), "0");
  EXPECT_THAT(altered_rows(reader), IsEmpty());
}

/// The columns of every table of a store.
using Columns = std::vector<std::pair<std::string, std::string>>;
Columns columns_of(const fs::path& file) {
  SQLite::Database database(file.string());
  SQLite::Statement query(database,
                          "SELECT t.name, group_concat('\"' || c.name || '\"', ', ') FROM "
                          "sqlite_master AS t, pragma_table_info(t.name) AS c WHERE t.type = "
                          "'table' AND t.name NOT IN ('ledger', 'metric') GROUP BY t.name");
  Columns columns;
  while (query.executeStep())
    columns.emplace_back(query.getColumn(0).getString(), query.getColumn(1).getString());
  return columns;
}

/// Every row of these columns.
std::string rows_of(const fs::path& file, const Columns& columns) {
  SQLite::Database database(file.string());
  std::string text;
  for (const auto& [table, names] : columns) {
    SQLite::Statement query(database, "SELECT " + names + " FROM " + table);
    while (query.executeStep()) {
      for (int i = 0; i < query.getColumnCount(); ++i) text += query.getColumn(i).getString() + "|";
      text += '\n';
    }
  }
  return text;
}

class KeptVersion : public testing::TestWithParam<int> {};

TEST_P(KeptVersion, KeepsEveryRow) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "old.sqlite";
  make_version(GetParam(), file);
  const Columns columns = columns_of(file);
  const std::string before = rows_of(file, columns);
  ASSERT_GT(before.size(), 10000U);
  const std::map<int, std::size_t> comparisons = {{2, 3}, {3, 3}, {4, 6}, {5, 1}, {8, 4}, {10, 1}};
  EXPECT_EQ(list_results(StoreReader(file), {}).rows.size(), comparisons.at(GetParam()))
      << "a reader needs no migration";
  Store(file).close();
  EXPECT_EQ(rows_of(file, columns), before);
  const StoreReader reader(file);
  EXPECT_THAT(altered_rows(reader), IsEmpty());
  EXPECT_EQ(one(reader, "SELECT count(*) FROM v_comparison WHERE simulator = 'Blender 3.4'"),
            GetParam() < 4 ? "1" : "0");
}

TEST(Migration, RunsOfVersion5StayAndSayNothingOfWhatTheirMatchRestsOn) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "old.sqlite";
  make_version(5, file);
  const auto runs = [&] { return StoreReader(file).query("SELECT * FROM run_drape").rows; };
  const auto before = runs();
  ASSERT_EQ(before.size(), 1U);
  Store(file).close();
  EXPECT_EQ(runs(), before);
  const StoreReader reader(file);
  EXPECT_EQ(one(reader, "SELECT count(*) FROM run_match"), "0");
  EXPECT_EQ(one(reader, "SELECT match_rests_on FROM v_run_drape"), "");
  EXPECT_EQ(list_runs(reader, {}).rows.size(), 1U);
}

TEST(Migration, GridsOfVersion8StayGridsWithTheirModelSolverAndOrigin) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "old.sqlite";
  make_version(8, file);
  Store(file).close();
  const StoreReader reader(file);
  const char* simulations =
      "SELECT discretisation, segments, model, solver, status, begins, spacing_mm FROM "
      "v_comparison ORDER BY model, segments";
  const std::string grid = "11x11", rest = "at rest";
  EXPECT_EQ(reader.query(simulations).rows,
            (std::vector<std::vector<std::string>>{
                {grid, "1", "consistent", "static", rest, "scene", ""},
                {grid, "3", "consistent", "fall", rest, "scene", ""},
                {grid, "5", "consistent", "static", rest, "scene", ""},
                {grid, "5", "paper", "rk4", "kinetic energy still 3 uJ", "scene", ""}}));
  EXPECT_EQ(one(reader, "SELECT count(*) FROM v_table5"), "4");
  EXPECT_EQ(one(reader,
                "SELECT s.segments FROM refinement AS r JOIN simulation AS s USING (sheet_sha256) "
                "WHERE r.rest_sha256 LIKE 'ef95c136d9dc%'"),
            "3");
  const std::string refined = one(reader, "SELECT comparison FROM v_comparison WHERE segments = 3");
  const auto facts = show_result(reader, refined).tables[1].rows;
  EXPECT_THAT(facts, testing::Contains(testing::ElementsAre("refined_from_sha256",
                                                            testing::StartsWith("ef95c136d9dc"))));
}

TEST_P(KeptVersion, IsVerifiedByItsLedgerAndAnAlteredOneIsNotMigrated) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "old.sqlite", copy = folder.path() / "copy.sqlite";
  make_version(GetParam(), file);
  EXPECT_THAT(verify_store(file, false).findings, IsEmpty());
  for (const char* sql :
       {"INSERT INTO rig VALUES ('invented')", "UPDATE comparison SET mean_mm = mean_mm * 0.1",
        "DELETE FROM mark_error WHERE \"row\" = 3", "DELETE FROM ledger WHERE sequence > 60",
        "CREATE TABLE stranger (x)"}) {
    SCOPED_TRACE(sql);
    fs::copy_file(file, copy, fs::copy_options::overwrite_existing);
    {
      SQLite::Database database(copy.string(), SQLite::OPEN_READWRITE);
      SQLite::Statement triggers(database, "SELECT name FROM sqlite_master WHERE type = 'trigger'");
      std::vector<std::string> names;
      while (triggers.executeStep()) names.push_back(triggers.getColumn(0).getString());
      triggers.reset();
      for (const std::string& name : names) database.exec("DROP TRIGGER " + name);
      database.exec(sql);
      (void)database.execAndGet("PRAGMA journal_mode = WAL");
    }
    const std::string before = sha256_of_file(copy);
    EXPECT_FALSE(verify_store(copy, false).findings.empty());
    EXPECT_THROW(import_height(copy, 5 * mm), Error);
    EXPECT_EQ(sha256_of_file(copy), before) << "nothing is added";
  }
}

TEST(Migration, CopiesOfSheetsBesideAnOldStoreBecomeBlobs) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "old.sqlite",
                 data = drape::test::source_root() / "compare/test_data";
  make_version(10, file);
  fs::copy(data / "store_v10.sqlite.files", file.string() + ".files", fs::copy_options::recursive);
  EXPECT_THAT(verify_store(file).findings, IsEmpty()) << "before it is migrated";
  Store(file).close();
  fs::remove_all(file.string() + ".files");
  const Verification result = verify_store(file);
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_EQ(result.comparisons, 2);
}

INSTANTIATE_TEST_SUITE_P(Migration, KeptVersion, testing::Values(2, 3, 4, 5, 8, 10));

TEST(Migration, AMigratedStoreHasTheSchemaOfANewOneAndGrows) {
  const drape::test::TemporaryFolder folder;
  const fs::path new_file = folder.path() / "new.sqlite";
  Store(new_file).close();
  const char* schema =
      "SELECT type, name, sql FROM sqlite_master WHERE sql IS NOT NULL ORDER BY 1, 2";
  for (const int version : {1, 2, 3, 4, 5, 8, 10}) {
    const fs::path old_file = folder.path() / ("old" + std::to_string(version) + ".sqlite");
    make_version(version, old_file);
    const auto had = list_results(StoreReader(old_file), {}).rows.size();
    Store(old_file).close();
    EXPECT_EQ(StoreReader(old_file).query(schema).rows, StoreReader(new_file).query(schema).rows);
    import_height(old_file, 5 * mm);
    const StoreReader reader(old_file);
    EXPECT_EQ(list_results(reader, {}).rows.size(), had + 2);
    EXPECT_EQ(one(reader, "SELECT count(*) FROM metric"),
              one(StoreReader(new_file), "SELECT count(*) FROM metric"));
    EXPECT_THAT(altered_rows(reader), IsEmpty());
  }
}

}  // namespace
}  // namespace drape::compare
