// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>

#include "compare/report/account.hpp"
#include "compare/report/report.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using units::mm;

Json variant(const char* what, const char* from, bool at_rest, double change_mm) {
  return {{"what", what},           {"from", from},
          {"at_rest", at_rest},     {"mean_distance_mm", 1.5 + change_mm},
          {"change_mm", change_mm}, {"mean_way_of_marks_mm", 2 * std::abs(change_mm)}};
}

/// Writes a run of drape-simulate sensitivity beside the speaker's sheet, as the program does.
fs::path write_split(const fs::path& measured, const std::string& scene = "scene",
                     const std::string& fabric = "fabric", const std::string& no_go = {},
                     const Json& changes = Json::object()) {
  fs::path file = measured.parent_path() / "simulations/21-5" / kSensitivityName;
  Json json = {
      {"schema", "drapebench/sensitivity/1"},
      {"rows", 21},
      {"cols", 21},
      {"segments", 5},
      {"model", "consistent"},
      {"marks", 119},
      {"mean_distance_mm", 1.5},
      {"sensitivities", Json::array()},
      {"variants",
       {variant("mass rule paper", "base", true, 0.25), variant("grid 11x11", "start", false, 9),
        variant("twist < none", "start", true, -0.75)}}};
  for (const char* value : {"bending_warp", "areal_density"}) {
    json["sensitivities"].push_back(
        {{"value", value},
         {"mean_distance_mm_per_percent", value[0] == 'b' ? 0.01 : -0.02},
         {"mean_way_of_marks_mm_per_percent", 0.05}});
  }
  if (!no_go.empty()) json["no_go"] = no_go;
  json["marks_at"] = {{0, 0}, {0, 1}};
  Json& bending = json["sensitivities"][0];
  bending["step"] = bending["half_width"] = 50;
  bending["down_mm"] = {{0, 0, -1.5}, {0, 0, -2}};
  bending["up_mm"] = {{0, 0, 1}, {0.5, 0, 1}};
  json.update(changes);
  write_json(file, json);
  RunRecord record("drape-simulate", {"A.toml", "--reference", "sheet.ply"}, run_record_path(file));
  record.input("A.toml", sha256_of(std::string_view(scene)));
  record.input("fabric.toml", sha256_of(std::string_view(fabric)));
  record.input(fs::path(measured).replace_extension(".json"));
  record.output(file);
  record.write(0);
  return file;
}

struct Example {
  drape::test::TemporaryFolder folder;
  std::vector<fs::path> sheets = test::write_example(folder.path() / "A");
  fs::path split = write_split(sheets.front());
};

TEST(ErrorSplit, IsReadBesideTheSheetThatSpeaksForTheDrape) {
  const Example example;
  const Session session = read_session(example.sheets, {});
  const auto& split = session.drapes.front().error_split;
  ASSERT_TRUE(split);
  EXPECT_EQ(split->marks, 119);
  EXPECT_DOUBLE_EQ(split->distance_m, 1.5 * mm);
  ASSERT_EQ(split->variants.size(), 3U);
  EXPECT_TRUE(split->variants[0].continued);
  EXPECT_FALSE(split->variants[1].at_rest);
  EXPECT_DOUBLE_EQ(split->variants[2].change_m, -0.75 * mm);
  EXPECT_THAT(split->marks_at, testing::ElementsAre(MarkId{0, 0}, MarkId{0, 1}));
  ASSERT_TRUE(split->values[0].moves);
  EXPECT_EQ(split->values[0].moves->half_width, 50);
  EXPECT_DOUBLE_EQ(split->values[0].moves->down_m(1, 2), -2 * mm);
  EXPECT_DOUBLE_EQ(split->values[0].moves->up_m(1, 0), 0.5 * mm);
  EXPECT_FALSE(split->values[1].moves) << "a file from before, or no rest";
}

TEST(ErrorSplit, OfAnotherSheetIsLeftOutWithAWarning) {
  const Example example;
  write_sheet(example.sheets.front(), test::measured_sheet());
  const Session session = read_session(example.sheets, {});
  EXPECT_FALSE(session.drapes.front().error_split);
  EXPECT_THAT(session.warnings,
              testing::Contains(HasSubstr("simulate the drape again with --sensitivity")));
}

