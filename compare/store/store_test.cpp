// SPDX-License-Identifier: Apache-2.0

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using units::mm;

struct StoreExample {
  DrapeInput input;
  Report report;
};

StoreExample example(double height_m = 5 * mm) {
  const test::Shape raised = test::raised(height_m);
  Sheet measured = test::measured_sheet();
  measured.gaps.push_back({measured.marks.back().mark, "seen by one camera only"});
  measured.marks.pop_back();
  StoreExample made;
  made.input = test::drape_of(
      measured, {test::simulated_sheet(11, 1, raised), test::simulated_sheet(11, 5, raised),
                 test::simulated_sheet(21, 1, raised), test::simulated_sheet(21, 5)});
  made.report = compare_drape(made.input, {});
  return made;
}

ImportCounts import_into(const fs::path& file, const StoreExample& made) {
  Store store(file);
  const ImportCounts counts = test::add(store, made.input, made.report);
  store.close();
  return counts;
}

std::string content(const fs::path& file) {
  return dump_sql(StoreReader(file));
}

std::string refusal_by_store(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
    return error.what();
  }
  return "nothing was refused";
}

TEST(Store, KeepsWhatWasCompared) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "new" / "results.sqlite";
  const StoreExample made = example();
  EXPECT_EQ(import_into(file, made).added, 8);
  const StoreReader reader(file);
  const Table rows =
      reader.query("SELECT discretisation, segments, mean_dist_mm, marks FROM v_table1");
  ASSERT_EQ(rows.rows.size(), 4U);
  EXPECT_EQ(rows.rows[0][0], "21x21");
  EXPECT_EQ(rows.rows[0][1], "5");
  EXPECT_NEAR(std::stod(rows.rows[1][2]), 5, 1e-9);
  EXPECT_EQ(rows.rows[1][3], "120");
  EXPECT_EQ(reader.query("SELECT count(*) FROM mark_error").rows[0][0], "480");
  EXPECT_EQ(reader.query("SELECT reason FROM gap").rows[0][0], "seen by one camera only");
  EXPECT_EQ(reader.query("SELECT count(*) FROM v_table2").rows[0][0], "4");
  EXPECT_EQ(reader.query("SELECT count(*) FROM pragma_foreign_key_check()").rows[0][0], "0");
}

TEST(Store, EveryColumnIsTypedAndEveryMetricDefined) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  import_into(file, example());
  const StoreReader reader(file);
  EXPECT_EQ(reader
                .query("SELECT count(*) FROM pragma_table_list WHERE schema = 'main' AND type = "
                       "'table' AND name NOT LIKE 'sqlite_%' AND NOT strict")
                .rows[0][0],
            "0");
  const Table undefined = reader.query(
      "SELECT name FROM pragma_table_info('comparison') WHERE type = 'REAL' AND name NOT IN "
      "(SELECT name FROM metric)");
  EXPECT_TRUE(undefined.rows.empty()) << undefined.rows[0][0];
}

TEST(Store, SaysTheSpacingOfAMeshAndTheSizeOfAGrid) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  Sheet from_measured = test::mesh_sheet(2.5 * mm, 5, test::raised(3 * mm));
  std::get<SimulatedSource>(from_measured.source).from_measured = true;
  Sheet paper = test::simulated_sheet(21, 5);
  auto& source = std::get<SimulatedSource>(paper.source);
  source.model = "paper";
  source.solver.clear();
  test::add_drape(file, test::measured_sheet(),
                  {from_measured, paper, test::mesh_sheet(2.5 * mm, 5, test::raised(1 * mm)),
                   test::mesh_sheet(10 * mm, 5, test::raised(2 * mm))});
  const StoreReader reader(file);
  const Table rows = reader.query(
      "SELECT discretisation, begins, grid_rows, spacing_mm, model, solver, state FROM "
      "v_real_vs_virtual");
  const std::vector<std::vector<std::string>> expected = {
      {"2.5 mm", "scene", "", "2.5", "triangles", "", ""},
      {"2.5 mm", "measured shape", "", "2.5", "triangles", "", ""},
      {"10 mm", "scene", "", "10", "triangles", "", ""},
      {"21x21", "scene", "21", "", "paper", "", ""}};
  EXPECT_EQ(rows.rows, expected) << "fine before coarse, meshes before grids";
  const Table paper_rows = reader.query("SELECT discretisation, model FROM v_table1");
  EXPECT_EQ(paper_rows.rows, (std::vector<std::vector<std::string>>{{"21x21", "paper"}}));
  EXPECT_EQ(list_results(reader, {.spacing_m = 10 * mm}).rows.size(), 1U);
  EXPECT_EQ(list_results(reader, {.grid = "21"}).rows.size(), 1U);
  EXPECT_THROW((void)list_results(reader, {.spacing_m = 5 * mm}), Error);
  EXPECT_THAT(altered_rows(reader), testing::IsEmpty());
}

