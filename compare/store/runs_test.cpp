// SPDX-License-Identifier: Apache-2.0
#include "compare/store/runs.hpp"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <stdlib.h>

#include "compare/history/results.hpp"
#include "compare/schema/schema.hpp"
#include "compare/store/sheet_folders.hpp"
#include "compare/test_sheets.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A bench of one drape whose scene an operator edits between runs.
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
    drape.detections = Detections{};
    drape.detections->frames.push_back(frame);
    return session;
  }

  /// Stores what lies in the folder as one run at a moment (s since 1970).
  int run(const char* moment, const RunLabel& label = {}) {
    ::setenv("SOURCE_DATE_EPOCH", moment, 1);
    const Session session = this->session();
    Outcome outcome;
    compare_session(session, {}, outcome);
    static_cast<void>(import_session(store(), session, outcome, label));
    return outcome.run;
  }

  [[nodiscard]] std::string one(const std::string& sql) const {
    return StoreReader(store()).query(sql).rows.at(0).at(0);
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
  EXPECT_THAT(one("SELECT match FROM run_drape"), testing::AnyOf("inside", "outside", "undecided"));
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
}

TEST_F(Runs, ADifferenceNamesTheValueThatWasChanged) {
  run(kMarch);
  std::string text = read_text(scene());
  const auto at = text.find("friction = 0.4");
  ASSERT_NE(at, std::string::npos);
  write_durable(scene(), text.replace(at, 14, "friction = 0.25"));
  EXPECT_EQ(run(kMay), 2);
  const RunDifference found = difference_of_runs(StoreReader(store()), 1, 2);
  EXPECT_THAT(found.sentence, HasSubstr("scene A friction 0.4 -> 0.25"));
  const Table trend = trend_by(StoreReader(store()), "friction");
  EXPECT_EQ(trend.rows.front()[1], "0.25");
  EXPECT_EQ(trend.rows.back()[1], "0.4");
  EXPECT_THROW((void)difference_of_runs(StoreReader(store()), 1, 7), Error);
  EXPECT_THROW((void)trend_by(StoreReader(store()), "frictoin"), Error);
}

TEST_F(Runs, WhatALaterRunOfTheSamePhotographsReplacedIsLeftOut) {
  run(kMarch);
  const std::size_t before = list_results(StoreReader(store()), {}).rows.size();
  sheets_.pop_back();  // the later run has one simulation less
  run(kMay);
  const StoreReader reader(store());
  EXPECT_EQ(list_results(reader, {}).rows.size(), before - 1);
  EXPECT_EQ(list_results(reader, {.outdated = true}).rows.size(), before);
  EXPECT_EQ(one("SELECT state FROM v_outdated"), "superseded");
}

TEST_F(Runs, WhatALaterRunCallsOtherwiseOrLacksIsLeftOutAndNamed) {
  run(kMarch);
  {
    SQLite::Database database(store().string(), SQLite::OPEN_READWRITE);
    const auto later = [&](int number, const char* scene, const char* pictures) {
      database.exec(fmt::format(
          "INSERT INTO run SELECT {0}, substr('{0}' || sha256, 1, 64), date, label, operator, "
          "program_version, rig_name, recording_sha256, recording_name, calibration_sha256, "
          "calibration_name, measurement, cause FROM run WHERE number = 1",
          number));
      database.exec(fmt::format(
          "INSERT INTO run_drape SELECT {}, measured_sha256, '{}', set_name, {}, measurement, "
          "cause, match, match_reason, headline_sha256, expanded_uncertainty_mm, budget_complete "
          "FROM run_drape WHERE run = 1",
          number, scene, pictures));
    };
    later(2, "other", "'0'");
    EXPECT_EQ(one("SELECT DISTINCT state FROM v_state"), "removed");
    later(3, "A2", "pictures_sha256");
    EXPECT_EQ(one("SELECT DISTINCT state FROM v_state"), "renamed");
    later(4, "A", "pictures_sha256");
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

/// What a match rests on is stored with its figures, listed, and part of what makes a run.
TEST_F(Runs, RepeatsOfADrapeAreStoredWithWhatTheySay) {
  ASSERT_EQ(run(kMarch), 1);
  EXPECT_EQ(one("SELECT rests_on FROM run_match"), "total uncertainty");
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
            "repeats: hem, repeats: marks, repeats: spectrum");
  EXPECT_EQ(one("SELECT set_name FROM real_repeat WHERE face = 'back' AND left_out IS NOT NULL"),
            "again_4");
  EXPECT_EQ(one("SELECT from_own_rms_mm > 3 FROM real_repeat WHERE repeat = '3'"), "1");
  EXPECT_EQ(one("SELECT match_rests_on FROM v_run_drape WHERE run = 2"), "3 repeats");
  EXPECT_THAT(list_runs(StoreReader(store()), {}).rows[1][5], HasSubstr("by 3 repeats"));
  EXPECT_THAT(paper_tables(StoreReader(store()), {}).at(0).title, HasSubstr("by 3 repeats"));
  EXPECT_TRUE(check_ledger(StoreReader(store())).findings.empty());
}

TEST_F(Runs, ARepeatOfNoDrapeIsRefused) {
  const Sheet sheet = read_sheet(sheets_[0]);
  const fs::path file = folder_.path() / "again" / "sheet.ply";
  write_sheet(file, sheet);
  EXPECT_THROW((void)read_session(sheets_, {}, {file}), Error) << "it does not say that it is one";
  write_repeat(file, sheet, "B", "2", "");
  EXPECT_THROW((void)read_session(sheets_, {}, {file}), Error) << "no drape B";
  write_repeat(file, sheet, "A", "2", "");
  EXPECT_THROW((void)read_session(sheets_, {}, {file, file}), Error) << "twice";
  EXPECT_EQ(read_session(sheets_, {}, {file}).drapes[0].input.repeats.size(), 1U);
}

}  // namespace
}  // namespace drape::compare
