// SPDX-License-Identifier: Apache-2.0
#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>

#include <stdlib.h>

#include <random>

#include "compare/report/report.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

using testing::HasSubstr;
using testing::Not;
using units::mm;

/// Imports a reference drape once for each height, which is its mean distance.
void import_heights(const std::filesystem::path& file, const std::vector<double>& heights_mm) {
  for (const double height : heights_mm)
    test::add_drape(file, test::measured_sheet(test::raised(height * mm)),
                    {test::simulated_sheet(11, 5)});
}

/// Imports the same as a run on a day of January, on a rig.
void import_run(const std::filesystem::path& file, double height_mm, int day,
                const std::string& rig = "bench") {
  Sheet measured = test::measured_sheet(test::raised(height_mm * mm));
  std::get<MeasuredSource>(measured.source).rig = rig;
  if (rig != "bench")
    std::get<MeasuredSource>(measured.source).calibration_sha256 = sha256_of(std::string_view(rig));
  Session session;
  session.drapes.emplace_back();
  session.drapes[0].input = test::drape_of(measured, {test::simulated_sheet(11, 5)});
  ::setenv("SOURCE_DATE_EPOCH", std::to_string(1767225600 + (day - 1) * 86400).c_str(), 1);
  test::import_run(file, session);
  ::unsetenv("SOURCE_DATE_EPOCH");
}

TEST(Trend, FollowsTheDatesOfTheRunsInWhateverOrderStoresWereMerged) {
  const drape::test::TemporaryFolder folder;
  const auto old_store = folder.path() / "old.sqlite", new_store = folder.path() / "new.sqlite",
             both = folder.path() / "both.sqlite";
  int day = 0;
  for (const double height : {5.0, 5.2, 4.8, 5.1, 4.9, 5.05}) import_run(old_store, height, ++day);
  import_run(new_store, 9.0, ++day);
  (void)merge_stores(both, {new_store, old_store});
  (void)merge_stores(old_store, {new_store});
  (void)merge_stores(new_store, {old_store});
  for (const auto& file : {old_store, new_store, both}) {
    const Trend trend = trend_of(StoreReader(file), {});
    ASSERT_EQ(trend.table.rows.size(), 7U) << file;
    EXPECT_EQ(trend.table.rows[6][3], "9.0000") << file;
    EXPECT_EQ(trend.alarms, 1) << file;
  }
}

TEST(Trend, AnUncertaintyThatLacksAPartIsSaidToBeAtLeastThat) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  import_run(file, 5, 1);
  import_run(file, 6, 2);
  {
    SQLite::Database database(file.string(), SQLite::OPEN_READWRITE);
    ASSERT_EQ(
        database.execAndGet("SELECT min(expanded_uncertainty_mm) > 0 FROM run_drape").getInt(), 1);
    // Lists the altered row again, as if it had been written so.
    const char* triggers[] = {"run_drape_no_UPDATE", "listed_no_DELETE"};
    std::vector<std::string> statements;
    for (const char* trigger : triggers) {
      statements.push_back(
          database
              .execAndGet(std::string("SELECT sql FROM sqlite_master WHERE name = '") + trigger +
                          "'")
              .getString());
      database.exec(std::string("DROP TRIGGER ") + trigger);
    }
    database.exec("UPDATE run_drape SET budget_complete = 1 WHERE run = 2");
    const std::string run =
        database.execAndGet("SELECT sha256 FROM run WHERE number = 2").getString();
    database.exec("DELETE FROM listed WHERE kind = 'run_drape' AND key = '" + run + "'");
    write_manifest(database, {{&listed_table("run_drape"), run}});
    for (const std::string& statement : statements) database.exec(statement);
  }
  const StoreReader reader(file);
  for (const Table& table :
       {difference_of_runs(reader, 1, 2).tables[1], trend_by(reader, "scene")}) {
    std::map<std::string, std::string> of_run;
    const auto column = [&](const std::string& name) {
      return static_cast<std::size_t>(std::find(table.names.begin(), table.names.end(), name) -
                                      table.names.begin());
    };
    for (const auto& row : table.rows)
      of_run[row.at(column("run"))] = row.at(column("uncertainty_is"));
    EXPECT_EQ(of_run, (std::map<std::string, std::string>{{"1", "at least"}, {"2", "complete"}}));
  }
}

TEST(Trend, ByAKeyIsThatOfTheSpecimenThatIsAskedFor) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  import_run(file, 5, 1);
  const StoreReader reader(file);
  ASSERT_EQ(trend_by(reader, "scene").rows.size(), 1U);
  EXPECT_EQ(trend_by(reader, "scene", "A").rows.size(), 1U);
  EXPECT_EQ(trend_by(reader, "scene", "A/cotton-like").rows.size(), 1U);
  EXPECT_THROW((void)trend_by(reader, "scene", "C"), Error);
}

TEST(Trend, AnotherRigIsAnotherSeries) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  int day = 0;
  for (const double height : {5.0, 5.2, 4.8, 5.1, 4.9, 5.05}) import_run(file, height, ++day);
  import_run(file, 9.0, ++day, "lab-B");
  const Trend trend = trend_of(StoreReader(file), {});
  EXPECT_EQ(trend.alarms, 0);
  EXPECT_THAT(trend.table.rows[0][0], HasSubstr("bench A"));
  EXPECT_THAT(trend.table.rows[6][0], HasSubstr("lab-B A"));
}