TEST(Store, ImportingAgainAddsNothingAndChangesNoByte) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  import_into(file, example());
  const std::string before = sha256_of_file(file);
  const ImportCounts counts = import_into(file, example());
  EXPECT_EQ(counts.added, 0);
  EXPECT_EQ(counts.present, 8);
  EXPECT_EQ(sha256_of_file(file), before);
  EXPECT_FALSE(fs::exists(file.string() + "-wal"));
}

TEST(Store, TwoUndisturbedRunsGiveTheSameBytes) {
  const drape::test::TemporaryFolder folder;
  for (const char* name : {"one.sqlite", "two.sqlite"}) {
    import_into(folder.path() / name, example(5 * mm));
    import_into(folder.path() / name, example(6 * mm));
  }
  EXPECT_EQ(sha256_of_file(folder.path() / "one.sqlite"),
            sha256_of_file(folder.path() / "two.sqlite"));
}

TEST(Store, ExportedSqlMakesItAgain) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite", copy = folder.path() / "copy.sqlite";
  import_into(file, example());
  SQLite::Database(copy.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec(content(file));
  EXPECT_EQ(content(copy), content(file));
}

TEST(Store, RefusesANewerStore) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  import_into(file, example());
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("PRAGMA user_version = " + std::to_string(store_version() + 1));
  const std::string said = "version " + std::to_string(store_version() + 1);
  const std::string before = sha256_of_file(file);
  EXPECT_THAT(refusal_by_store([&] { Store store(file); }), HasSubstr(said));
  EXPECT_THAT(refusal_by_store([&] { StoreReader store(file); }), HasSubstr(said));
  EXPECT_EQ(sha256_of_file(file), before);
}

TEST(Store, RefusesFilesThatAreNotOurs) {
  const drape::test::TemporaryFolder folder;
  const fs::path text = folder.path() / "notes.txt", foreign = folder.path() / "other.sqlite";
  write_durable(text, std::string(5000, 'x'));
  SQLite::Database(foreign.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE)
      .exec("CREATE TABLE photos (name TEXT)");
  for (const fs::path& file : {text, foreign}) {
    const std::string before = sha256_of_file(file);
    EXPECT_THAT(refusal_by_store([&] { Store store(file); }), HasSubstr(file.string()));
    EXPECT_THAT(refusal_by_store([&] { StoreReader store(file); }), HasSubstr(file.string()));
    EXPECT_EQ(sha256_of_file(file), before);
  }
  EXPECT_THAT(refusal_by_store([&] { StoreReader store(folder.path() / "none.sqlite"); }),
              HasSubstr("no results store"));
  EXPECT_FALSE(fs::exists(folder.path() / "none.sqlite"));
}

TEST(Store, AnEmptyFileLeftByAKilledCreationIsUsed) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  std::ofstream(file).flush();
  EXPECT_EQ(import_into(file, example()).added, 8);
}

