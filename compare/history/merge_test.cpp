// SPDX-License-Identifier: Apache-2.0

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <stdlib.h>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

class Merged : public testing::Test {
 protected:
  /// A store with one drape whose simulations are `height_m` above the measured sheet.
  fs::path store(const std::string& name, std::initializer_list<double> heights_m) {
    fs::path file = folder_.path() / name;
    for (const double height_m : heights_m)
      test::add_drape(file, test::measured_sheet(),
                      {test::simulated_sheet(11, 5, test::raised(height_m)),
                       test::simulated_sheet(21, 5, test::raised(height_m))});
    return file;
  }
  [[nodiscard]] fs::path in(const std::string& name) const { return folder_.path() / name; }
  /// Every mark of every comparison and every pair, by content.
  static std::vector<std::vector<std::string>> rows(const fs::path& file) {
    const StoreReader reader(file);
    std::vector<std::vector<std::string>> all =
        reader
            .query(
                "SELECT c.sha256, m.\"row\", m.\"col\", m.distance_mm, m.sigma_distance_mm, "
                "c.mean_mm, c.mean_low_mm FROM mark_error AS m JOIN comparison AS c ON c.id = "
                "m.comparison_id ORDER BY 1, 2, 3")
            .rows;
    for (const auto& row : reader.query("SELECT * FROM simulation_pair ORDER BY sha256").rows)
      all.push_back(row);
    return all;
  }

  drape::test::TemporaryFolder folder_;
};

TEST_F(Merged, EqualsTheUndisturbedStoreInAnyOrderAndAgain) {
  const fs::path whole = store("whole.sqlite", {0, 1e-3, 2e-3, 3e-3});
  const fs::path a = store("a.sqlite", {0, 1e-3}), b = store("b.sqlite", {1e-3, 2e-3}),
                 c = store("c.sqlite", {3e-3});
  const MergeCounts counts = merge_stores(in("abc.sqlite"), {a, b, c});
  EXPECT_GT(counts.added, 0);
  EXPECT_GT(counts.present, 0) << "a and b have a drape in common";
  EXPECT_EQ(rows(in("abc.sqlite")), rows(whole));
  EXPECT_EQ(rows(whole).size(), 8U * 121U + 4U);
  (void)merge_stores(in("cba.sqlite"), {c, b, a});
  EXPECT_EQ(read_bytes(in("cba.sqlite")), read_bytes(in("abc.sqlite")));
  EXPECT_EQ(merge_stores(in("abc.sqlite"), {b, a, c}).added, 0);
  EXPECT_EQ(read_bytes(in("cba.sqlite")), read_bytes(in("abc.sqlite")));
  // One after the other: the same rows, in another order of the chain.
  (void)merge_stores(in("steps.sqlite"), {c});
  (void)merge_stores(in("steps.sqlite"), {a});
  (void)merge_stores(in("steps.sqlite"), {b});
  EXPECT_EQ(rows(in("steps.sqlite")), rows(whole));
  EXPECT_THAT(altered_rows(StoreReader(in("steps.sqlite"))), testing::IsEmpty());
  EXPECT_EQ(test::one(StoreReader(in("steps.sqlite")), "SELECT count(*) FROM manifest"), "4");
}

TEST_F(Merged, RunsKeepTheirComparisonsUnderNewNumbers) {
  const auto stored = [&](const std::string& name, const char* label, const char* moment) {
    ::setenv("SOURCE_DATE_EPOCH", moment, 1);
    const Session session = read_session(test::write_example(folder_.path() / label), {});
    Outcome outcome;
    compare_session(session, {}, outcome);
    (void)import_session(in(name), session, outcome, {label, "A. Miller"});
    ::unsetenv("SOURCE_DATE_EPOCH");
    return in(name);
  };
  const fs::path a = stored("a.sqlite", "later", "1777593600");
  const fs::path b = stored("b.sqlite", "earlier", "1772323200");
  (void)store("c.sqlite", {0, 1e-3});
  (void)merge_stores(in("c.sqlite"), {a});
  (void)merge_stores(in("c.sqlite"), {b, a});
  const StoreReader merged(in("c.sqlite"));
  EXPECT_THAT(altered_rows(merged), testing::IsEmpty());
  const std::string of_run =
      "SELECT r.label, r.date, c.sha256 FROM run AS r JOIN run_comparison AS k ON k.run = r.number "
      "JOIN comparison AS c ON c.id = k.comparison_id WHERE r.label = ? ORDER BY 3";
  EXPECT_EQ(merged.query("SELECT * FROM run").rows.size(), 2U);
  for (const auto& [file, label] : {std::pair{a, "later"}, std::pair{b, "earlier"}}) {
    const auto rows = StoreReader(file).query(of_run, {label}).rows;
    EXPECT_EQ(rows.size(), 4U);
    EXPECT_EQ(merged.query(of_run, {label}).rows, rows);
  }
}

