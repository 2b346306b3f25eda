// SPDX-License-Identifier: Apache-2.0

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <stdlib.h>

#include "compare/report/report.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A bench with one drape whose scene an operator edits between runs.
class Runs : public testing::Test {
 protected:
  Runs() : sheets_(test::write_example(folder_.path() / "A")) {
    const fs::path bench = drape::test::source_root() / "rigs/bench1";
    for (const char* name : {"scenes", "fabrics"})
      fs::copy(bench / name, folder_.path() / name, fs::copy_options::recursive);
  }
  ~Runs() override { ::unsetenv("SOURCE_DATE_EPOCH"); }

  [[nodiscard]] fs::path store() const { return folder_.path() / "results.sqlite"; }

  [[nodiscard]] fs::path scene() const { return folder_.path() / "scenes" / "A.toml"; }

  /// The sheets with their scene and one photograph.
  [[nodiscard]] Session session() const {
    Session session = read_session(sheets_, {});
    DrapeFiles& drape = session.drapes[0];
    drape.input.scene = read_scene(scene());
    FrameDetections frame;
    frame.set = std::get<MeasuredSource>(drape.input.measured.sheet.source).set;
    frame.camera = "cam0";
    frame.image_sha256 = "a photograph";
    drape.recording = RecordingId{sha256_of("recording.json"), "2026-02-28", "recording"};
    drape.detections = Detections{};
    drape.detections->frames.push_back(frame);
    return session;
  }

  /// Stores the content of the folder as one run at a given time (s since 1970).
  int run(const char* moment, const RunLabel& label = {}, fs::path file = {},
          const Options& options = {}) {
    ::setenv("SOURCE_DATE_EPOCH", moment, 1);
    if (file.empty()) file = store();
    const Session session = this->session();
    Outcome outcome;
    compare_session(session, options, outcome);
    static_cast<void>(import_session(file, session, outcome, label));
    return outcome.run;
  }

  /// State and grid of each comparison, independent of its number.
  static std::vector<std::vector<std::string>> states(const fs::path& file) {
    return StoreReader(file)
        .query(
            "SELECT c.discretisation, c.segments, s.state, s.date FROM v_comparison AS c JOIN "
            "v_state "
            "AS s ON s.comparison_id = c.id ORDER BY 1, 2, 3, 4")
        .rows;
  }

  [[nodiscard]] std::string one(const std::string& sql) const {
    return test::one(StoreReader(store()), sql);
  }

  drape::test::TemporaryFolder folder_;
  std::vector<fs::path> sheets_;
};

constexpr const char* kMarch = "1772323200";  // 2026-03-01
constexpr const char* kMay = "1777593600";    // 2026-05-01

TEST_F(Runs, ARunIsOneRowWithItsDateLabelAndVerdicts) {
  EXPECT_EQ(run(kMarch, {"before washing", "A. Miller"}), 1);
  const Table runs = list_runs(StoreReader(store()), {});
  ASSERT_EQ(runs.rows.size(), 1U);
  EXPECT_EQ(one("SELECT date FROM run"), "2026-03-01T00:00:00Z");
  EXPECT_EQ(one("SELECT label || operator FROM run"), "before washingA. Miller");
  EXPECT_EQ(one("SELECT measurement FROM run"), "GO");
  EXPECT_EQ(one("SELECT match FROM run_drape"), "none") << "neither repeats nor a tolerance";
  EXPECT_EQ(one("SELECT count(*) FROM run_drape WHERE match_limit_mm IS NULL"), "1");
  EXPECT_NE(one("SELECT count(*) FROM run_value WHERE owner = 'scene A'"), "0");
}

TEST_F(Runs, TheSameContentIsTheSameRunAndItsDateStays) {
  EXPECT_EQ(run(kMarch), 1);
  EXPECT_EQ(run(kMay), 1);
  EXPECT_EQ(one("SELECT count(*) || date FROM run"), "12026-03-01T00:00:00Z");
  EXPECT_EQ(run(kMay, {"again", ""}), 2) << "another label is another run";
}

