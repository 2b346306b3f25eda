// SPDX-License-Identifier: Apache-2.0
#include "compare/crate/crate.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "compare/history/results.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

/// A store whose copies precede every sheet in the order of names.
class CrateOf : public testing::Test {
 protected:
  CrateOf() {
    const fs::path bench = drape::test::source_root() / "rigs/bench1";
    for (const char* name : {"scenes", "fabrics", "print.toml"})
      fs::copy(bench / name, folder_.path() / name, fs::copy_options::recursive);
    for (std::size_t i = 1; i < sheets_.size(); ++i) make(sheets_[i], read_sheet(sheets_[i]));
    import();
  }

  /// Writes a simulated sheet of the current scene, with its record.
  void make(const fs::path& file, Sheet sheet) const {
    std::get<SimulatedSource>(sheet.source).scene_sha256 = sha256_of_file(scene_);
    write_sheet(file, sheet);
    record(file);
  }
  /// Records that the sheet was made from the current scene.
  void record(const fs::path& sheet) const {
    RunRecord record("drape-simulate", {}, run_record_path(sheet));
    record.input(scene_);
    for (const char* name : {"sheet.ply", "sheet.json"}) record.output(sheet.parent_path() / name);
    record.write(0);
  }

  void import() { test::import_run(store_, read_session(sheets_, {})); }
  /// Exports into a new folder, which out() names.
  std::vector<std::string> findings(std::optional<int> run, const fs::path& store) {
    ++count_;
    Lab lab;
    lab.title = lab.description = lab.license = lab.license_name = "x";
    lab.authors.push_back({"Nobody", "", ""});
    return write_crate(StoreReader(store), run, lab, out()).findings;
  }
  std::vector<std::string> findings(std::optional<int> run = 1) { return findings(run, store_); }
  [[nodiscard]] fs::path out() const { return folder_.path() / fmt::format("crate-{}", count_); }
  [[nodiscard]] std::string text(const std::string& name) const { return read_text(out() / name); }
  /// Explanation of the mean distance of the first sheet simulated.
  [[nodiscard]] Answer why() const { return explain(StoreReader(store_), first_key_, "mean_mm"); }
  [[nodiscard]] std::string key_of_first() const {
    return StoreReader(store_)
        .query("SELECT sha256 FROM comparison WHERE simulated_sha256 = ?",
               {sha256_of_file(fs::path(sheets_[1]).replace_extension(".json"))})
        .rows.at(0)
        .at(0);
  }
  /// Another shape in place of the first simulated sheet.
  static Sheet another() { return test::simulated_sheet(11, 1, test::raised(7e-3)); }

  drape::test::TemporaryFolder folder_;
  fs::path store_ = folder_.path() / "0.sqlite", scene_ = folder_.path() / "scenes" / "A.toml";
  std::vector<fs::path> sheets_ = test::write_recorded_example(folder_.path());
  std::string first_key_;
  int count_ = 0;
};

TEST_F(CrateOf, AnUntouchedRunIsWholeWithItsUncertaintyAsItIs) {
  EXPECT_THAT(findings(), IsEmpty());
  first_key_ = key_of_first();
  EXPECT_TRUE(why().good) << "followed from the sheet, not from its copy";
  const std::string u = StoreReader(store_)
                            .query(
                                "SELECT expanded_uncertainty_mm FROM run_drape WHERE "
                                "budget_complete = 0")
                            .rows.at(0)
                            .at(0);
  const std::string metadata = text("ro-crate-metadata.json");
  EXPECT_THAT(metadata, HasSubstr("expanded uncertainty (95 %) at least " + u + " mm"));
  for (const char* metric : {"mean_mm", "expanded_uncertainty_mm"})
    EXPECT_THAT(metadata, HasSubstr(fmt::format("\"@id\": \"#metric-{}\"", metric)));
  EXPECT_THAT(text("drapes.csv"), HasSubstr(u + ",at least"));
  const Table stored = StoreReader(store_).query("SELECT mean_mm FROM comparison");
  for (const auto& row : stored.rows) EXPECT_THAT(text("comparisons.csv"), HasSubstr(row[0]));
  EXPECT_THAT(findings(std::nullopt), IsEmpty());
  EXPECT_THAT(text("drapes.csv"), HasSubstr(u + ",at least"));
}