TEST_F(Merged, RefusesAChangedSourceAndAContradiction) {
  const fs::path good = store("good.sqlite", {0}), bad = store("bad.sqlite", {0});
  (void)merge_stores(in("target.sqlite"), {good});
  const auto before = rows(in("target.sqlite"));
  {
    SQLite::Database database(bad.string(), SQLite::OPEN_READWRITE);
    SQLite::Statement triggers(database, "SELECT name FROM sqlite_master WHERE type = 'trigger'");
    std::vector<std::string> names;
    while (triggers.executeStep()) names.push_back(triggers.getColumn(0).getString());
    triggers.reset();
    for (const std::string& name : names) database.exec("DROP TRIGGER \"" + name + "\"");
    ASSERT_GT(database.exec("UPDATE comparison SET mean_mm = mean_mm + 1"), 0);
  }
  EXPECT_THROW((void)merge_stores(in("target.sqlite"), {bad}), Error);
  EXPECT_EQ(rows(in("target.sqlite")), before);
  EXPECT_THROW((void)merge_stores(in("target.sqlite"), {in("absent.sqlite")}), Error);
}

TEST_F(Merged, WhatOnlyOneStoreKnowsIsNoContradictionButTwoValuesAre) {
  const auto stored = [&](const std::string& name, const char* certificate) {
    DrapeInput input = test::drape_of(test::measured_sheet(), {test::simulated_sheet(11, 5)});
    if (certificate != nullptr) {
      input.simulations[0].certificate = Certificate{};
      input.simulations[0].certificate->sha256 = sha256_of(std::string_view(certificate));
    }
    Store store(in(name));
    test::add(store, input, compare_drape(input, {}));
    store.close();
    return in(name);
  };
  const fs::path bare = stored("bare.sqlite", nullptr), full = stored("full.sqlite", "one"),
                 other = stored("other.sqlite", "two");
  EXPECT_TRUE(merge_stores(in("from_bare.sqlite"), {full}).known_better.empty());
  EXPECT_TRUE(merge_stores(in("from_bare.sqlite"), {bare}).known_better.empty());
  EXPECT_EQ(rows(in("from_bare.sqlite")), rows(full));
  (void)merge_stores(in("from_full.sqlite"), {bare});
  EXPECT_THAT(merge_stores(in("from_full.sqlite"), {full}).known_better,
              testing::ElementsAre(testing::StartsWith("simulation ")));
  (void)merge_stores(in("both.sqlite"), {bare, full});
  EXPECT_EQ(StoreReader(in("both.sqlite")).query("SELECT certificate_sha256 FROM simulation").rows,
            StoreReader(full).query("SELECT certificate_sha256 FROM simulation").rows)
      << "nothing that one of them knows is lost";
  EXPECT_THAT(altered_rows(StoreReader(in("both.sqlite"))), testing::IsEmpty());
  EXPECT_THROW((void)merge_stores(in("three.sqlite"), {bare, full, other}), Error);
  EXPECT_FALSE(fs::exists(in("three.sqlite"))) << "all are compared before the target is made";
  const std::vector<unsigned char> before = read_bytes(in("from_full.sqlite"));
  EXPECT_THROW(
      (void)merge_stores(in("from_full.sqlite"), {store("more.sqlite", {1e-3}), full, other}),
      Error);
  EXPECT_EQ(read_bytes(in("from_full.sqlite")), before);
}