TEST_F(Runs, DatesFilterRunsAndComparisons) {
  run(kMarch);
  run(kMay, {"later", ""});
  const StoreReader reader(store());
  EXPECT_EQ(list_runs(reader, {.since = "2026-03-02"}).rows.size(), 1U);
  EXPECT_EQ(list_runs(reader, {.until = "2026-03-01"}).rows.size(), 1U);
  EXPECT_EQ(list_results(reader, {.since = "2026-06-01"}).rows.size(), 0U);
  EXPECT_GT(list_results(reader, {.since = "2026-05-01"}).rows.size(), 0U);
  for (const char* until : {"2026", "2026-05", "2026-05-01"}) {
    EXPECT_EQ(list_results(reader, {.until = until}).rows.size(), 4U) << until;
    EXPECT_EQ(list_runs(reader, {.until = until}).rows.size(), 2U) << until;
  }
  // Stored in a run of March and again in one of May: up to April it is March's.
  EXPECT_EQ(list_results(reader, {.until = "2026-04"}).rows.size(), 0U);
  const Table march = list_results(reader, {.until = "2026-04", .outdated = true});
  ASSERT_EQ(march.rows.size(), 4U);
  EXPECT_EQ(march.rows[0][2], "2026-03-01");
  EXPECT_EQ(march.rows[0][4], "superseded");
  for (const char* date : {"2026-02-29", "2026-02-30", "2026-04-31"}) {
    EXPECT_THROW((void)list_results(reader, {.since = date}), Error) << date;
    EXPECT_THROW((void)list_runs(reader, {.until = date}), Error) << date;
  }
}

TEST_F(Runs, ATimeThatIsNoneIsRefusedBeforeAnythingIsStored) {
  for (const char* moment : {"", "today", "-1", "12h", "99999999999999999"}) {
    EXPECT_THROW(run(moment), Error) << moment;
    EXPECT_FALSE(fs::exists(store())) << moment;
  }
  EXPECT_EQ(run("0"), 1);
}

TEST_F(Runs, AComparisonIsNeverStoredWithoutItsRun) {
  Session session = this->session();
  session.drapes.push_back(session.drapes[0]);  // a run cannot contain one drape twice
  Outcome outcome;
  compare_session(session, {}, outcome);
  EXPECT_THROW((void)import_session(store(), session, outcome, {}), Error);
  EXPECT_EQ(one("SELECT count(*) FROM comparison"), "0");
  const fs::path copy = folder_.path() / "A.bak";
  fs::copy(sheets_[0].parent_path(), copy, fs::copy_options::recursive);
  try {
    (void)read_session(files_in({folder_.path()}).sheets, {});
    FAIL() << "a copied folder is another drape";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_THAT(error.what(), HasSubstr("A.bak"));
  }
}

TEST_F(Runs, ADifferenceNamesTheValueThatWasChanged) {
  run(kMarch);
  std::string text = read_text(scene());
  const auto at = text.find("friction = 0.4");
  ASSERT_NE(at, std::string::npos);
  write_durable(scene(), text.replace(at, 14, "friction = 0.25"));
  EXPECT_EQ(run(kMay), 2);
  const Answer found = difference_of_runs(StoreReader(store()), 1, 2);
  EXPECT_THAT(found.sentence, HasSubstr("scene A friction 0.4 -> 0.25"));
  const Table trend = trend_by(StoreReader(store()), "friction");
  EXPECT_EQ(trend.rows.front()[1], "0.25");
  EXPECT_EQ(trend.rows.back()[1], "0.4");
  EXPECT_THROW((void)difference_of_runs(StoreReader(store()), 1, 7), Error);
  EXPECT_THROW((void)trend_by(StoreReader(store()), "frictoin"), Error);
}

TEST_F(Runs, ATrendByAValueSetsApartWhatDiffersInAnother) {
  const auto type = [&](const std::string& from, const std::string& to) {
    std::string text = read_text(scene());
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_durable(scene(), text.replace(at, from.size(), to));
  };
  run(kMarch);
  type("friction = 0.4", "friction = 0.25");
  run(kMay);
  type("friction = 0.25", "friction = 0.3");
  type("clearance_mm = 3", "clearance_mm = 5");
  run("1780272000");  // 2026-06-01
  const Table trend = trend_by(StoreReader(store()), "friction");
  const std::size_t series = *trend.column("series"), otherwise = *trend.column("otherwise");
  std::map<std::string, std::string> series_of, otherwise_of;
  for (const auto& row : trend.rows) {
    series_of[row[1]] = row[series];
    otherwise_of[row[1]] = row[otherwise];
  }
  EXPECT_EQ(series_of["0.4"], series_of["0.25"]);
  EXPECT_NE(series_of["0.3"], series_of["0.4"]);
  EXPECT_THAT(otherwise_of["0.3"] + otherwise_of["0.4"], HasSubstr("clearance_mm"));
}

