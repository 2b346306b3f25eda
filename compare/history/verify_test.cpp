// SPDX-License-Identifier: Apache-2.0
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <stdlib.h>

#include <fstream>
#include <random>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"
#include "tests/support/trials.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class Stored : public test::StoredExample {
 protected:
  [[nodiscard]] std::string first_key() const {
    return StoreReader(store()).query("SELECT sha256 FROM comparison WHERE id = 1").rows[0][0];
  }
};

TEST_F(Stored, AnUntouchedStoreIsVerifiedAndComputedAgain) {
  const Verification result = verify_store(store());
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_EQ(result.comparisons, 4 + 4) << "of real cloth, and pairs of simulations";
  EXPECT_EQ(result.manifests, 2) << "of the new store, and of the run";
  // 5 sheets, and the certificate that all simulations have.
  EXPECT_EQ(test::one(StoreReader(store()), "SELECT count(*) FROM blob"), "6");
}

TEST_F(Stored, ImportingAgainAddsNothing) {
  const std::string before = sha256_of_file(store());
  import();
  EXPECT_EQ(counts_.added, 0);
  EXPECT_EQ(sha256_of_file(store()), before);
  EXPECT_THAT(findings(), IsEmpty());
}

TEST_F(Stored, PairsWithoutARealClothAreRecomputedToo) {
  const fs::path file = folder_.path() / "virtual.sqlite";
  const Session session = read_session({sheets_.begin() + 1, sheets_.end()}, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  EXPECT_EQ(import_session(file, session, outcome).added, 4);
  const Verification result = verify_store(file);
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_EQ(result.comparisons, 4);
}

TEST_F(Stored, FilesOutsideMayGoAndChangeAndAreNamedByWhy) {
  fs::remove(folder_.path() / "bench" / "recording" / "drape_A" / "cam1.png");
  write_durable(folder_.path() / "bench" / "scene.toml", "# the sphere, with another comment\n");
  EXPECT_THAT(findings(true), IsEmpty());
  const Answer why = explain(StoreReader(store()), first_key(), "mean_mm");
  EXPECT_FALSE(why.good);
  for (const auto& row : why.tables[1].rows)
    EXPECT_EQ(row[4], row[1].ends_with("cam1.png")     ? "not there"
                      : row[1].ends_with("scene.toml") ? "altered"
                                                       : "unchanged")
        << row[1];
  fs::remove_all(folder_.path() / "A");
  EXPECT_THAT(findings(true), IsEmpty()) << "computed again from the blobs";
}

TEST_F(Stored, WhatCannotBeComputedAgainIsAFinding) {
  const fs::path file = folder_.path() / "numbers.sqlite";
  test::add_drape(file, test::measured_sheet(),
                  {test::simulated_sheet(11, 5), test::simulated_sheet(21, 5)});
  EXPECT_THAT(verify_store(file, false).findings, IsEmpty());
  EXPECT_THAT(verify_store(file).findings,
              Contains(HasSubstr(" and 1 more were not computed again: the store lacks their")));
}

/// Two groups whose coarsest grids have as many particles, of cloths of two sizes.
TEST_F(Stored, PairsAreRecomputedOnTheGridOfTheirOwnCloth) {
  std::vector<fs::path> sheets = {sheets_.begin() + 1, sheets_.end()};
  for (const int n : {11, 21}) {
    Sheet sheet = test::simulated_sheet(n, 5);
    sheet.patch_m *= 0.9;
    for (SheetMark& mark : sheet.marks) {
      mark.material_m *= 0.9;
      mark.point_in_world.z() = 1e-3 * n * mark.material_m.x();
    }
    std::get<SimulatedSource>(sheet.source).scene = "B";
    sheets.push_back(folder_.path() / ("other" + std::to_string(n)) / "sheet.ply");
    write_sheet(sheets.back(), sheet);
  }
  const fs::path file = folder_.path() / "virtual.sqlite";
  const Session session = read_session(sheets, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  ASSERT_EQ(import_session(file, session, outcome).added, 5);
  const Verification result = verify_store(file);
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_EQ(result.comparisons, 5);
}

TEST_F(Stored, AMovedAndRenamedStoreIsWhole) {
  const fs::path moved = folder_.path() / "moved" / "other.sqlite";
  fs::create_directory(moved.parent_path());
  fs::rename(store(), moved);
  EXPECT_THAT(verify_store(moved).findings, IsEmpty());
}

TEST_F(Stored, ThroughALinkNothingStandsBesideTheLink) {
  const fs::path links = folder_.path() / "links", link = links / "link.sqlite";
  for (const char* name : {"links", "far"}) fs::create_directory(folder_.path() / name);
  fs::create_symlink("../far/real.sqlite", link);
  (void)test::import_run(link, read_session(sheets_, {}));
  EXPECT_EQ(std::distance(fs::directory_iterator(links), {}), 1);
  for (const fs::path& name : {link, folder_.path() / "far" / "real.sqlite"})
    EXPECT_THAT(verify_store(name).findings, IsEmpty()) << name;
  EXPECT_TRUE(explain(StoreReader(link), first_key(), "mean_mm").good);
}

/// Restores a file at the end of the trial.
class Restored {
 public:
  explicit Restored(fs::path file) : file_(std::move(file)), bytes_(read_text(file_)) {}
  ~Restored() {
    std::ofstream(file_, std::ios::binary | std::ios::trunc) << bytes_;
    for (const char* more : {"-wal", "-shm"}) fs::remove(file_.string() + more);
  }
  Restored(const Restored&) = delete;
  Restored& operator=(const Restored&) = delete;
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  fs::path file_;
  std::string bytes_;
};

/// One bit of one byte of the store.
std::string flip_a_bit(std::mt19937& random, const fs::path& file, const std::string& bytes) {
  std::string changed = bytes;
  const std::size_t at = random() % changed.size();
  changed[at] = static_cast<char>(changed[at] ^ (1 << random() % 8));
  std::ofstream(file, std::ios::binary | std::ios::trunc) << changed;
  return fmt::format("byte {}", at);
}

/// Changes a value in, removes or adds a random row of a random table.
std::string change_a_row(std::mt19937& random, const fs::path& file) {
  SQLite::Database database(file.string(), SQLite::OPEN_READWRITE);
  std::vector<std::string> tables, triggers;
  SQLite::Statement names(database,
                          "SELECT type, name FROM sqlite_master WHERE type IN ('table', "
                          "'trigger') AND name NOT LIKE 'sqlite_%' ORDER BY name");
  while (names.executeStep())
    (names.getColumn(0).getString() == "table" ? tables : triggers)
        .push_back(names.getColumn(1).getString());
  names.reset();
  std::erase_if(tables, [&](const std::string& table) {
    return database.execAndGet("SELECT count(*) FROM \"" + table + "\"").getInt() == 0;
  });
  for (const std::string& trigger : triggers) database.exec("DROP TRIGGER " + trigger);
  const std::string table = tables[random() % tables.size()];
  const int rows = database.execAndGet("SELECT count(*) FROM \"" + table + "\"").getInt();
  std::vector<std::string> columns;
  SQLite::Statement info(database, "SELECT name FROM pragma_table_info('" + table +
                                       "') WHERE type "
                                       "<> 'INTEGER' OR pk = 0");
  while (info.executeStep()) columns.push_back(info.getColumn(0).getString());
  info.reset();
  const std::string column = columns.empty() ? "" : columns[random() % columns.size()];
  std::string key;
  SQLite::Statement keys(database,
                         "SELECT group_concat('\"' || name || '\"', ', ') FROM "
                         "pragma_table_info('" +
                             table + "') WHERE pk > 0");
  if (keys.executeStep()) key = keys.getColumn(0).getString();
  keys.reset();
  const std::string where =
      fmt::format(" WHERE ({0}) = (SELECT {0} FROM \"{1}\" LIMIT 1 OFFSET {2})", key, table,
                  random() % static_cast<unsigned>(rows));
  const bool remove = columns.empty() || random() % 3 == 0;
  std::string sql =
      remove ? "DELETE FROM \"" + table + "\"" + where
             : fmt::format(
                   "UPDATE OR IGNORE \"{0}\" SET \"{1}\" = CASE typeof(\"{1}\") WHEN 'real' "
                   "THEN \"{1}\" + 1e-6 WHEN 'integer' THEN 1 - \"{1}\" WHEN 'text' THEN "
                   "\"{1}\" || 'x' ELSE NULL END{2}",
                   table, column, where);
  try {
    // A constraint that refuses the change counts as a finding; then another change is made.
    if (database.exec(sql) == 0 ||
        database.execAndGet(fmt::format("SELECT count(*) FROM \"{}\"", table)).isNull())
      database.exec("INSERT INTO rig VALUES ('invented')");
  } catch (const SQLite::Exception&) {
    database.exec("INSERT INTO rig VALUES ('invented')");
  }
  return sql;
}

/// A view, trigger, index or table that is not as the programs make it.
std::string change_the_schema(std::mt19937& random, const fs::path& file) {
  const std::string statements[] = {
      "DROP VIEW v_run; CREATE VIEW v_run AS SELECT 1 AS run",
      "DROP TRIGGER comparison_no_UPDATE",
      "CREATE TRIGGER evil AFTER INSERT ON run BEGIN SELECT 1; END",
      "CREATE TABLE stranger (x)",
      "CREATE VIEW v_mine AS SELECT * FROM comparison",
      "DROP INDEX pair_by_sheets",
      "ALTER TABLE rig ADD COLUMN note TEXT",
      "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = replace(sql, 'mean_mm AS "
      "mean_dist_mm', 'mean_mm * 0.1 AS mean_dist_mm') WHERE name = 'v_comparison'"};
  const std::string& sql = statements[random() % std::size(statements)];
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE).exec(sql);
  return sql;
}

/// The bytes of a blob, or the size that is stated of them.
std::string change_a_blob(std::mt19937& random, const fs::path& file) {
  SQLite::Database database(file.string(), SQLite::OPEN_READWRITE);
  const bool is_size = random() % 4 == 0, removed = random() % 4 == 0;
  const std::string trigger =
      database
          .execAndGet(fmt::format("SELECT sql FROM sqlite_master WHERE name = 'blob_no_{}'",
                                  removed ? "DELETE" : "UPDATE"))
          .getString();
  const auto rows =
      static_cast<unsigned>(database.execAndGet("SELECT count(*) FROM blob").getInt());
  const std::string which =
      fmt::format(" WHERE rowid = (SELECT rowid FROM blob LIMIT 1 OFFSET {})", random() % rows);
  database.exec(removed ? "DROP TRIGGER blob_no_DELETE" : "DROP TRIGGER blob_no_UPDATE");
  const std::string sql = removed   ? "DELETE FROM blob"
                          : is_size ? "UPDATE blob SET size = size + 1"
                                    : "UPDATE blob SET packed = CAST(substr(packed, 1, "
                                      "length(packed) - 9) || x'00' || substr(packed, -8) AS BLOB)";
  database.exec(sql + which);
  database.exec(trigger);
  return sql;
}

/// All that the store says; empty where it cannot be read.
std::string content(const fs::path& file) {
  try {
    return dump_sql(StoreReader(file));
  } catch (const Error&) {
    return {};
  }
}

TEST_F(Stored, EveryAlterationIsNamedAndPartOfNoNewProof) {
  const std::string whole = content(store());
  const int trials = drape::test::trial_count(24, 500);
  for (int trial = 0; trial < trials; ++trial) {
    std::mt19937 random(static_cast<unsigned>(trial));
    const Restored restored(store());
    const std::string what = trial % 4 == 0   ? flip_a_bit(random, store(), restored.bytes())
                             : trial % 4 == 1 ? change_a_row(random, store())
                             : trial % 4 == 2 ? change_the_schema(random, store())
                                              : change_a_blob(random, store());
    SCOPED_TRACE(fmt::format("trial {}: {}", trial, what));
    const bool altered = content(store()) != whole;
    if (!altered) continue;  // a bit that no row, blob or statement is made of
    EXPECT_FALSE(findings().empty());
    const std::string before = read_text(store());
    try {
      import({.label = "another run"});
      EXPECT_NE(trial % 4, 2) << "another schema is named before anything is added";
      if (what == "DELETE FROM blob")
        EXPECT_THAT(findings(true), IsEmpty()) << "the same content is put back";
      else
        EXPECT_FALSE(findings().empty()) << "the new manifest does not cover it";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
      EXPECT_EQ(read_text(store()), before);
      EXPECT_FALSE(findings().empty());
    }
  }
  EXPECT_EQ(content(store()), whole) << "every trial was undone";
  EXPECT_THAT(findings(true), IsEmpty());
}

TEST_F(Stored, AnotherSizeOrSchemaIsNamedBeforeAnythingIsAdded) {
  const auto refused = [&](const std::string& why) {
    const std::string before = read_text(store());
    try {
      import({.label = "another run"});
      ADD_FAILURE() << why;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      EXPECT_THAT(error.what(), HasSubstr(why));
    }
    EXPECT_EQ(read_text(store()), before);
    EXPECT_THAT(findings(), Contains(HasSubstr(why)));
  };
  {
    const Restored restored(store());
    fs::resize_file(store(), fs::file_size(store()) - 800);
    refused("bytes, its last manifest says");
  }
  {
    const Restored restored(store());
    std::ofstream(store(), std::ios::app) << std::string(4096, '\0');
    refused("bytes, its last manifest says");
  }
  const Restored restored(store());
  SQLite::Database(store().string(), SQLite::OPEN_READWRITE)
      .exec("DROP VIEW v_run; CREATE VIEW v_run AS SELECT 1 AS run");
  refused("view v_run was altered");
  EXPECT_THROW((void)StoreReader(store()), Error) << "and nothing is shown through it";
}

TEST_F(Stored, NumbersThatAreNotAsWrittenAreNotShown) {
  const std::string key = first_key();
  const Restored restored(store());
  {
    SQLite::Database database(store().string(), SQLite::OPEN_READWRITE);
    const std::string trigger =
        database.execAndGet("SELECT sql FROM sqlite_master WHERE name = 'comparison_no_UPDATE'")
            .getString();
    database.exec("DROP TRIGGER comparison_no_UPDATE");
    database.exec("UPDATE comparison SET mean_mm = mean_mm * 0.1 WHERE id = 1");
    database.exec(trigger);
  }
  const StoreReader reader(store());
  const std::function<void()> shown[] = {
      [&] { (void)list_results(reader, {}); },   [&] { (void)show_result(reader, key); },
      [&] { (void)paper_tables(reader, {}); },   [&] { (void)trend_of(reader, {}); },
      [&] { (void)trend_by(reader, "fabric"); }, [&] { (void)explain(reader, key, "mean_mm"); }};
  for (const auto& one : shown) {
    try {
      one();
      ADD_FAILURE() << &one - shown;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("comparison " + key.substr(0, 12) + " was altered"));
    }
  }
  EXPECT_EQ(list_results(reader, {.grid = "11"}).rows.size(), 2U) << "other rows are";
}

