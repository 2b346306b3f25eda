// SPDX-License-Identifier: Apache-2.0
#include "compare/history/results.hpp"

#include <gmock/gmock.h>

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class Results : public testing::Test {
 protected:
  Results() {
    test::add_drape(file(), test::measured_sheet(),
                    {test::simulated_sheet(11, 1), test::simulated_sheet(11, 5),
                     test::simulated_sheet(21, 1), test::simulated_sheet(21, 5)});
  }
  [[nodiscard]] std::filesystem::path file() const { return folder_.path() / "results.sqlite"; }

  drape::test::TemporaryFolder folder_;
};

TEST_F(Results, ListFilters) {
  const StoreReader reader(file());
  EXPECT_EQ(list_results(reader, {}).rows.size(), 4U);
  EXPECT_EQ(list_results(reader, {.scene = "A"}).rows.size(), 4U);
  EXPECT_NO_THROW(static_cast<void>(list_results(reader, {.since = "2026-03"})));
  for (const char* date : {"24.11.2026", "2026-13-01", "yesterday"}) {
    EXPECT_THROW(static_cast<void>(list_results(reader, {.since = date})), Error) << date;
    EXPECT_THROW(static_cast<void>(list_runs(reader, {.until = date})), Error) << date;
  }
  EXPECT_EQ(list_results(reader, {.fabric = "cotton-like"}).rows.size(), 4U);
  EXPECT_EQ(list_results(reader, {.grid = "21"}).rows.size(), 2U);
  EXPECT_EQ(list_results(reader, {.grid = "21x21", .segments = 5}).rows.size(), 1U);
}

TEST_F(Results, AValueThatNothingHasIsRefusedWithThoseThatThereAre) {
  const StoreReader reader(file());
  const auto refusal = [&](const ResultFilter& filter) -> std::string {
    try {
      (void)list_results(reader, filter);
    } catch (const Error& error) {
      return error.kind() == ErrorKind::usage ? error.what() : "another kind";
    }
    return "";
  };
  EXPECT_THAT(refusal({.scene = "C"}), HasSubstr("there is: A"));
  EXPECT_THAT(refusal({.scene = "A' OR '1"}), HasSubstr("there is: A")) << "values are bound";
  EXPECT_THAT(refusal({.fabric = "silk"}), HasSubstr("cotton-like"));
  EXPECT_THAT(refusal({.grid = "abc"}), HasSubstr("11x11, 21x21"));
  EXPECT_THAT(refusal({.segments = 3}), HasSubstr("1, 5"));
  EXPECT_THAT(refusal({.rig = "lab-B"}), HasSubstr("bench"));
  EXPECT_THAT(refusal({.model = "rods"}), HasSubstr("consistent"));
  EXPECT_THAT(refusal({.simulator = "Other"}), HasSubstr("drapebench"));
  EXPECT_THAT(refusal({.calibration = "3fa9"}), HasSubstr("calibration `3fa9`"));
  EXPECT_THAT(refusal({.run = 99}), HasSubstr("no run 99"));
}

TEST_F(Results, TablesHaveTheLayoutOfThePaper) {
  const StoreReader reader(file());
  const auto tables = paper_tables(reader, {});
  ASSERT_EQ(tables.size(), 2U);
  EXPECT_THAT(tables[0].names, ElementsAre("discretisation", "segments", "mean_dist_mm"));
  EXPECT_THAT(tables[1].names, ElementsAre("pair", "mean_dist_mm"));
  EXPECT_EQ(tables[1].rows[2][0], "1 seg: 11x11 vs 21x21");
}