TEST(Store, AnUnwritablePlaceIsOneClearError) {
  const drape::test::TemporaryFolder folder;
  write_durable(folder.path() / "file", "x");
  EXPECT_THAT(refusal_by_store([&] { Store store(folder.path() / "file" / "results.sqlite"); }),
              HasSubstr("results.sqlite"));
  fs::create_directories(folder.path() / "directory.sqlite");
  EXPECT_THAT(refusal_by_store([&] { Store store(folder.path() / "directory.sqlite"); }),
              HasSubstr("directory.sqlite"));
}

/// Runs `action` in a child process; its exit code, or minus the signal that ended it.
int in_child(const std::function<void()>& action) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      action();
    } catch (const Error& error) {
      _exit(static_cast<int>(error.kind()));
    } catch (...) {
      _exit(99);
    }
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST(Store, AFullDiskIsAnErrorAndLosesNothing) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  import_into(file, example(5 * mm));
  const std::string before = content(file);
  const int code = in_child([&] {
    std::signal(SIGXFSZ, SIG_IGN);  // makes the write fail instead of ending the process
    const rlimit limit{20000, 20000};
    setrlimit(RLIMIT_FSIZE, &limit);
    import_into(file, example(6 * mm));
  });
  EXPECT_EQ(code, static_cast<int>(ErrorKind::bad_input));
  EXPECT_EQ(content(file), before);
  EXPECT_EQ(import_into(file, example(6 * mm)).added, 7) << "21x21 with 5 segments is the same";
}

TEST(Store, AWriteProtectedStoreIsAnErrorAndStaysReadable) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  import_into(file, example(5 * mm));
  const std::string before = content(file);
  fs::permissions(file, fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read);
  fs::permissions(folder.path(), fs::perms::owner_all | fs::perms::group_read |
                                     fs::perms::group_exec | fs::perms::others_read |
                                     fs::perms::others_exec);
  const auto as_nobody = [] {
    if (geteuid() == 0 && setuid(65534) != 0) _exit(98);  // root can write anything
  };
  EXPECT_EQ(in_child([&] {
              as_nobody();
              import_into(file, example(6 * mm));
            }),
            static_cast<int>(ErrorKind::bad_input));
  EXPECT_EQ(in_child([&] {
              as_nobody();
              if (content(file) != before) _exit(97);
            }),
            0);
  fs::permissions(file, fs::perms::owner_all);
  EXPECT_EQ(content(file), before);
}

int writes = 0;         ///< made by SQLite in this process
int killing_write = 0;  ///< write during which this process ends; 0 if none

ssize_t counted_write(int file, const void* bytes, std::size_t size, off64_t at) {
  if (++writes == killing_write) {
    [[maybe_unused]] const ssize_t half = ::pwrite64(file, bytes, size / 2, at);
    ::kill(::getpid(), SIGKILL);
  }
  return ::pwrite64(file, bytes, size, at);
}

/// Kill points are counted in writes to the store's files, not in time, so every trial hits one.
TEST(Store, KilledAtAnyMomentItHoldsWholeComparisonsAndIsCompletedByTheNextRun) {
  const drape::test::TemporaryFolder folder;
  const fs::path undisturbed = folder.path() / "undisturbed.sqlite";
  const std::vector<StoreExample> history = {example(4 * mm), example(5 * mm), example(6 * mm)};
  const auto run = [&](const fs::path& file) {
    for (const StoreExample& made : history) import_into(file, made);
  };
  sqlite3_vfs* vfs = sqlite3_vfs_find(nullptr);
  ASSERT_EQ(
      vfs->xSetSystemCall(vfs, "pwrite64", reinterpret_cast<sqlite3_syscall_ptr>(&counted_write)),
      SQLITE_OK);
  writes = killing_write = 0;
  run(undisturbed);
  const int whole = writes;
  ASSERT_GT(whole, 100);
  const std::string expected = content(undisturbed);
  constexpr int trials = 25;
  for (int trial = 0; trial < trials; ++trial) {
    const fs::path file = folder.path() / ("killed" + std::to_string(trial) + ".sqlite");
    const int at = 1 + trial * (whole - 1) / trials;
    const int ended = in_child([&] {
      writes = 0;
      killing_write = at;
      run(file);
    });
    EXPECT_EQ(ended, -SIGKILL) << "write " << at << " of " << whole;
    if (fs::exists(file) && fs::file_size(file) > 0) {
      SQLite::Database database(file.string(), SQLite::OPEN_READWRITE);
      EXPECT_EQ(database.execAndGet("PRAGMA integrity_check").getString(), "ok");
      if (database.tableExists("comparison")) {
        EXPECT_EQ(database
                      .execAndGet("SELECT count(*) FROM comparison WHERE marks <> (SELECT "
                                  "count(*) FROM mark_error WHERE comparison_id = id)")
                      .getInt(),
                  0);
      }
    }
    run(file);
    EXPECT_EQ(content(file), expected) << "killed at write " << at << " of " << whole;
  }
  vfs->xSetSystemCall(vfs, "pwrite64", nullptr);
}