/// Ordinary use, in any order.
TEST_F(Stored, SequencesOfOrdinaryCommandsRaiseNoAlarm) {
  const int sequences = drape::test::trial_count(2, 200);
  for (int sequence = 0; sequence < sequences; ++sequence) {
    std::mt19937 random(static_cast<unsigned>(1000 + sequence));
    const drape::test::TemporaryFolder place;
    fs::path bench = place.path() / "bench";
    std::vector<fs::path> sheets = test::write_recorded_example(bench);
    const auto own = [&] { return bench / "results.sqlite"; };
    std::string done;
    for (int step = 0; step < 8; ++step) {
      const auto what = random() % 8;
      done += std::to_string(what);
      std::vector<fs::path> given = sheets;
      if (what == 1) given.resize(2);  // a single run
      if (what == 2) given.erase(given.begin() + 1);
      if (what == 3) write_durable(bench / "bench" / "scene.toml", "# " + done + "\n");
      if (what == 4) {  // a moved folder
        const fs::path to = place.path() / ("moved" + done);
        fs::rename(bench, to);
        for (fs::path& sheet : sheets) sheet = to / sheet.lexically_relative(bench);
        given = sheets;
        bench = to;
      }
      if (what == 5 && fs::exists(own())) {
        const fs::path other = bench / ("other" + done + ".sqlite");
        (void)merge_stores(other, {own()});
        EXPECT_THAT(verify_store(other).findings, IsEmpty()) << sequence << ": " << done;
        EXPECT_EQ(merge_stores(own(), {other}).added, 0);
      }
      if (what == 6 && fs::exists(own())) {
        const fs::path other = bench / ("rescued" + done + ".sqlite");
        EXPECT_THAT(rescue_store(own(), other).lost, IsEmpty());
        fs::rename(other, own());
      }
      if (what == 7) {  // the drape under another name
        given = test::write_example(bench / ("renamed" + done));
        Json json = parse_json(read_text(fs::path(given[0]).replace_extension(".json")));
        json["source"]["asked_scene"]["name"] = "B" + std::to_string(step);
        write_json(fs::path(given[0]).replace_extension(".json"), json);
      }
      (void)test::import_run(own(), read_session(given, {}),
                             {.label = step % 3 == 0 ? done : "the same"});
      EXPECT_THAT(verify_store(own()).findings, IsEmpty()) << sequence << ": " << done;
      (void)list_results(StoreReader(own()), {});
    }
  }
}