TEST_F(Results, TablesNameSimulatorsAndFabricsWhereThereAreSeveral) {
  DrapeInput input = test::drape_of(test::measured_sheet(),
                                    {test::simulated_sheet(21, 5), test::simulated_sheet(21, 1),
                                     test::simulated_sheet(11, 5), test::simulated_sheet(11, 1)});
  input.simulations[1].other_simulator = "Other";
  auto& other = std::get<SimulatedSource>(input.simulations[1].sheet.sheet.source);
  other.model = "Other";
  const auto add = [&](const std::string& name) {
    const fs::path file = folder_.path() / name;
    Store store(file);
    test::add(store, input, compare_drape(input, {}));
    store.close();
    return file;
  };
  const StoreReader two(add("two.sqlite"));
  const auto tables = paper_tables(two, {});
  EXPECT_THAT(tables.at(0).names,
              ElementsAre("discretisation", "segments", "mean_dist_mm", "simulator"));
  EXPECT_EQ(tables[0].rows.back()[3], "Other");
  const auto alone = paper_tables(two, {.simulator = "Other"});
  ASSERT_EQ(alone.size(), 1U) << "no pair of it";
  EXPECT_EQ(alone[0].rows.size(), 1U);
  EXPECT_EQ(alone[0].names.back(), "simulator");
  std::get<SimulatedSource>(input.simulations[0].sheet.sheet.source).solver = "static";
  auto& silk = std::get<SimulatedSource>(input.simulations[3].sheet.sheet.source);
  silk.fabric = "silk";
  silk.fabric_sha256 = std::string(64, 'e');
  const StoreReader more(add("more.sqlite"));
  EXPECT_THAT(
      paper_tables(more, {}).at(0).names,
      ElementsAre("discretisation", "segments", "mean_dist_mm", "simulator", "fabric", "solver"));
}