TEST(Store, AWarningIsStoredThoughTheSheetsAreAndTheNextImportKeepsIt) {
  const drape::test::TemporaryFolder folder;
  const fs::path file = folder.path() / "results.sqlite";
  Session session = read_session(test::write_example(folder.path() / "A"), {});
  session.drapes[0].recording = RecordingId{sha256_of("recording.json"), "2026-02-28", "recording"};
  const auto run = [&](const std::vector<std::string>& warnings) {
    Outcome outcome;
    outcome.warnings = warnings;
    compare_session(session, {}, outcome);
    static_cast<void>(import_session(file, session, outcome, {}));
    return outcome.run;
  };
  const auto one = [&](const char* sql) { return StoreReader(file).query(sql).rows.at(0).at(0); };
  EXPECT_EQ(run({}), 1);
  for (int time = 0; time < 2; ++time) EXPECT_EQ(run({"detect (drape A): cam1 is dim"}), 2);
  EXPECT_EQ(one("SELECT value FROM run_value WHERE run = 2 AND owner = 'warning 01'"),
            "detect (drape A): cam1 is dim");
  EXPECT_EQ(run({"detect (drape A): cam2 is dim"}), 3);
  EXPECT_EQ(run({}), 3) << "an import knows of no warning: it is the last run";
  EXPECT_EQ(run({"detect (drape A): cam1 is dim"}), 2);
  EXPECT_EQ(one("SELECT count(*) FROM run"), "3");
  EXPECT_EQ(one("SELECT count(DISTINCT sha256) FROM run"), "3");
  EXPECT_EQ(one("SELECT last_run FROM v_run_last WHERE run = 1"), "2") << "stored last";
  EXPECT_TRUE(altered_rows(StoreReader(file)).empty());
}

TEST(Store, AStandInMarksWhatItSpeaksOfAndNothingElse) {
  const std::string bias = "bending.bias_stiffness_gf_cm2_per_cm";
  EXPECT_FALSE(stands_in_for("bending hysteresis", "bending.warp"));
  EXPECT_FALSE(stands_in_for("bending hysteresis", bias));
  EXPECT_FALSE(stands_in_for("bending curves", bias));
  EXPECT_FALSE(stands_in_for("bias bending stiffness", "bending.warp"));
  EXPECT_FALSE(stands_in_for("shear curves", "tensile.warp"));
  EXPECT_FALSE(stands_in_for("all", "name"));
  EXPECT_TRUE(stands_in_for("bias bending stiffness", bias));
  EXPECT_TRUE(stands_in_for("bending at 45 degrees", bias));
  EXPECT_TRUE(stands_in_for("bending curves", "bending.weft"));
  EXPECT_TRUE(stands_in_for("tensile curves: EMT 3 %, LT 0.7, RT 60 %", "tensile.warp"));
  EXPECT_TRUE(stands_in_for("areal density", "areal_density_g_per_m2"));
  EXPECT_TRUE(stands_in_for("all", "shear.weft"));
  EXPECT_TRUE(stands_in_for("friction", "friction"));
}

}  // namespace
}  // namespace drape::compare