TEST_F(Runs, WhatALaterRunOfTheSamePhotographsReplacedIsLeftOut) {
  run(kMarch);
  const std::size_t before = list_results(StoreReader(store()), {}).rows.size();
  sheets_.pop_back();  // the later run has one simulation fewer
  run(kMay);
  const StoreReader reader(store());
  EXPECT_EQ(list_results(reader, {}).rows.size(), before - 1);
  EXPECT_EQ(list_results(reader, {.outdated = true}).rows.size(), before);
  EXPECT_EQ(one("SELECT state FROM v_outdated"), "superseded");
}

TEST_F(Runs, TheLatestDateIsTheLastWordInWhateverOrderRunsWereStored) {
  const fs::path march = folder_.path() / "march.sqlite", may = folder_.path() / "may.sqlite";
  run(kMarch, {}, march);
  const fs::path last = sheets_.back();
  sheets_.pop_back();
  run(kMay, {}, may);
  run(kMay);
  sheets_.push_back(last);
  EXPECT_EQ(run(kMarch), 2) << "a run of March, stored after that of May";
  const auto expected = states(store());
  ASSERT_EQ(expected.size(), 4U);
  EXPECT_EQ(expected[0],
            (std::vector<std::string>{"11x11", "1", "current", "2026-05-01T00:00:00Z"}));
  EXPECT_EQ(expected[3],
            (std::vector<std::string>{"21x21", "5", "superseded", "2026-03-01T00:00:00Z"}));
  const fs::path both = folder_.path() / "both.sqlite", copy = folder_.path() / "copy.sqlite";
  (void)merge_stores(both, {march, may});
  fs::copy_file(may, copy);
  (void)merge_stores(copy, {march});
  (void)merge_stores(march, {may});
  for (const fs::path& merged : {both, copy, march}) EXPECT_EQ(states(merged), expected) << merged;
}

TEST_F(Runs, AnEarlierStateThatIsStoredAgainIsTheLastWordAgain) {
  EXPECT_EQ(run(kMarch), 1);
  const fs::path last = sheets_.back();
  sheets_.pop_back();
  EXPECT_EQ(run(kMay), 2);
  EXPECT_EQ(list_results(StoreReader(store()), {}).rows.size(), 3U);
  sheets_.push_back(last);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(run(kMay), 1) << "the same content";
    const Table list = list_results(StoreReader(store()), {});
    ASSERT_EQ(list.rows.size(), 4U);
    EXPECT_EQ(list.rows[0][1], "1");
    EXPECT_EQ(list.rows[0][2], "2026-05-01");
    EXPECT_EQ(one("SELECT count(*) FROM run_repetition"), "1") << "again adds nothing";
  }
  sheets_.pop_back();
  EXPECT_EQ(run(kMay), 2) << "and back within one second";
  EXPECT_EQ(list_results(StoreReader(store()), {}).rows.size(), 3U);
  EXPECT_EQ(list_results(StoreReader(store()), {.since = "2026-05", .outdated = true}).rows.size(),
            4U);
  EXPECT_THAT(altered_rows(StoreReader(store())), testing::IsEmpty());
  const fs::path merged = folder_.path() / "merged.sqlite";
  (void)merge_stores(merged, {store()});
  EXPECT_EQ(states(merged), states(store()));
}

TEST_F(Runs, EachRunKeepsItsOwnVerdict) {
  Options strict;
  strict.max_sigma_ratio = 1e-9;
  strict.tolerance_m = 1e-3;
  run(kMarch, {"strict", ""}, {}, strict);
  EXPECT_FALSE(history_page(StoreReader(store()), {}).go);
  run(kMay, {"lax", ""});
  const StoreReader reader(store());
  EXPECT_TRUE(history_page(reader, {}).go);
  const Table first = list_results(reader, {.run = 1}), second = list_results(reader, {.run = 2});
  ASSERT_EQ(first.rows.size(), 4U);
  EXPECT_EQ(first.rows[0][3], "NO-GO");
  EXPECT_EQ(first.rows[0][4], "superseded");
  EXPECT_THAT(first.rows[0].back(), HasSubstr("uncertainty of a mark"));
  EXPECT_EQ(second.rows[0][3], "GO");
  const auto tables = paper_tables(reader, {.run = 1});
  EXPECT_THAT(tables.at(0).title, HasSubstr("run 1 of 2026-03-01: measurement NO-GO"));
  EXPECT_EQ(tables.at(1).rows.size(), 4U);
  EXPECT_THROW((void)paper_tables(reader, {.run = 99}), Error);
  EXPECT_THROW((void)list_results(reader, {.run = 99}), Error);
}