TEST_F(Stored, WhyEndsAtPhotographsAndCurvesThatExist) {
  const StoreReader reader(store());
  const Answer why = explain(reader, first_key().substr(0, 12), "mean_mm");
  EXPECT_TRUE(why.good);
  EXPECT_THAT(why.tables[0].rows[0][1], HasSubstr(" mm"));
  std::set<std::string> photographs, curves;
  for (const auto& row : why.tables[1].rows) {
    EXPECT_EQ(row[4], "unchanged") << row[1];
    const std::string file = row[1].substr(row[1].find_first_not_of(' '));
    if (row[2] == "photograph") photographs.insert(file);
    if (row[2] == "curve, 2 points") curves.insert(file);
  }
  EXPECT_THAT(photographs, SizeIs(3));
  EXPECT_THAT(curves, SizeIs(1));
  EXPECT_THROW((void)explain(reader, first_key(), "beauty"), Error);
}

TEST_F(Stored, WhyAnswersForPairsSheetsAndSingleMarksToo) {
  const StoreReader reader(store());
  const auto ends_at_photographs = [](const Answer& why) {
    return std::count_if(why.tables[1].rows.begin(), why.tables[1].rows.end(),
                         [](const auto& row) { return row[2] == "photograph"; }) == 3;
  };
  const Table mark = reader.query(
      "SELECT distance_mm FROM mark_error WHERE comparison_id = 1 AND \"row\" = 4 AND \"col\" = 7");
  const Answer of_mark =
      explain(reader, first_key(), "distance_mm", {.mark = MarkId{4, 7}, .camera = {}});
  EXPECT_EQ(of_mark.tables[0].rows[0][1], mark.rows[0][0] + " mm");
  EXPECT_TRUE(of_mark.good && ends_at_photographs(of_mark));
  EXPECT_THROW((void)explain(reader, first_key(), "distance_mm", {.mark = MarkId{0, 5}}), Error)
      << "a gap";
  const Table pair = reader.query("SELECT comparison, mean_dist_mm FROM v_virtual_vs_virtual");
  const Answer of_pair = explain(reader, pair.rows[0][0], "mean_mm");
  EXPECT_EQ(of_pair.tables[0].rows[0][1], pair.rows[0][1] + " mm");
  EXPECT_TRUE(of_pair.good && ends_at_photographs(of_pair));
  const Table sheet = reader.query("SELECT sha256 FROM sheet WHERE kind = 'measured'");
  const Answer of_sheet = explain(reader, sheet.rows[0][0], "sigma_median_mm");
  EXPECT_TRUE(of_sheet.good && ends_at_photographs(of_sheet));
}

