// SPDX-License-Identifier: Apache-2.0
#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <set>

#include "compare/history/results.hpp"
#include "compare/history/seal.hpp"
#include "compare/records/provenance.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/test_sheets.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class Sealed : public test::SealedStore {
 protected:
  [[nodiscard]] std::string first_key() const {
    return StoreReader(store()).query("SELECT sha256 FROM comparison WHERE id = 1").rows[0][0];
  }
};

TEST_F(Sealed, AnUntouchedStoreIsVerifiedAndRecomputed) {
  const Verification result = verify_store(store());
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_EQ(result.comparisons, 4 + 4) << "of real cloth, and pairs of simulations";
  // 3 photographs, their list, scene, fabric, curve, detections and 6 records, 5 sheets with two
  // files each, 4 certificates, 4 histories.
  EXPECT_EQ(result.files, 3 + 1 + 3 + 1 + 6 + 10 + 8);
}

TEST_F(Sealed, ImportingAgainAddsNothingAndKeepsTheSeal) {
  const std::string before = read_text(seal_path(store()));
  import();
  EXPECT_EQ(counts_.added, 0);
  EXPECT_EQ(read_text(seal_path(store())), before);
  EXPECT_THAT(findings(), IsEmpty());
}

TEST_F(Sealed, PairsWithoutARealClothAreRecomputedToo) {
  const fs::path file = folder_.path() / "virtual.sqlite";
  const Session session = read_session({sheets_.begin() + 1, sheets_.end()}, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  EXPECT_EQ(import_session(file, session, outcome).added, 4);
  seal_store(StoreLock(file, StoreLock::Kind::alone), file, files_of(session));
  const Verification result = verify_store(file);
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_EQ(result.comparisons, 4);
}

TEST_F(Sealed, SaysWhatIsWrong) {
  fs::remove(folder_.path() / "bench" / "recording" / "drape_A" / "cam1.png");
  EXPECT_THAT(findings(), Contains(HasSubstr("cam1.png is not there")));
  write_durable(folder_.path() / "bench" / "fabric" / "bending_warp.csv", "other numbers\n");
  EXPECT_THAT(findings(), Contains(HasSubstr("bending_warp.csv were changed")));
  fs::remove(seal_path(store()));
  EXPECT_THAT(findings(), Contains(HasSubstr("no seal")));
}

TEST_F(Sealed, WhatCannotBeRecomputedIsAFinding) {
  fs::remove(seal_path(store()));
  seal_store(StoreLock(store(), StoreLock::Kind::alone), store(), {});
  EXPECT_THAT(findings(true), Contains(HasSubstr("comparison " + first_key().substr(0, 12) +
                                                 " and 3 more were not recomputed")));
}

/// Two groups whose coarsest grids have equal numbers of particles, for cloths of two sizes.
TEST_F(Sealed, PairsAreRecomputedOnTheGridOfTheirOwnCloth) {
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
  seal_store(StoreLock(file, StoreLock::Kind::alone), file, files_of(session));
  const Verification result = verify_store(file);
  EXPECT_THAT(result.findings, IsEmpty());
  EXPECT_EQ(result.comparisons, 5);
}

TEST_F(Sealed, AStoreOfAnotherNameIsNotCalledChanged) {
  const fs::path other = folder_.path() / "other.sqlite";
  fs::copy_file(store(), other);
  fs::copy_file(seal_path(store()), seal_path(other));
  EXPECT_THAT(verify_store(other).findings,
              testing::ElementsAre(HasSubstr("was called `results.sqlite`")));
}

TEST_F(Sealed, ThroughALinkTheSealStandsBesideTheStore) {
  const fs::path links = folder_.path() / "links", link = links / "link.sqlite";
  for (const char* name : {"links", "far"}) fs::create_directory(folder_.path() / name);
  fs::create_symlink("../far/real.sqlite", link);
  const Session session = read_session(sheets_, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  (void)import_session(link, session, outcome);
  std::vector<fs::path> files = files_of(session);
  for (fs::path& copy : keep_copies(link, session)) files.push_back(std::move(copy));
  seal_store(StoreLock(link, StoreLock::Kind::alone), link, files);
  EXPECT_EQ(std::distance(fs::directory_iterator(links), {}), 1);
  EXPECT_TRUE(fs::is_directory(folder_.path() / "far" / "real.sqlite.files"));
  for (const fs::path& name : {link, folder_.path() / "far" / "real.sqlite"})
    EXPECT_THAT(verify_store(name).findings, IsEmpty()) << name;
}

TEST_F(Sealed, ASealThatIsOlderThanTheStoreIsSaid) {
  {
    Store grown(store());
    const DrapeInput input = test::drape_of(test::measured_sheet(), {test::simulated_sheet(21, 5)});
    grown.add(input, compare_drape(input, {}));
    grown.close();
  }
  EXPECT_FALSE(findings().empty());
  import();  // seals it again
  EXPECT_THAT(findings(), IsEmpty());
}

TEST_F(Sealed, SealingAgainDoesNotHideRemovedRows) {
  {
    SQLite::Database database(store().string(), SQLite::OPEN_READWRITE);
    database.exec("DROP TRIGGER ledger_no_DELETE");
    database.exec("DELETE FROM ledger WHERE sequence = (SELECT max(sequence) FROM ledger)");
  }
  EXPECT_THROW(seal_store(StoreLock(store(), StoreLock::Kind::alone), store(), sheets_), Error);
  EXPECT_FALSE(findings().empty());
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

/// Flips one bit of one byte in any file behind the numbers, the store or the seal.
std::string flip_a_bit(std::mt19937& random, const fs::path& file, const std::string& bytes) {
  std::string changed = bytes;
  const std::size_t at = random() % changed.size();
  changed[at] = static_cast<char>(changed[at] ^ (1 << random() % 8));
  std::ofstream(file, std::ios::binary | std::ios::trunc) << changed;
  return fmt::format("byte {} of {}", at, file.filename().string());
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

/// Changes an argument or option in one of the run records, keeping it well-formed.
std::string change_an_option(std::mt19937& random, const fs::path& file) {
  Json json = parse_json(read_text(file));
  if (random() % 2 == 0) {
    Json& arguments = json["arguments"];
    arguments[random() % arguments.size()] = "another";
  } else {
    const std::string name = random() % 2 == 0 ? "method" : "limit_px";
    json["options"][name] = json["options"][name].get<std::string>() + "1";
  }
  std::ofstream(file, std::ios::binary | std::ios::trunc) << pretty(json);
  return "an option in " + file.filename().string();
}

TEST_F(Sealed, EveryTamperTrialIsFound) {
  std::vector<fs::path> files, records;
  for (const auto& [name, sha256] : read_seal(store()).files) {
    files.push_back(folder_.path() / name);
    if (name.ends_with(".run.json")) records.push_back(files.back());
  }
  files.push_back(store());
  files.push_back(seal_path(store()));
  int found = 0;
  const int trials = drape::test::trial_count(90, 1000);
  for (int trial = 0; trial < trials; ++trial) {
    std::mt19937 random(static_cast<unsigned>(trial));
    const int kind = trial % 3;
    const fs::path file = kind == 0   ? files[random() % files.size()]
                          : kind == 1 ? store()
                                      : records[random() % records.size()];
    const Restored restored(file);
    const std::string what = kind == 0   ? flip_a_bit(random, file, restored.bytes())
                             : kind == 1 ? change_a_row(random, file)
                                         : change_an_option(random, file);
    const bool is_found = !findings().empty();
    EXPECT_TRUE(is_found) << "trial " << trial << ": " << what;
    found += is_found;
  }
  EXPECT_EQ(found, trials);
  EXPECT_THAT(findings(true), IsEmpty()) << "every trial was undone";
}

TEST_F(Sealed, WhyEndsAtPhotographsAndCurvesThatExist) {
  const StoreReader reader(store());
  const Explanation why = explain(reader, first_key().substr(0, 12), "mean_mm");
  EXPECT_TRUE(why.complete);
  EXPECT_THAT(why.number.rows[0][1], HasSubstr(" mm"));
  std::set<std::string> photographs, curves;
  for (const auto& row : why.chain.rows) {
    EXPECT_EQ(row[4], "unchanged") << row[1];
    const std::string file = row[1].substr(row[1].find_first_not_of(' '));
    if (row[2] == "photograph") photographs.insert(file);
    if (row[2] == "curve, 2 points") curves.insert(file);
  }
  EXPECT_THAT(photographs, SizeIs(3));
  EXPECT_THAT(curves, SizeIs(1));
  EXPECT_THROW((void)explain(reader, first_key(), "beauty"), Error);
}

TEST_F(Sealed, WhyAnswersForPairsSheetsAndSingleMarksToo) {
  const StoreReader reader(store());
  const auto ends_at_photographs = [](const Explanation& why) {
    return std::count_if(why.chain.rows.begin(), why.chain.rows.end(),
                         [](const auto& row) { return row[2] == "photograph"; }) == 3;
  };
  const Table mark = reader.query(
      "SELECT distance_mm FROM mark_error WHERE comparison_id = 1 AND \"row\" = 4 AND \"col\" = 7");
  const Explanation of_mark =
      explain(reader, first_key(), "distance_mm", {.mark = MarkId{4, 7}, .camera = {}});
  EXPECT_EQ(of_mark.number.rows[0][1], mark.rows[0][0] + " mm");
  EXPECT_TRUE(of_mark.complete && ends_at_photographs(of_mark));
  EXPECT_THROW((void)explain(reader, first_key(), "distance_mm", {.mark = MarkId{0, 5}}), Error)
      << "a gap";
  const Table pair = reader.query("SELECT comparison, mean_dist_mm FROM v_virtual_vs_virtual");
  const Explanation of_pair = explain(reader, pair.rows[0][0], "mean_mm");
  EXPECT_EQ(of_pair.number.rows[0][1], pair.rows[0][1] + " mm");
  EXPECT_TRUE(of_pair.complete && ends_at_photographs(of_pair));
  const Table sheet = reader.query("SELECT sha256 FROM sheet WHERE kind = 'measured'");
  const Explanation of_sheet = explain(reader, sheet.rows[0][0], "sigma_median_mm");
  EXPECT_TRUE(of_sheet.complete && ends_at_photographs(of_sheet));
}

TEST_F(Sealed, WhySaysWhereTheTraceIsBroken) {
  write_durable(folder_.path() / "bench" / "recording" / "drape_A" / "cam2.png", "another");
  const Explanation why = explain(StoreReader(store()), first_key(), "rms_mm");
  EXPECT_FALSE(why.complete);
  for (const auto& row : why.chain.rows)
    EXPECT_EQ(row[4] == "altered", row[1].ends_with("cam2.png")) << row[1];
}

TEST_F(Sealed, AnotherSimulatorsMeshIsRecomputedAndExplained) {
  // One of our own sheets, treated as that of another program.
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
  const Explanation why = explain(reader, other.rows[0][0], "mean_mm");
  EXPECT_TRUE(why.complete);
  EXPECT_EQ(why.chain.rows.back()[2], "another simulator's mesh");
}

TEST_F(Sealed, DiffShowsBothValuesAndTheMarks) {
  const StoreReader reader(store());
  const Table list = list_results(reader, {});
  const Difference found = difference_of(reader, list.rows[0][0], list.rows[1][0]);
  EXPECT_THAT(found.marks.rows, SizeIs(119));
  bool has_mean = false;
  EXPECT_EQ(found.metrics.rows[0][1] + found.metrics.rows[0][2], "GOGO");
  for (const auto& row : found.metrics.rows) {
    if (row[0] != "mean_mm") continue;
    has_mean = true;
    EXPECT_NEAR(std::stod(row[3]), std::stod(row[2]) - std::stod(row[1]), 2e-4);
    EXPECT_EQ(row[4], "mm");
  }
  EXPECT_TRUE(has_mean);
}

TEST_F(Sealed, PublishedTablesStandBesideTheStore) {
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

TEST_F(Sealed, WhatWasAlteredSinceItWasReadIsNotSealedAsWhole) {
  for (const char* name : {"scene.toml", "points.json"}) {
    const auto at = std::find_if(fs::recursive_directory_iterator(folder_.path()), {},
                                 [&](const auto& one) { return one.path().filename() == name; });
    ASSERT_NE(at, fs::recursive_directory_iterator()) << name;
    std::ofstream(at->path(), std::ios::app) << " ";
    import();
    EXPECT_THAT(findings(), Contains(HasSubstr(name)));
  }
}

TEST_F(Sealed, AMeasuredSheetThatItsRunDidNotWriteIsRefused) {
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

TEST_F(Sealed, ASealWithoutItsStoreIsNoPlaceForAnother) {
  require_store_of_seal(store());
  fs::remove(store());
  EXPECT_THROW(require_store_of_seal(store()), Error);
  fs::remove(seal_path(store()));
  require_store_of_seal(store());
}

}  // namespace
}  // namespace drape::compare