TEST_F(Runs, PairsOfSheetsThatWereReplacedAreLeftOutOfTheTables) {
  run(kMarch);
  ASSERT_EQ(paper_tables(StoreReader(store()), {}).at(1).rows.size(), 4U);
  sheets_.pop_back();
  run(kMay);
  const StoreReader reader(store());
  EXPECT_EQ(paper_tables(reader, {}).at(1).rows.size(), 2U);
  EXPECT_EQ(paper_tables(reader, {.outdated = true}).at(1).rows.size(), 4U);
  EXPECT_EQ(paper_tables(reader, {.run = 1}).at(1).rows.size(), 4U);
  EXPECT_EQ(one("SELECT count(*) FROM v_table2"), "2");
  const fs::path paper = drape::test::source_root() / "rigs/paper/published.csv";
  EXPECT_EQ(published_tables(reader, paper.string()).at(0).rows.at(0).at(3), "") << "21x21, 5";
  EXPECT_EQ(one("SELECT count(*) FROM v_virtual_vs_virtual WHERE state = 'superseded'"), "2");
}

TEST_F(Runs, WhatALaterRunCallsOtherwiseOrLacksIsLeftOutAndNamed) {
  run(kMarch);
  {
    SQLite::Database database(store().string(), SQLite::OPEN_READWRITE);
    const auto later = [&](int number, const char* scene, const char* pictures,
                           const char* recording = "recording_sha256") {
      database.exec(fmt::format(
          "INSERT INTO run SELECT {0}, substr('{0}' || sha256, 1, 64), '2026-04-0{0}', label, "
          "operator, program_version, rig_name, {1}, recording_name, calibration_sha256, "
          "calibration_name, measurement, cause FROM run WHERE number = 1",
          number, recording));
      database.exec(fmt::format(
          "INSERT INTO run_drape SELECT {}, measured_sha256, '{}', set_name, {}, measurement, "
          "cause, match, match_reason, headline_sha256, expanded_uncertainty_mm, budget_complete, "
          "match_limit_mm "
          "FROM run_drape WHERE run = 1",
          number, scene, pictures));
    };
    later(2, "other", "'0'", "'another'");
    EXPECT_EQ(one("SELECT DISTINCT state FROM v_state"), "current")
        << "other photographs in a folder of the same name";
    later(3, "other", "'0'");
    EXPECT_EQ(one("SELECT DISTINCT state FROM v_state"), "removed");
    later(4, "A2", "pictures_sha256");
    EXPECT_EQ(one("SELECT DISTINCT state FROM v_state"), "renamed");
    later(5, "A", "pictures_sha256");
  }
  EXPECT_EQ(one("SELECT DISTINCT state FROM v_state"), "superseded");
  const StoreReader reader(store());
  EXPECT_EQ(list_results(reader, {}).rows.size(), 0U);
  EXPECT_GT(list_results(reader, {.run = 1}).rows.size(), 0U);
}

TEST_F(Runs, OnlyWhatIsAskedForIsJudged) {
  run(kMarch);
  const StoreReader reader(store());
  const auto plan = [&](const std::string& query) {
    std::string text;
    for (const auto& row : reader.query("EXPLAIN QUERY PLAN " + query).rows) text += row[3] + "\n";
    return text;
  };
  const std::string of_few =
      plan(std::string("SELECT * FROM v_comparison AS v JOIN (") + state_query() +
           ") AS s ON s.comparison_id = v.id WHERE v.id IN (1, 2)");
  EXPECT_THAT(of_few, testing::Not(HasSubstr("SCAN c\n")));
  EXPECT_THAT(of_few, HasSubstr("s USING COVERING INDEX simulation_in_short"));
  EXPECT_THAT(plan("SELECT * FROM v_run_drape"),
              HasSubstr("s USING COVERING INDEX simulation_in_short"));
  EXPECT_THAT(plan("SELECT * FROM v_branches"), HasSubstr("SCAN b\n"));
}

TEST_F(Runs, AMeasurementThatIsNoGoIsNoGoInEveryList) {
  Session session = this->session();
  session.drapes[0].input.measured.sheet.no_go = "the calibration is NO-GO: pitch_mm";
  Outcome outcome;
  compare_session(session, {}, outcome);
  EXPECT_FALSE(outcome.go());
  static_cast<void>(import_session(store(), session, outcome, {}));
  const StoreReader reader(store());
  EXPECT_EQ(one("SELECT DISTINCT measurement FROM v_state"), "NO-GO");
  EXPECT_EQ(one("SELECT match FROM run_drape"), "undecided");
  for (const char* view : {"v_real_vs_virtual", "v_virtual_vs_virtual", "v_table1", "v_table2"})
    EXPECT_EQ(one(std::string("SELECT DISTINCT measurement FROM ") + view), "NO-GO") << view;
  const std::string key = list_results(reader, {}).rows.at(0).at(0);
  using Row = std::vector<std::string>;
  EXPECT_THAT(show_result(reader, key).tables[1].rows,
              testing::Contains(Row{"measurement", "NO-GO"}));
  const HistoryPage page = history_page(reader, {});
  EXPECT_FALSE(page.go);
  EXPECT_THAT(page.html, HasSubstr("\"go\":false"));
  EXPECT_THAT(page.html, HasSubstr("pitch_mm"));
  EXPECT_THAT(paper_tables(reader, {}).at(0).title, HasSubstr("pitch_mm"));
  EXPECT_THAT(one("SELECT cause FROM run"), HasSubstr("pitch_mm"));
}