TEST_F(Merged, ARunThatTwoStoresGotOnTwoDaysIsLastInBothOrders) {
  const std::vector<fs::path> sheets = test::write_example(folder_.path() / "A");
  const auto add = [&](const std::string& name, const char* label, const char* moment) {
    ::setenv("SOURCE_DATE_EPOCH", moment, 1);
    Session session = read_session(sheets, {});
    session.drapes[0].recording = RecordingId{sha256_of("recording.json"), {}, "recording"};
    Outcome outcome;
    compare_session(session, {}, outcome);
    (void)import_session(in(name), session, outcome, {label, ""});
    ::unsetenv("SOURCE_DATE_EPOCH");
  };
  add("a.sqlite", "one", "1772323200");  // March
  add("b.sqlite", "other", "1775001600");
  add("b.sqlite", "one", "1777593600");  // May
  fs::copy_file(in("a.sqlite"), in("a_first.sqlite"));
  (void)merge_stores(in("a.sqlite"), {in("b.sqlite")});
  (void)merge_stores(in("b.sqlite"), {in("a_first.sqlite")});
  for (const char* name : {"a.sqlite", "b.sqlite"}) {
    const StoreReader reader(in(name));
    EXPECT_THAT(altered_rows(reader), testing::IsEmpty());
    EXPECT_EQ(reader.query("SELECT DISTINCT label, date FROM v_state").rows,
              (std::vector<std::vector<std::string>>{{"one", "2026-05-01T00:00:00Z"}}))
        << name;
    EXPECT_EQ(list_results(reader, {.until = "2026-03", .outdated = true}).rows.size(), 4U) << name;
  }
}

TEST_F(Merged, ASourceThatIsRefusedIsNamedAndLeavesNothing) {
  const fs::path good = store("good.sqlite", {0}), newer = store("newer.sqlite", {0}),
                 altered = store("altered.sqlite", {0});
  SQLite::Database(newer.string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  SQLite::Database(altered.string(), SQLite::OPEN_READWRITE).exec("DROP VIEW v_run");
  write_durable(in("text.sqlite"), "no store");
  std::string bits = read_text(good);
  bits[bits.find("CREATE TABLE rig") + 3] ^= 4;
  write_durable(in("bit.sqlite"), bits);
  for (const fs::path& bad : {newer, altered, in("text.sqlite"), in("bit.sqlite")}) {
    try {
      (void)merge_stores(in("new/target.sqlite"), {good, bad});
      ADD_FAILURE() << bad;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << error.what();
      EXPECT_THAT(error.what(), testing::HasSubstr(bad.string()));
    }
    EXPECT_FALSE(fs::exists(in("new/target.sqlite"))) << bad;
  }
}

TEST_F(Merged, IntoAnEmptyFileThatAKilledMergeLeft) {
  const fs::path good = store("good.sqlite", {0});
  write_durable(in("target.sqlite"), "");
  EXPECT_GT(merge_stores(in("target.sqlite"), {good}).added, 0);
  EXPECT_EQ(rows(in("target.sqlite")), rows(good));
}

TEST_F(Merged, TakesBlobsAndPlacesAndComputesAllAgain) {
  for (const char* name : {"a", "b"})
    (void)test::import_run(in(std::string(name) + ".sqlite"),
                           read_session(test::write_recorded_example(in(name)), {}), {name, ""});
  fs::create_directory(in("far"));
  const fs::path all = in("far/all.sqlite");
  (void)merge_stores(all, {in("a.sqlite"), in("b.sqlite")});
  const Verification result = verify_store(all);
  EXPECT_THAT(result.findings, testing::IsEmpty());
  EXPECT_EQ(result.comparisons, 8);
  const StoreReader reader(all);
  const std::string key = test::one(reader, "SELECT sha256 FROM comparison WHERE id = 1");
  EXPECT_TRUE(explain(reader, key, "mean_mm").good) << "places lead from the new folder";
}

}  // namespace
}  // namespace drape::compare
