// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

Sheet measured_with(char calibration) {
  Sheet sheet = test::measured_sheet();
  std::get<MeasuredSource>(sheet.source).calibration_sha256 = std::string(64, calibration);
  return sheet;
}

/// Writes acceptance.json with a length error and one figure that was not measured.
fs::path written(const fs::path& folder, const std::string& day, double length_error_mm, bool go,
                 const std::string& calibration = std::string(64, 'a')) {
  Json json;
  json["schema"] = "drapebench/acceptance/1";
  json["rig"] = "bench";
  json["calibration_sha256"] = calibration;
  json["date"] = day;
  json["valid_until"] = "2027-06-30";
  json["positions"] = 9;
  json["go"] = go;
  json["cause"] = go ? Json() : Json("cam1 moved since the calibration");
  json["figures"] = Json::array({{{"name", "length error"},
                                  {"unit", "mm"},
                                  {"value", length_error_mm},
                                  {"expanded_uncertainty", 0.01},
                                  {"limit", 0.03},
                                  {"where", "set a"},
                                  {"go", go}},
                                 {{"name", "known shift"},
                                  {"unit", "mm"},
                                  {"value", nullptr},
                                  {"expanded_uncertainty", nullptr},
                                  {"limit", nullptr},
                                  {"where", ""},
                                  {"go", false}}});
  fs::path file = folder / (day + ".json");
  write_json(file, json);
  return file;
}

TEST(RigAcceptances, AreKeptOnceTrendedAndMerged) {
  const drape::test::TemporaryFolder folder;
  const fs::path store = folder.path() / "results.sqlite";
  const double errors_mm[] = {0.010, 0.011, 0.009, 0.010, 0.012, 0.060};
  int month = 0;
  for (const double error : errors_mm) {
    const fs::path file =
        written(folder.path(), "2026-0" + std::to_string(++month) + "-01", error, error < 0.05);
    store_acceptance(store, read_record<AcceptanceFile>(file));
    store_acceptance(store, read_record<AcceptanceFile>(file));
  }
  const StoreReader reader(store);
  EXPECT_EQ(reader.query("SELECT count(*) FROM acceptance").rows.at(0).at(0), "6");
  EXPECT_EQ(
      reader.query("SELECT count(*) FROM acceptance_figure WHERE value IS NULL").rows.at(0).at(0),
      "6");
  EXPECT_EQ(reader.query("SELECT cause FROM acceptance WHERE verdict = 'NO-GO'").rows.at(0).at(0),
            "cam1 moved since the calibration");
  EXPECT_THAT(altered_rows(reader), IsEmpty());
  const Trend trend = trend_of(reader, {});
  ASSERT_EQ(trend.table.rows.size(), 6U);
  EXPECT_EQ(trend.table.rows[5][0], "acceptance bench length error");
  EXPECT_EQ(trend.table.rows[5][2], "2026-06-01");
  EXPECT_EQ(trend.table.rows[5][8], "ALARM");
  EXPECT_EQ(trend.alarms, 1);

  const fs::path all = folder.path() / "all.sqlite";
  EXPECT_EQ(merge_stores(all, {store}).added, 13);  // the rig, and of each its row and figures
  EXPECT_EQ(StoreReader(all).query("SELECT count(*) FROM acceptance_figure").rows.at(0).at(0),
            "12");
  EXPECT_THAT(altered_rows(StoreReader(all)), IsEmpty());
}

TEST(RigAcceptances, OutOfDateOnesAreDoubted) {
  const drape::test::TemporaryFolder folder;
  Session session;
  DrapeFiles& drape = session.drapes.emplace_back();
  drape.input.measured.sheet = measured_with('a');
  drape.recording = RecordingId{"", "2027-06-30"};
  const AcceptanceFile good =
      read_record<AcceptanceFile>(written(folder.path(), "2026-01-31", 0.01, true));
  EXPECT_THAT(doubts_of(good, session), IsEmpty());
  drape.recording->recorded_on = "2027-07-01";
  EXPECT_THAT(doubts_of(good, session), ElementsAre(HasSubstr("expired on 2027-06-30")));
  drape.recording->recorded_on.reset();
  EXPECT_THAT(doubts_of(good, session), IsEmpty());
  drape.input.measured.sheet = measured_with('b');
  EXPECT_THAT(doubts_of(good, session), ElementsAre(HasSubstr("another calibration")));
  drape.input.measured.sheet = measured_with('a');
  const AcceptanceFile bad =
      read_record<AcceptanceFile>(written(folder.path(), "2026-02-01", 0.1, false));
  EXPECT_THAT(doubts_of(bad, session), IsEmpty());
}

TEST(RigAcceptances, TheLastOneSpeaksForEveryDrapeOfItsCalibrationAndForNoOther) {
  const drape::test::TemporaryFolder folder;
  const fs::path store = folder.path() / "results.sqlite";
  Session session;
  for (const char calibration : {'b', 'a'})
    session.drapes.emplace_back().input =
        test::drape_of(measured_with(calibration), {test::simulated_sheet(11, 5, [](const auto& m) {
                         return Eigen::Vector3d(test::flat(m) + Eigen::Vector3d(0, 0, 5e-3));
                       })});
  const AcceptanceFile bad = read_record<AcceptanceFile>(
                           written(folder.path(), "2026-02-01", 0.1, false)),
                       older = read_record<AcceptanceFile>(
                           written(folder.path(), "2026-01-31", 0.01, true)),
                       newer = read_record<AcceptanceFile>(
                           written(folder.path(), "2026-03-01", 0.01, true));
  const auto refused = ElementsAre(Pair(std::string(64, 'a'), HasSubstr("NO-GO: cam1 moved")));
  EXPECT_THAT(reason_in_store(store, session), IsEmpty());
  EXPECT_THAT(reason_in_store(store, session, bad), refused);
  store_acceptance(store, bad);
  EXPECT_THAT(reason_in_store(store, session), refused);
  EXPECT_THAT(reason_in_store(store, session, older), refused);
  EXPECT_THAT(reason_in_store(store, session, newer), IsEmpty());
  Outcome outcome;
  outcome.not_accepted = reason_in_store(store, session);
  compare_session(session, {}, outcome);
  EXPECT_THAT(outcome.reports.at(0).no_go, IsEmpty());
  EXPECT_THAT(outcome.reports.at(1).no_go, ElementsAre(HasSubstr("cam1 moved")));
  store_acceptance(store, newer);
  EXPECT_THAT(reason_in_store(store, session), IsEmpty());
  EXPECT_THAT(reason_in_store(store, session, bad), IsEmpty());
}

}  // namespace
}  // namespace drape::compare