void write_repeat(const fs::path& file, const Sheet& sheet, const std::string& scene,
                  const std::string& repeat, const std::string& face) {
  write_sheet(file, sheet);
  const fs::path json = fs::path(file).replace_extension(".json");
  Json root = parse_json(read_text(json));
  root["source"]["repeat"] = {{"scene", scene}, {"repeat", repeat}, {"face", face}};
  write_json(json, root);
}

/// The basis of a match is stored with its figures, listed, and part of the run's key.
TEST_F(Runs, RepeatsOfADrapeAreStoredWithWhatTheySay) {
  ASSERT_EQ(run(kMarch), 1);
  EXPECT_EQ(one("SELECT rests_on FROM run_match"), "");
  EXPECT_EQ(one("SELECT repeats FROM run_match"), "1");
  EXPECT_EQ(one("SELECT count(*) FROM real_repeat"), "0");
  std::vector<fs::path> repeats;
  for (int i = 2; i <= 4; ++i) {
    Sheet sheet = read_sheet(sheets_[0]);
    std::get<MeasuredSource>(sheet.source).set = "again_" + std::to_string(i);
    for (SheetMark& mark : sheet.marks) {
      mark.point_in_world.z() += 1e-3 * i;
      mark.point_in_world.x() *= 1 + 0.01 * i;
    }
    repeats.push_back(folder_.path() / ("again" + std::to_string(i)) / "sheet.ply");
    write_repeat(repeats.back(), sheet, "A", std::to_string(i), i < 4 ? "" : "back");
  }
  const Session session = read_session(sheets_, {}, repeats);
  Outcome outcome;
  compare_session(session, {}, outcome);
  static_cast<void>(import_session(store(), session, outcome, {}));
  ASSERT_EQ(outcome.run, 2) << "repeats make another run";
  EXPECT_EQ(one("SELECT rests_on FROM run_match WHERE repeats = 3"), "3 repeats");
  EXPECT_EQ(one("SELECT group_concat(basis, ', ') FROM match_basis WHERE p IS NOT NULL"),
            "repeats, repeats: area, repeats: hem, repeats: marks, repeats: spectrum");
  EXPECT_EQ(one("SELECT match_limit_mm > 0 FROM run_drape WHERE run = 2"), "1");
  EXPECT_EQ(one("SELECT set_name FROM real_repeat WHERE face = 'back' AND left_out IS NOT NULL"),
            "again_4");
  EXPECT_EQ(one("SELECT from_own_rms_mm > 3 FROM real_repeat WHERE repeat = '3'"), "1");
  EXPECT_EQ(one("SELECT match_rests_on FROM v_run_drape WHERE run = 2"), "3 repeats");
  EXPECT_THAT(list_runs(StoreReader(store()), {}).rows[1][5], HasSubstr("by 3 repeats"));
  EXPECT_THAT(paper_tables(StoreReader(store()), {}).at(0).title, HasSubstr("by 3 repeats"));
  EXPECT_TRUE(altered_rows(StoreReader(store())).empty());
}

TEST_F(Runs, ARepeatOfNoDrapeIsRefused) {
  const Sheet sheet = read_sheet(sheets_[0]);
  const fs::path file = folder_.path() / "again" / "sheet.ply";
  write_sheet(file, sheet);
  EXPECT_THROW((void)read_session(sheets_, {}, {file}), Error) << "it does not say that it is one";
  write_repeat(file, sheet, "B", "2", "");
  EXPECT_THROW((void)read_session(sheets_, {}, {file}), Error) << "no drape B";
  Sheet again = sheet;
  again.marks[0].point_in_world.z() += 1e-3;
  write_repeat(file, again, "A", "2", "");
  EXPECT_THROW((void)read_session(sheets_, {}, {file, file}), Error) << "twice";
  EXPECT_EQ(read_session(sheets_, {}, {file}).drapes[0].input.repeats.size(), 1U);
}

}  // namespace
}  // namespace drape::compare
