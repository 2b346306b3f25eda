// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdlib>

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Program : public testing::Test {
 protected:
  Program() : files_(test::write_example(folder_.path() / "A")) {}

  int run(const std::string& name, const std::string& arguments) {
    const std::string command = drape::test::program(name).string() + " " + arguments + " > " +
                                (folder_.path() / "out").string() + " 2>&1";
    const int status = std::system(command.c_str());
    output_ = read_text(folder_.path() / "out");
    return WEXITSTATUS(status);
  }
  int compare(const std::string& more = {}) {
    std::string arguments;
    for (const fs::path& file : files_) arguments += file.string() + " ";
    return run("drape-compare", arguments + "--store " + path("results.sqlite") + " --report " +
                                    path("report.html") + " " + more);
  }
  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_.path() / name).string();
  }

  drape::test::TemporaryFolder folder_;
  std::vector<fs::path> files_;
  std::string output_;
};

TEST_F(Program, EndsWithTheDrapesAndShowsOneWithItsTables) {
  ASSERT_EQ(compare(), 0) << output_;
  for (const char* text : {"GO: ", ", run 1", "\n  A  none ", " mm apart, U ", "\nreport  ",
                           "report.html\nnext    drape results show 1 --store "})
    EXPECT_THAT(output_, HasSubstr(text));
  for (const char* made : {"results.sqlite", "report.html", "report.json", "report.run.json",
                           "report/A-real.vtp", "report/A-marks.csv"})
    EXPECT_TRUE(fs::is_regular_file(path(made))) << made;
  EXPECT_FALSE(fs::exists(path("results.sqlite-wal")));
  ASSERT_EQ(run("drape-results", "show 1 A --store " + path("results.sqlite")), 0) << output_;
  for (const char* text : {"Real vs virtual, experiment A", "Virtual vs virtual, experiment A",
                           "5 seg: 11x11 vs 21x21", "119 measured, 2 gaps"})
    EXPECT_THAT(output_, HasSubstr(text));
  ASSERT_EQ(run("drape-results", "show 1 --store " + path("results.sqlite")), 0) << output_;
  EXPECT_THAT(output_, HasSubstr(" mm apart, U "));
  fs::remove(path("report.json"));
  ASSERT_EQ(run("drape-results", "show 1 --store " + path("results.sqlite")), 0) << output_;
  EXPECT_THAT(output_, HasSubstr("mean_dist_mm"));
}

TEST_F(Program, JsonSaysTheSame) {
  ASSERT_EQ(compare("--json"), 0) << output_;
  const Json json = parse_json(output_);
  EXPECT_EQ(json["verdict"], "GO");
  const Json& drape = json["drapes"][0];
  EXPECT_EQ(drape["simulations"].size(), 4U);
  EXPECT_TRUE(drape["distance"]["mean_mm"].is_number());
  const Json kept = parse_json(read_text(path("report.json")));
  EXPECT_EQ(kept["drapes"], json["drapes"]);
  std::map<std::string, std::size_t> rows;
  for (const Json& table : drape["tables"]) rows[table["name"]] = table["rows"].size();
  EXPECT_EQ(rows["folds"], 4U) << "each simulated sheet is a whole grid";
  EXPECT_GT(rows["waves"], 0U);
  EXPECT_EQ(rows["virtual-vs-virtual"], 4U);
}

TEST_F(Program, ASplitThatIsLeftOutIsNamedByTheRecordSoThatAnotherIsCompared) {
  const std::string split = path("A/simulations/21-5/sensitivity.json");
  write_json(split, {{"schema", "drapebench/sensitivity/1"}});
  for (int time = 0; time < 2; ++time) {
    ASSERT_EQ(compare("--sensitivity " + split), 0) << output_;
    EXPECT_THAT(output_, HasSubstr("so it is left out; simulate the drape again"));
    EXPECT_THAT(read_text(path("report.run.json")), HasSubstr(sha256_of_file(split)));
    write_json(split, {{"schema", "drapebench/sensitivity/1"}, {"marks", 1}});
  }
  const std::string others = path("B/sensitivity/sensitivity.json");
  fs::create_directories(path("B/sensitivity"));
  fs::rename(split, others);
  EXPECT_EQ(compare("--sensitivity " + others), 3) << output_;
  EXPECT_THAT(output_, HasSubstr("the simulation of this sensitivity.json is not given"));
  EXPECT_EQ(compare("--sensitivity " + split), 3) << output_;
}