TEST_F(Stored, WhySaysWhereTheTraceIsBroken) {
  write_durable(folder_.path() / "bench" / "recording" / "drape_A" / "cam2.png", "another");
  const Answer why = explain(StoreReader(store()), first_key(), "rms_mm");
  EXPECT_FALSE(why.good);
  for (const auto& row : why.tables[1].rows)
    EXPECT_EQ(row[4] == "altered", row[1].ends_with("cam2.png")) << row[1];
}

TEST_F(Stored, AnotherSimulatorsMeshIsRecomputedAndExplained) {
  // One of our own sheets, taken as if another program had made it.
  const fs::path toml = folder_.path() / "other.toml", mesh = sheets_[1];
  write_durable(toml, "schema = \"drapebench/mesh/1\"\nname = \"Other 1.0\"\nmesh = \"" +
                          mesh.string() +
                          "\"\nunit_mm = 1.0\nscene = \"A\"\n[grid]\ninner = \"weft\"\n"
                          "inner_count = 11\nwarp_from_mm = 0.0\nwarp_to_mm = 220.0\n"
                          "weft_from_mm = 0.0\nweft_to_mm = 220.0\n");
  sheets_.push_back(toml);
  import();
  const Verification result = verify_store(store());
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_EQ(result.comparisons, 5 + 4);
  const StoreReader reader(store());
  const Table other = list_results(reader, {.simulator = "Other 1.0"});
  ASSERT_THAT(other.rows, SizeIs(1));
  const Table own = list_results(reader, {.grid = "11", .segments = 1});
  EXPECT_EQ(other.rows[0][4], own.rows[0][4]) << "the same sheet has the same distance";
  const Answer why = explain(reader, other.rows[0][0], "mean_mm");
  EXPECT_TRUE(why.good);
  EXPECT_EQ(why.tables[1].rows.back()[2], "another simulator's mesh");
}