TEST_F(Results, AFilterHoldsInEveryTable) {
  const StoreReader reader(file());
  EXPECT_EQ(paper_tables(reader, {.grid = "21", .segments = 5}).size(), 1U);
  const auto five = paper_tables(reader, {.segments = 5});
  ASSERT_EQ(five.size(), 2U);
  ASSERT_EQ(five[1].rows.size(), 1U);
  EXPECT_EQ(five[1].rows[0][0], "5 seg: 11x11 vs 21x21");

  DrapeInput input = test::drape_of(
      test::measured_sheet(),
      {test::simulated_sheet(11, 5), test::simulated_sheet(11, 1), test::simulated_sheet(21, 5)});
  for (const int k : {0, 1})
    input.simulations[static_cast<std::size_t>(k)].branch =
        test::branch(std::string(64, 'b'), k + 1, 2, 1e-3, 1, true);
  const fs::path branches = folder_.path() / "branches.sqlite";
  Store store(branches);
  test::add(store, input, compare_drape(input, {}));
  store.close();
  EXPECT_THAT(paper_tables(StoreReader(branches), {}).back().title, HasSubstr("Branches"));
  EXPECT_EQ(paper_tables(StoreReader(branches), {.grid = "21"}).size(), 1U);
  EXPECT_EQ(paper_tables(StoreReader(branches), {.segments = 1}).at(0).rows.size(), 1U);

  const auto files = test::write_example(folder_.path() / "A");
  const Session session = read_session({files[1], files[2], files[3], files[4]}, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  const fs::path simulated = folder_.path() / "alone.sqlite";
  (void)import_session(simulated, session, outcome);
  EXPECT_EQ(paper_tables(StoreReader(simulated), {}).at(0).rows.size(), 4U);
  const auto coarse = paper_tables(StoreReader(simulated), {.grid = "11"});
  ASSERT_EQ(coarse.at(0).rows.size(), 1U);
  EXPECT_EQ(coarse[0].rows[0][0], "11x11: 5 seg vs 1 seg");
}

TEST_F(Results, PublishedTablesAreThoseOfTheExperimentThatIsAskedFor) {
  const StoreReader reader(file());
  const std::string paper = (drape::test::source_root() / "rigs/paper/published.csv").string();
  const auto tables = published_tables(reader, paper, "E");
  ASSERT_EQ(tables.size(), 2U);
  for (const Table& table : tables) EXPECT_THAT(table.title, HasSubstr("experiment E"));
  EXPECT_THROW((void)published_tables(reader, paper, "Z"), Error);
}

TEST_F(Results, PublishedTablesEndWithTheClothOnItsFinestMesh) {
  const fs::path file = folder_.path() / "cloth.sqlite";
  Sheet paper = test::simulated_sheet(21, 5, test::raised(4 * units::mm)),
        from_measured = test::mesh_sheet(2.5 * units::mm, 5);
  std::get<SimulatedSource>(paper.source).model = "paper";
  std::get<SimulatedSource>(from_measured.source).from_measured = true;
  test::add_drape(file, test::measured_sheet(),
                  {paper, from_measured, test::mesh_sheet(2.5 * units::mm, 5, test::raised(0.003)),
                   test::mesh_sheet(5 * units::mm, 5, test::raised(0.002))});
  const Table table =
      published_tables(StoreReader(file),
                       (drape::test::source_root() / "rigs/paper/published.csv").string(), "A")
          .at(0);
  ASSERT_EQ(table.rows.size(), 5U) << "the paper's four, then the cloth once";
  EXPECT_THAT(table.names.at(3), HasSubstr("_paper_"));
  EXPECT_THAT(table.names.at(4), HasSubstr("_triangles_mm"));
  EXPECT_THAT(table.rows.front(), ElementsAre("21x21", "5", "3.37", testing::Ne(""), "", ""));
  EXPECT_NEAR(std::stod(table.rows.front().at(3)), 4, 1e-9);
  EXPECT_THAT(table.rows.back(), ElementsAre("2.5 mm", "5", "", "", testing::Ne(""), ""));
  EXPECT_NEAR(std::stod(table.rows.back().at(4)), 3, 1e-9);
}

TEST_F(Results, RunsAreFoundByTheCalibrationOfTheirSheets) {
  const auto files = test::write_example(folder_.path() / "A");
  const Session session = read_session(files, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  const fs::path imported = folder_.path() / "imported.sqlite";
  (void)import_session(imported, session, outcome);
  const StoreReader reader(imported);
  const std::string calibration = sha256_of(std::string_view("calibration")).substr(0, 8);
  EXPECT_EQ(list_runs(reader, {.calibration = calibration}).rows.size(), 1U);
  try {
    (void)explain(reader, calibration, "rms_px", {.camera = "cam1"});
    FAIL() << "no calibration.json was given";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("--calibration"));
  }
}

TEST_F(Results, ShowNamesUnitsAndDefinitions) {
  const StoreReader reader(file());
  const std::string key = list_results(reader, {}).rows[0][0];
  const Answer shown = show_result(reader, key);
  EXPECT_EQ(shown.tables[2].rows.size(), 121U);
  for (const auto& row : shown.tables[0].rows) {
    EXPECT_FALSE(row[2].empty()) << row[0];
    EXPECT_FALSE(row[3].empty()) << row[0];
  }
  EXPECT_THROW((void)show_result(reader, "zzz"), Error);
  EXPECT_THROW((void)show_result(reader, ""), Error) << "every key starts with nothing";
}

TEST_F(Results, OnlyQueriesAreRun) {
  const StoreReader reader(file());
  for (const char* sql :
       {"DELETE FROM mark_error", "DROP TABLE rig", "ATTACH 'x' AS y", "PRAGMA query_only = OFF",
        "VACUUM INTO 'x'", "SELECT 1; DELETE FROM rig",
        "WITH x AS (SELECT 1) DELETE FROM mark_error", "SELECT nothing FROM rig", ""}) {
    EXPECT_THROW((void)reader.query(sql), Error) << sql;
  }
  const auto kind_of = [](const auto& ask) {
    try {
      static_cast<void>(ask());
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::internal;
  };
  const char* unknown = "SELECT nothing FROM rig";
  EXPECT_EQ(kind_of([&] { return reader.query(unknown, {}, StoreReader::Author::person); }),
            ErrorKind::usage);  // caller's error
  EXPECT_EQ(kind_of([&] { return reader.query(unknown); }), ErrorKind::bad_input);
  EXPECT_EQ(reader.query("SELECT count(*) FROM mark_error").rows[0][0], "484");
  EXPECT_EQ(reader.query(" select ';' ; ").rows[0][0], ";");
  for (const std::string& none : {std::string(60000, ' '), std::string(60000, 'a')})
    EXPECT_EQ(kind_of([&] { return reader.query(none); }), ErrorKind::usage);
}

TEST_F(Results, ExportNamesWhatThereIs) {
  const StoreReader reader(file());
  EXPECT_EQ(export_table(reader, "mark_error").rows.size(), 484U);
  EXPECT_THAT(export_table(reader, "v_comparison").names, testing::Contains("measurement"));
  try {
    (void)export_table(reader, "marks");
    FAIL() << "a table that does not exist was exported";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("mark_error"));
  }
}

TEST(Table, TextCsvAndJson) {
  Table table;
  table.title = "Title";
  table.names = {"name", "length_mm"};
  table.numeric = {false, true};
  table.add({"a, \"b\"", "1.5"});
  table.add({"ü", ""});
  EXPECT_EQ(text_of(table),
            "Title\n  name     length_mm\n  ------   ---------\n  a, \"b\"         1.5\n  ü\n");
  EXPECT_EQ(csv_of(table), "name,length_mm\n\"a, \"\"b\"\"\",1.5\nü,\n");
  EXPECT_EQ(json_of(table).dump(),
            R"([{"name":"a, \"b\"","length_mm":1.5},{"name":"ü","length_mm":null}])");
  table.rows = {{"whole", "12"}, {"negative", "-3"}, {"real", "2.0"}, {"small", "1e-9"}};
  EXPECT_EQ(json_of(table)[0]["length_mm"].dump(), "12");
  EXPECT_EQ(json_of(table)[1]["length_mm"].dump(), "-3");
  EXPECT_EQ(json_of(table)[2]["length_mm"].dump(), "2.0");
  EXPECT_EQ(json_of(table)[3]["length_mm"], 1e-9);
}