TEST_F(CrateOf, WhatTheUncertaintyRestsOnIsInTheCrate) {
  const fs::path split = sheets_.back().parent_path() / kSensitivityName,
                 fabric = folder_.path() / "fabric.toml";
  write_durable(fabric, "fabric");
  write_json(split, {{"schema", "drapebench/sensitivity/1"},
                     {"rows", 21},
                     {"cols", 21},
                     {"segments", 5},
                     {"model", "consistent"},
                     {"marks", 0},
                     {"mean_distance_mm", 1.5},
                     {"sensitivities", nullptr}});
  RunRecord record("drape-simulate", {}, run_record_path(split));
  for (const fs::path& file : {scene_, fabric, fs::path(sheets_[0]).replace_extension(".json")})
    record.input(file);
  record.output(split);
  record.write(0);
  EXPECT_THAT(findings(), IsEmpty());
  const std::string beside = "A/simulations/21-5/sensitivity";
  EXPECT_FALSE(fs::exists(out() / "files" / (beside + ".json"))) << "not in U yet";
  import();
  EXPECT_THAT(findings(), IsEmpty());
  for (const std::string& name :
       {beside + ".json", beside + ".run.json", std::string("fabric.toml")})
    EXPECT_TRUE(fs::exists(out() / "files" / name)) << name;
  fs::remove(split);
  EXPECT_THAT(findings(), Contains("gone: " + split.string()));
}

TEST_F(CrateOf, ARunWhoseSheetWasMadeAgainIsNotTraced) {
  first_key_ = key_of_first();
  make(sheets_[1], another());
  import();
  EXPECT_THAT(findings(1), Contains(HasSubstr("no record of how it was made: ")));
  EXPECT_FALSE(why().good);
  EXPECT_EQ(why().tables[1].rows.back()[4], "not traced");
  EXPECT_THAT(findings(2), IsEmpty());
}

TEST_F(CrateOf, AFileWhoseRecordIsGoneOrOfAnotherContentIsNotTraced) {
  first_key_ = key_of_first();
  const fs::path record = run_record_path(sheets_[1]);
  const std::string recorded = read_text(record);
  fs::remove(record);
  EXPECT_THAT(findings(), Contains(HasSubstr("no record of how it was made: ")));
  EXPECT_FALSE(why().good);
  write_durable(record, recorded);
  EXPECT_THAT(findings(), IsEmpty());
  write_durable(folder_.path() / "A" / "points.json",
                "{\"schema\": \"drapebench/detections/1\"}\n");
  EXPECT_THAT(findings(), Contains(HasSubstr("not what was recorded: ")));
  const fs::path sheet = fs::path(sheets_[1]).replace_extension(".json");
  EXPECT_TRUE(RecordBook().is_traced(sheet));
  write_sheet(sheet, another());
  EXPECT_FALSE(RecordBook().is_traced(sheet)) << "its record is of another content";
}

TEST_F(CrateOf, ASceneThatWasEditedIsNotTheRunsScene) {
  std::string text = read_text(scene_);
  const std::size_t at = text.find("friction = 0.4");
  ASSERT_NE(at, std::string::npos);
  write_durable(scene_, text.replace(at, 14, "friction = 0.3"));
  record(sheets_[0]);  // the measured sheet is made again and remains the same
  const auto found = findings();
  EXPECT_THAT(found, Contains("not what was recorded: " + scene_.string()));
  EXPECT_THAT(found, Contains(HasSubstr("gone: scene A as it was simulated")));
  EXPECT_FALSE(fs::exists(out() / "files" / "scenes" / "A.toml"));
}

TEST_F(CrateOf, SimulationsAloneHaveTheirNumbersAndAnEmptyStoreHasNone) {
  const fs::path apart = folder_.path() / "apart.sqlite", empty = folder_.path() / "empty.sqlite";
  (void)import_simulations(apart, {sheets_.begin() + 1, sheets_.end()});
  EXPECT_THAT(findings(std::nullopt, apart), IsEmpty());
  EXPECT_THAT(text("simulations.csv"), HasSubstr("at rest"));
  Store(empty).close();
  EXPECT_THAT(findings(std::nullopt, empty), Contains("the store holds no number"));
}

}  // namespace
}  // namespace drape::compare