TEST_F(Program, SheetsThatFollowAFileOfAFlagAreComparedToo) {
  const std::string split = path("A/simulations/21-5/sensitivity.json");
  write_json(split, {{"schema", "drapebench/sensitivity/1"}});
  std::string arguments = "--json";
  for (const fs::path& file : files_)
    arguments += " --sensitivity " + split + " --warning odd " + file.string();
  ASSERT_EQ(run("drape-compare", arguments), 0) << output_;
  EXPECT_EQ(parse_json(output_)["drapes"][0]["simulations"].size(), 4U);
}

TEST_F(Program, AFlagOfAnotherGroupTakesOneFileSoThatItSwallowsNone) {
  const std::string simulated = files_[1].string();
  EXPECT_NE(run("drape-compare repeats", "--compare " + simulated + " " + files_[0].string()), 2)
      << output_;
  Sheet whole = test::measured_sheet(), wider = whole, bent = whole;
  for (SheetMark& mark : wider.marks) mark.point_in_world *= 1.01;
  for (SheetMark& mark : bent.marks) mark.point_in_world.z() += mark.material_m.y() * 0.1;
  write_sheet(path("a.ply"), whole);
  write_sheet(path("b.ply"), wider);
  write_sheet(path("c.ply"), bent);
  const std::string others = path("a.ply") + " " + path("b.ply");
  ASSERT_EQ(run("drape-compare drapemeter", "--disc-mm 90 --compare " + simulated + " " + others),
            0)
      << output_;
  EXPECT_THAT(output_, HasSubstr("2 hems measured"));
}

TEST_F(Program, WarningsOfTheStagesAreSaidAndStored) {
  ASSERT_EQ(compare("--warning='detect (drape A): cam1 is dim'"), 0) << output_;
  EXPECT_THAT(output_, HasSubstr("  warning: detect (drape A): cam1 is dim"));
  ASSERT_EQ(run("drape-results",
                "--csv sql \"SELECT value FROM run_value WHERE key = 'warning'\""
                " --store " +
                    path("results.sqlite")),
            0);
  EXPECT_THAT(output_, HasSubstr("cam1 is dim"));
}

TEST_F(Program, TwoRunsGiveTheSameBytes) {
  ASSERT_EQ(compare("--threads 1"), 0);
  const std::string store = sha256_of_file(path("results.sqlite")),
                    report = sha256_of_file(path("report.html"));
  ASSERT_EQ(compare("--threads 2"), 0);
  EXPECT_EQ(sha256_of_file(path("results.sqlite")), store);
  EXPECT_EQ(sha256_of_file(path("report.html")), report);
}

TEST_F(Program, ExitCodes) {
  EXPECT_EQ(compare("--min-marks 120"), 1);
  EXPECT_THAT(output_, HasSubstr("NO-GO: A: only 119 marks"));
  EXPECT_EQ(compare("--max-sigma-percent 0"), 2);
  EXPECT_EQ(run("drape-compare", ""), 2);
  EXPECT_EQ(run("drape-compare", path("none.ply")), 3);
  EXPECT_THAT(output_, HasSubstr("none"));
  EXPECT_EQ(run("drape-compare", files_[0].string() + " --store /proc/none/results.sqlite"), 3);
  EXPECT_THAT(output_, HasSubstr("/proc/none/"));
}

TEST_F(Program, SimulationsThatAreNoGoAreNoGoWithoutARealClothToo) {
  const std::string pair =
      files_[1].string() + " " + files_[2].string() + " --store " + path("pairs.sqlite");
  const auto stored = [&] {
    EXPECT_EQ(run("drape-results",
                  "--quiet --json sql 'SELECT count(*) AS n FROM simulation_pair' --store " +
                      path("pairs.sqlite")),
              0);
    return parse_json(output_)[0]["n"].get<int>();
  };
  Sheet sheet = read_sheet(files_[1]);
  sheet.no_go = "cam1 moved";
  write_sheet(files_[1], sheet);
  EXPECT_EQ(run("drape-compare", pair), 1);
  EXPECT_THAT(output_, HasSubstr("NO-GO: A: simulation 11x11, 1 segment was placed by a sheet"));
  EXPECT_THAT(output_, HasSubstr("are not stored"));
  EXPECT_EQ(stored(), 0);
  sheet.no_go.reset();
  std::get<SimulatedSource>(sheet.source).status = "time is up";
  write_sheet(files_[1], sheet);
  EXPECT_EQ(run("drape-compare", pair), 1);
  EXPECT_THAT(output_, HasSubstr("NO-GO: A: simulation 11x11, 1 segment: time is up"));
  EXPECT_EQ(run("drape-compare", pair + " --accept-unsettled"), 0) << output_;
  EXPECT_EQ(stored(), 1);
}