TEST(SheetFolders, StandAloneSimulationsComeFirstAndMeasuredSheetsKeepTheirs) {
  const drape::test::TemporaryFolder folder;
  const auto sheets = test::write_example(folder.path() / "out" / "A");
  for (const char* name : {"paper/C/consistent/11-1", "paper/C/consistent/11-5"}) {
    const fs::path to = folder.path() / name;
    fs::create_directories(to);
    fs::copy(sheets[1].parent_path(), to);
  }
  const auto found = files_in({folder.path()}).sheets;
  ASSERT_EQ(found.size(), 2 + sheets.size());
  EXPECT_EQ(found[0], folder.path() / "paper/C/consistent/11-1/sheet.ply");
  EXPECT_EQ(found[1], folder.path() / "paper/C/consistent/11-5/sheet.ply");
  EXPECT_EQ(std::vector<fs::path>(found.begin() + 2, found.end()), sheets);
  EXPECT_TRUE(files_in({folder.path()}).calibration.empty());
  EXPECT_TRUE(files_in({folder.path()}).repeats.empty());
  fs::create_directories(folder.path() / "nothing");
  EXPECT_THROW((void)files_in({folder.path() / "nothing"}).sheets, Error);
}

TEST(SheetFolders, AFolderThatFollowsAFileStaysInItsGroup) {
  const drape::test::TemporaryFolder folder;
  const auto sheets = test::write_example(folder.path() / "A");
  const fs::path simulations = folder.path() / "A" / "simulations";
  EXPECT_EQ(files_in({sheets[0], simulations}).sheets, sheets);
  const std::vector<fs::path> mixed = {sheets[0], sheets[3], sheets[1]};
  EXPECT_EQ(files_in({sheets[0], sheets[3], sheets[1].parent_path()}).sheets, mixed);
  const std::vector<fs::path> apart = {sheets[1], sheets[0]};
  EXPECT_EQ(files_in({sheets[1].parent_path(), sheets[0]}).sheets, apart);
}

/// A folder as `drape run` leaves it, with branches that its list does not name.
TEST(SheetFolders, WhatARunComparesIsFoundAsItsListsNameIt) {
  const drape::test::TemporaryFolder folder;
  const fs::path drape = folder.path() / "C";
  auto expected = test::write_example(drape);
  for (const char* name : {"branch-01", "branch-02", "branch-03"})
    write_sheet(drape / "ensemble" / name / "sheet.ply", test::simulated_sheet(11, 5));
  write_sheet(drape / "repeats" / "second" / "sheet.ply", test::measured_sheet());
  const fs::path branches = drape / "ensemble" / "branches.json";
  BranchList ensemble;
  for (const char* name : {"branch-02/sheet.ply", "branch-01/sheet.ply"}) {
    ensemble.branches.emplace_back().sheet = name;
    ensemble.branches.back().number = static_cast<int>(ensemble.branches.size());
  }
  write_record(branches, ensemble);
  EXPECT_EQ(files_in({folder.path()}).sheets, expected) << "its run has not ended";
  RunRecord record("drape-simulate", {}, run_record_path(branches));
  record.output(branches);
  record.write(0);
  expected.push_back(drape / "ensemble" / "branch-02" / "sheet.ply");
  expected.push_back(drape / "ensemble" / "branch-01" / "sheet.ply");
  EXPECT_EQ(files_in({folder.path()}).sheets, expected);
  EXPECT_EQ(files_in({folder.path()}).repeats,
            std::vector<fs::path>{drape / "repeats" / "second" / "sheet.ply"});
  fs::remove(drape / "ensemble" / "branch-01" / "sheet.json");
  EXPECT_THROW((void)files_in({folder.path()}).sheets, Error);
}

}  // namespace
}  // namespace drape::compare