TEST_F(Stored, DiffShowsBothValuesAndTheMarks) {
  const StoreReader reader(store());
  const Table list = list_results(reader, {});
  const Answer found = difference_of(reader, list.rows[0][0], list.rows[1][0]);
  EXPECT_THAT(found.tables[1].rows, SizeIs(119));
  bool has_mean = false;
  EXPECT_EQ(found.tables[0].rows[0][1] + found.tables[0].rows[0][2], "GOGO");
  for (const auto& row : found.tables[0].rows) {
    if (row[0] != "mean_mm") continue;
    has_mean = true;
    EXPECT_NEAR(std::stod(row[3]), std::stod(row[2]) - std::stod(row[1]), 2e-4);
    EXPECT_EQ(row[4], "mm");
  }
  EXPECT_TRUE(has_mean);
}

TEST_F(Stored, PublishedTablesStandBesideTheStore) {
  const auto tables =
      published_tables(StoreReader(store()),
                       (drape::test::source_root() / "rigs" / "paper" / "published.csv").string());
  ASSERT_THAT(tables, SizeIs(12));
  EXPECT_EQ(tables[0].title, "Table 1. Real vs virtual, experiment A");
  ASSERT_THAT(tables[0].rows, SizeIs(4));
  EXPECT_EQ(tables[0].rows[0][2], "3.37");
  EXPECT_FALSE(tables[0].rows[0][3].empty()) << "21x21, 5 segments is in the store";
  EXPECT_EQ(tables[11].rows.back()[1], "1.25");
  EXPECT_EQ(tables[2].names.size(), 4U) << "experiment B has no sheet here";
  EXPECT_THAT(tables[2].title, HasSubstr("no measured sheet"));
  EXPECT_EQ(tables[1].names.back(), "not_at_rest");
}

TEST_F(Stored, AMeasuredSheetThatItsRunDidNotWriteIsRefused) {
  const fs::path json = fs::path(sheets_.front()).replace_extension(".json");
  std::ofstream(json, std::ios::app) << " ";
  try {
    import();
    FAIL() << "an altered sheet was compared";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("not the one that its run wrote"));
    EXPECT_THAT(error.what(), HasSubstr(json.filename().string()));
  }
}

TEST_F(Stored, ARunDatedBeforeTheLastOneIsSaid) {
  ::setenv("SOURCE_DATE_EPOCH", "86400", 1);
  const Outcome outcome = test::import_run(store(), read_session(sheets_, {}), {.label = "1970"});
  ::unsetenv("SOURCE_DATE_EPOCH");
  EXPECT_THAT(outcome.warnings, Contains(HasSubstr("the clock says 1970-01-02T00:00:00Z, before")));
  EXPECT_THAT(findings(), IsEmpty());
}

}  // namespace
}  // namespace drape::compare