TEST_F(Program, ARefusedAcceptanceInTheStoreIsHeeded) {
  Json json;
  json["schema"] = "drapebench/acceptance/1";
  json["rig"] = "bench";
  json["calibration_sha256"] = sha256_of(std::string_view("calibration"));
  json["date"] = json["valid_until"] = "2026-06-30";
  json["positions"] = 9;
  json["go"] = false;
  json["cause"] = "cam1 moved";
  json["figures"] = Json::array();
  write_json(path("acceptance.json"), json);
  EXPECT_EQ(compare("--acceptance " + path("acceptance.json")), 1);
  EXPECT_EQ(compare(), 1);
  EXPECT_THAT(output_, HasSubstr("the acceptance of this calibration is NO-GO: cam1 moved"));
}

TEST_F(Program, AReportNeverReplacesWhatItIsMadeOf) {
  const fs::path sheet = folder_.path() / "A/sheet.json";
  const std::string before = read_text(sheet);
  EXPECT_EQ(run("drape-compare", files_[0].string() + " " + files_[1].string() + " --report " +
                                     sheet.string() + " --store " + path("other.sqlite")),
            2);
  EXPECT_THAT(output_, HasSubstr("the report would replace"));
  EXPECT_EQ(read_text(sheet), before);
  EXPECT_FALSE(fs::exists(path("other.sqlite")));
}

TEST_F(Program, ATableOfHemsIsNeverWrittenOverOneThatIsRead) {
  std::string table = "fabric", row = "wool";
  for (int angle = 0; angle < 360; angle += 5) {
    table += fmt::format(",r{:03}", angle);
    row += fmt::format(",{:.3f}", 110 + 10 * std::cos(6 * angle * units::deg));
  }
  write_durable(path("radii.csv"), table + "\n" + row + "\n");
  const std::string out = " --scale-u-percent 1 --out " + path("o");
  ASSERT_EQ(run("drape-compare drapemeter", path("radii.csv") + out), 0) << output_;
  const std::string hems = read_text(path("o/hems.csv")),
                    record = read_text(path("o/hems.run.json"));
  for (const std::string& input :
       {path("o/hems.csv"), path("radii.csv") + " --compare " + path("o/../o/hems.csv")}) {
    EXPECT_EQ(run("drape-compare drapemeter", input + out), 2) << output_;
    EXPECT_THAT(output_, HasSubstr("would be written over"));
    EXPECT_EQ(read_text(path("o/hems.csv")), hems);
    EXPECT_EQ(read_text(path("o/hems.run.json")), record);
  }
}

TEST_F(Program, NothingIsWrittenOverEitherFileOfASheet) {
  write_sheet(path("a.ply"), test::measured_sheet());
  const std::string ply = read_text(path("a.ply")), json = read_text(path("a.json"));
  for (const char* out : {"a.json", "a.ply"})
    for (const char* named : {"a.ply", "a.json"}) {
      EXPECT_EQ(run("drape-compare repeats", path(named) + " --out " + path(out)), 2) << output_;
      EXPECT_THAT(output_, HasSubstr("would be written over"));
    }
  EXPECT_EQ(read_text(path("a.ply")), ply);
  EXPECT_EQ(read_text(path("a.json")), json);
}

TEST_F(Program, AMistypedInputLeavesTheOlderResultWithItsRecord) {
  const std::string out = path("repeats.json"), record = path("repeats.run.json");
  const std::string pair = files_[0].string() + " --compare " + files_[1].string() + " --out ";
  ASSERT_EQ(run("drape-compare repeats", pair + out), 0) << output_;
  const std::string repeats = read_text(out), made = read_text(record);
  EXPECT_EQ(run("drape-compare repeats", path("none.ply") + " --out " + out), 3) << output_;
  EXPECT_EQ(read_text(out), repeats);
  EXPECT_EQ(read_text(record), made);
}