TEST(ErrorSplit, OfADrapeThatIsNotComparedIsLeftOutWithAWarning) {
  const Example example;
  for (const auto& [key, value, said] : std::vector<std::tuple<const char*, Json, const char*>>{
           {"rows", 13, "is of 13x21, 5 segments (consistent), not of 21x21, 5 segments"},
           {"segments", 1, "is of 21x21, 1 segment (consistent), not of"},
           {"model", "consistent, internal friction", "(consistent, internal friction), not of"},
           {"rows", nullptr, "does not say of which mesh it is"}}) {
    Json changes = Json::object();
    changes[key] = value;
    write_split(example.sheets.front(), "scene", "fabric", "", changes);
    const Session session = read_session(example.sheets, {});
    EXPECT_EQ(session.drapes.front().error_split.has_value(), said == nullptr) << key;
    if (said != nullptr) {
      EXPECT_THAT(session.warnings, testing::Contains(HasSubstr(said)));
    }
  }
}

TEST(ErrorSplit, OfAnotherSceneOrFabricOrOfANoGoIsLeftOutWithAWarning) {
  const Example example;
  const auto read = [&](const char* scene, const char* fabric, const char* no_go) {
    write_split(example.sheets.front(), scene, fabric, no_go);
    Session session = read_session(example.sheets, {});
    const bool used = session.drapes.front().error_split.has_value();
    const bool hashed = std::any_of(session.read.begin(), session.read.end(),
                                    [&](const auto& one) { return one.first == example.split; });
    EXPECT_EQ(used, hashed) << "what is left out is not behind the numbers";
    return used ? std::vector<std::string>{"used"} : session.warnings;
  };
  EXPECT_THAT(read("scene", "fabric", ""), testing::ElementsAre("used"));
  EXPECT_THAT(
      read("scene", "fabric of 100 g/m2", ""),
      testing::Contains(HasSubstr("not made from the fabric that was simulated (21x21, 5")));
  EXPECT_THAT(read("scene, edited", "fabric", ""),
              testing::Contains(HasSubstr("not made from the scene that was simulated (21x21, 5")));
  EXPECT_THAT(read("scene", "fabric", "cam1 moved"),
              testing::Contains(HasSubstr("a measurement that is NO-GO: cam1 moved")));
  Sheet measured = read_sheet(example.sheets.front());
  measured.no_go = "cam1 moved";
  write_sheet(example.sheets.front(), measured);
  EXPECT_THAT(read("scene", "fabric", "cam1 moved"), testing::ElementsAre("used"))
      << "the drape is NO-GO by the same cause";
}

TEST(ErrorSplit, ADamagedFileIsRefusedByName) {
  const Example example;
  std::string text = read_text(example.split);
  text.replace(text.find("change_mm"), 9, "change_um");
  write_durable(example.split, text);
  try {
    static_cast<void>(read_record<SensitivityFile>(example.split));
    FAIL() << "a file with a misspelt key was read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("sensitivity.json"));
    EXPECT_THAT(error.what(), HasSubstr("change_mm"));
  }
}

TEST(ErrorSplit, TheGreatestChangeAtRestIsNamed) {
  const Example example;
  const SensitivityFile split = read_record<SensitivityFile>(example.split);
  EXPECT_EQ(variant_effect_table(split).marked_row, 2U) << "the greatest of all is not at rest";
  EXPECT_EQ(value_effect_table(split).rows.front()[0], "areal density");
  EXPECT_THAT(error_split_sentence(split), HasSubstr("twist < none"));
  EXPECT_THAT(error_split_sentence(split), HasSubstr("-0.750 mm"));
  EXPECT_THAT(error_split_sentence({}), IsEmpty());
}

TEST(ErrorSplit, StandsInTheReportAndInTablesBesideIt) {
  const Example example;
  const Session session = read_session(example.sheets, {});
  Outcome outcome;
  compare_session(session, {}, outcome);
  const fs::path report = example.folder.path() / "report.html";
  static_cast<void>(write_report(report, account_of(session, outcome, example.folder.path())));
  const std::string html = read_text(report);
  EXPECT_THAT(html, HasSubstr("\"model-changes\""));
  EXPECT_THAT(html, HasSubstr("twist \\u003c none"));
  EXPECT_THAT(html, Not(HasSubstr("twist < none")));
  EXPECT_TRUE(fs::is_regular_file(example.folder.path() / "report" / "A-fabric-values.csv"));
  EXPECT_THAT(read_text(example.folder.path() / "report" / "A-model-changes.csv"),
              HasSubstr("twist < none,the start,0.750,-0.750,1.500,yes"));
}

}  // namespace
}  // namespace drape::compare