TEST(Trend, JudgesEachValueByThoseBeforeIt) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  import_heights(file, {5.0, 5.2, 4.8, 5.1, 4.9, 5.05, 9.0});
  const Trend trend = trend_of(StoreReader(file), {});
  ASSERT_EQ(trend.table.rows.size(), 7U);
  EXPECT_EQ(trend.table.rows[4][8], "") << "not judged yet";
  EXPECT_EQ(trend.table.rows[4][5], "");
  // Mean 5.0 and s = sqrt(0.1 / 4) of the first five.
  EXPECT_EQ(trend.table.rows[5][5], "5.0000");
  EXPECT_EQ(trend.table.rows[5][6], "0.1581");
  EXPECT_EQ(trend.table.rows[5][8], "");
  EXPECT_EQ(trend.table.rows[6][8], "ALARM");
  EXPECT_EQ(trend.alarms, 1);
  EXPECT_EQ(trend_of(StoreReader(file), {.specimen = "A/cotton-like"}).table.rows.size(), 7U);
  EXPECT_THROW((void)trend_of(StoreReader(file), {.specimen = "B"}), Error);
  EXPECT_THROW((void)trend_of(StoreReader(file), {.least_before = 1}), Error);
}

TEST(Trend, ANoGoCalibrationIsNamedAndIsNotWhatIsUsual) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  for (int day = 1; day <= 7; ++day) {
    Session session;
    session.calibration.emplace();
    session.calibration->rig = "bench";
    session.calibration->method = "joint";
    session.calibration->cameras.resize(1);
    session.calibration->cameras[0].camera.name = "cam0";
    session.calibration->cameras[0].residuals.rms_px = day == 6 ? 9 : 0.1 + 0.001 * (day % 3);
    if (day == 6) session.calibration->no_go = "cam0: 9 px";
    session.calibration_sha256 = sha256_of("calibration " + std::to_string(day));
    Sheet measured = test::measured_sheet();
    std::get<MeasuredSource>(measured.source).calibration_sha256 = session.calibration_sha256;
    session.drapes.emplace_back();
    session.drapes[0].input = test::drape_of(measured, {test::simulated_sheet(11, 5)});
    Outcome outcome;
    compare_session(session, {}, outcome);
    ::setenv("SOURCE_DATE_EPOCH", std::to_string(1767225600 + day * 86400).c_str(), 1);
    (void)import_session(file, session, outcome);
    ::unsetenv("SOURCE_DATE_EPOCH");
  }
  const Trend trend = trend_of(StoreReader(file), {});
  ASSERT_GE(trend.table.rows.size(), 7U);
  EXPECT_EQ(trend.table.rows[4][9], "GO");
  EXPECT_EQ(trend.table.rows[5][9], "NO-GO");
  EXPECT_EQ(trend.table.rows[5][8], "ALARM");
  EXPECT_EQ(trend.table.rows[6][5], "0.1012") << "of the five that are GO";
  EXPECT_EQ(trend.table.rows[6][8], "");
}

TEST(Trend, AnOldAlarmIsShownButDoesNotStopTheBenchForever) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  import_heights(file, {5.0, 5.2, 4.8, 5.1, 4.9, 9.0, 5.03});
  const Trend trend = trend_of(StoreReader(file), {});
  EXPECT_EQ(trend.table.rows[5][8], "ALARM");
  EXPECT_EQ(trend.alarms, 0);
}

TEST(Trend, ADriftOfTheCalibrationResidualIsAnAlarmOfItsCamera) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  {
    Store store(file);
    int i = 0;
    for (const double rms_px : {0.101, 0.099, 0.100, 0.102, 0.098, 0.101, 0.112}) {
      Calibration calibration;
      calibration.rig = "bench";
      calibration.method = "joint";
      for (const char* name : {"cam0", "cam1"}) {
        CalibratedCamera camera;
        camera.camera.name = name;
        camera.residuals.points = 100;
        // cam0 drifts, cam1 does not.
        camera.residuals.rms_px = name == std::string("cam0") || i < 6 ? rms_px : 0.1;
        calibration.cameras.push_back(camera);
      }
      store.write([&](Writer& writer) {
        add(writer, calibration, sha256_of("calibration " + std::to_string(i++)));
      });
    }
    store.close();
  }
  const Trend trend = trend_of(StoreReader(file), {});
  ASSERT_EQ(trend.table.rows.size(), 14U);
  EXPECT_EQ(trend.alarms, 1);
  EXPECT_EQ(trend.table.rows[6][0], "calibration residual bench cam0");
  EXPECT_EQ(trend.table.rows[6][4], "px");
  EXPECT_EQ(trend.table.rows[6][8], "ALARM");
  // Mean and standard deviation of the six before: 0.100167, 0.001472; off by 7.4 of their sigmas.
  EXPECT_EQ(trend.table.rows[6][7], "+7.4");
  EXPECT_EQ(trend.table.rows[13][8], "");
}

TEST(History, OnePageThatFetchesNothing) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "results.sqlite";
  import_heights(file, {5.0, 5.2, 4.8, 5.1, 4.9, 5.05, 9.0});
  const std::string page = history_page(StoreReader(file), {}).html;
  EXPECT_THAT(page, HasSubstr("\"go\":false"));
  EXPECT_THAT(page, HasSubstr("\"alarm\":true"));
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  EXPECT_EQ(page, history_page(StoreReader(file), {}).html);
}

}  // namespace
}  // namespace drape::compare