TEST_F(Program, WhatIsNotAsItsRecordSaysIsRefused) {
  RunRecord record("drape-simulate", {}, run_record_path(files_[1]));
  record.output(fs::path(files_[1]).replace_extension(".json"));
  record.write(0);
  EXPECT_EQ(run("drape-compare drapemeter", files_[1].string() + " --disc-mm 90"), 0) << output_;
  Sheet sheet = read_sheet(files_[1]);
  std::get<SimulatedSource>(sheet.source).fabric = "another";
  write_sheet(files_[1], sheet);
  const std::string split = path("A/simulations/11-5/sensitivity.json");
  write_json(split, {{"schema", "drapebench/sensitivity/1"}});
  RunRecord of_split("drape-simulate", {}, run_record_path(split));
  of_split.output(split);
  of_split.write(0);
  write_json(split, {{"schema", "drapebench/sensitivity/1"}, {"marks", 1}});
  const std::string first = files_[0].string(), second = files_[1].string();
  for (const auto& [program, arguments] :
       {std::pair("drape-compare repeats", first + " --compare " + second),
        std::pair("drape-compare drapemeter", second + " --disc-mm 90"),
        std::pair("drape-compare", first + " " + files_[2].string())}) {
    EXPECT_EQ(run(program, arguments), program == std::string("drape-compare drapemeter") ? 1 : 3)
        << program << output_;
    EXPECT_THAT(output_, HasSubstr("this file is not the one that its run wrote")) << program;
  }
}

TEST_F(Program, NothingIsWrittenOverTheStoreThatIsAsked) {
  ASSERT_EQ(compare(), 0);
  const std::string store = " --store " + path("results.sqlite");
  const auto bytes = read_bytes(path("results.sqlite"));
  fs::create_symlink(path("results.sqlite"), path("link"));
  for (const char* command : {"export sql", "export json", "export csv", "history"})
    for (const char* out : {"results.sqlite", "results.sqlite.sig", "results.sqlite-wal", "link"}) {
      EXPECT_EQ(run("drape-results", std::string(command) + store + " --out " + path(out)), 2);
      EXPECT_THAT(output_, HasSubstr("--out"));
    }
  EXPECT_EQ(compare("--report " + path("results.sqlite")), 2);
  EXPECT_EQ(read_bytes(path("results.sqlite")), bytes);
  EXPECT_EQ(run("drape-results", "history" + store + " --out " + path("results.sqlite.html")), 0);
}

TEST_F(Program, ResultsHeedEachOptionOrRefuseIt) {
  ASSERT_EQ(compare(), 0);
  const std::string store = " --store " + path("results.sqlite");
  for (const char* wrong :
       {"export csv --table run_drape --run 7", "export sql --table run", "export json --about x",
        "trend --by fabric --sigmas 2", "tables --paper --grid 21"}) {
    EXPECT_EQ(run("drape-results", wrong + store), 2) << wrong;
    EXPECT_EQ(output_.find("GO"), std::string::npos) << output_;
  }
  EXPECT_EQ(run("drape-results", "--json export csv --table metric --out " + path("x") + store), 0);
  EXPECT_THAT(read_text(path("x")), testing::StartsWith("name,unit,definition"));
  EXPECT_EQ(run("drape-results", "--csv export json --table metric" + store), 0);
  EXPECT_TRUE(parse_json(output_).is_array());
  EXPECT_EQ(run("drape-results", "--json tables --grid 21 --segments 5" + store), 0);
  EXPECT_EQ(parse_json(output_).at(0).at("rows").size(), 1U) << "one table as several";
  EXPECT_EQ(run("drape-results", "--csv tables" + store), 0);
  EXPECT_THAT(output_,
              HasSubstr("table,discretisation,segments,mean_dist_mm\n\"Real vs virtual (exp"));
  EXPECT_THAT(output_, HasSubstr("\n\ntable,pair,mean_dist_mm\n\"Virtual vs virtual (exp"));
  EXPECT_EQ(run("drape-results", "import " + files_[1].string() + " " + files_[2].string() +
                                     " --store " + path("pairs.sqlite")),
            0);
  EXPECT_THAT(output_, HasSubstr("next: drape results tables --store"));
}

TEST_F(Program, ResultsAnswers) {
  ASSERT_EQ(compare(), 0);
  const std::string store = " --store " + path("results.sqlite");
  EXPECT_EQ(run("drape-results", "list --grid 21" + store), 0);
  EXPECT_THAT(output_, HasSubstr("mean_dist_mm"));
  EXPECT_EQ(run("drape-results", "tables" + store), 0);
  EXPECT_THAT(output_, HasSubstr("1 seg: 11x11 vs 21x21"));
  EXPECT_EQ(
      run("drape-results", "--quiet --json sql 'SELECT count(*) AS n FROM comparison'" + store), 0);
  EXPECT_EQ(parse_json(output_)[0]["n"], 4);
  EXPECT_EQ(run("drape-results", "export csv --table metric" + store), 0);
  EXPECT_THAT(output_, HasSubstr("name,unit,definition,better"));
  EXPECT_EQ(run("drape-results", "sql 'DROP TABLE rig'" + store), 2);
  EXPECT_EQ(run("drape-results", "list --store " + path("none.sqlite")), 3);
}

}  // namespace
}  // namespace drape::compare
