// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/repeats.hpp"

#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {
namespace {

using testing::HasSubstr;
using units::mm;

SheetFile laying(const std::string& name, const std::string& scene, const std::string& face = "") {
  SheetFile sheet{name, name + ".json", name + ".ply", {}};
  if (!scene.empty()) sheet.repeat = RepeatId{scene, name, face};
  sheet.sheet.patch_m = {220 * mm, 220 * mm};
  sheet.sheet.source = MeasuredSource{"rig", name, {}, "calibration", "detections"};
  return sheet;
}

SheetFile simulation(const std::string& name, const std::string& scene,
                     const std::optional<std::string>& placed_by = {}) {
  SheetFile sheet = laying(name, "");
  SimulatedSource source;
  source.scene = scene;
  source.start_sha256 = placed_by;
  source.status = "at rest";
  sheet.sheet.source = source;
  return sheet;
}

std::string refusal(const std::vector<SheetFile>& repeats,
                    const std::vector<SheetFile>& virtual_sheets) {
  try {
    require_one_drape(repeats, virtual_sheets);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "";
}

TEST(RepeatSheets, OfOneSceneAreRepeats) {
  const auto one = laying("1", "C"), two = laying("2", "C"), three = laying("3", "C");
  EXPECT_EQ(refusal({one, two, three}, {simulation("s", "C")}), "");
  EXPECT_EQ(refusal({one, two, three}, {}), "");
  // The drape's own laying need not name itself if it was used to position the simulation.
  EXPECT_EQ(refusal({laying("1", ""), two, three}, {simulation("s", "C", "1.json")}), "");
  EXPECT_EQ(refusal({laying("1", ""), two, three}, {simulation("s", "C", "1.ply")}), "");
}

TEST(RepeatSheets, LayingsAreMeasuredAndWhatIsJudgedIsSimulated) {
  const auto one = laying("1", "C"), two = laying("2", "C"), three = laying("3", "C");
  const auto judged = simulation("s", "C");
  EXPECT_THAT(refusal({simulation("t", "C"), simulation("u", "C")}, {judged}),
              testing::AllOf(HasSubstr("no laying"), HasSubstr("where: t")));
  EXPECT_THAT(refusal({one, judged, two}, {judged}), HasSubstr("where: s"));
  EXPECT_THAT(refusal({one, judged}, {}), HasSubstr("no laying"));
  EXPECT_THAT(refusal({one, two}, {judged, three}),
              testing::AllOf(HasSubstr("no simulation"), HasSubstr("where: 3")));
  EXPECT_THAT(refusal({one, two, three}, {one}), HasSubstr("no simulation"));
}

TEST(RepeatSheets, OfSeveralDrapesAreRefused) {
  const auto one = laying("1", "C"), two = laying("2", "C");
  EXPECT_THAT(refusal({one, two, laying("3", "A")}, {}), HasSubstr("scene `A`"));
  EXPECT_THAT(refusal({one, two}, {simulation("s", "A")}), HasSubstr("scene `A`"));
  EXPECT_THAT(refusal({one, two}, {simulation("s", "C"), simulation("t", "A")}),
              HasSubstr("scene `A`"));
  EXPECT_THAT(refusal({one, two, one}, {}), HasSubstr("copy of 1"));
  EXPECT_THAT(refusal({one, two, laying("3", "")}, {simulation("s", "C", "1.json")}),
              testing::AllOf(HasSubstr("does not say"), HasSubstr("where: 3")));
  // Three drapes, one of which was used to position the simulation.
  EXPECT_THAT(refusal({laying("C", ""), laying("A", ""), laying("E", "")},
                      {simulation("s", "C", "C.json")}),
              HasSubstr("where: A"));
  EXPECT_THAT(refusal({laying("C", ""), laying("A", "")},
                      {simulation("s", "C", "C.json"), simulation("t", "A", "A.json")}),
              HasSubstr("scene `A`"));
}

TEST(RepeatSheets, OfAnotherBenchAreRefused) {
  const auto one = laying("1", "C");
  SheetFile other = laying("2", "C", "back");
  EXPECT_THAT(refusal({one, other}, {}), HasSubstr("face"));
  other = laying("2", "C");
  std::get<MeasuredSource>(other.sheet.source).calibration_sha256 = "other";
  EXPECT_THAT(refusal({one, other}, {}), HasSubstr("another calibration"));
  SheetFile smaller = simulation("s", "C");
  smaller.sheet.patch_m.x() = 200 * mm;
  EXPECT_THAT(refusal({one}, {smaller}), HasSubstr("another patch"));
}

TEST(RepeatSheets, WhatIsNoGoMakesTheRepeatsNoGo) {
  SheetFile measured = laying("1", "C"), falling = simulation("s", "C");
  measured.sheet.no_go = "the target is bent";
  std::get<SimulatedSource>(falling.sheet.source).status = "time is up";
  EXPECT_THAT(no_go_of({measured, falling, laying("2", "C"), simulation("t", "C")}),
              testing::ElementsAre(HasSubstr("bent"), HasSubstr("time is up")));
}

TEST(RepeatSheets, AreReadWithWhatTheirFilesSay) {
  const drape::test::TemporaryFolder folder;
  const auto file = folder.path() / "sheet.ply";
  Sheet sheet;
  sheet.rows = sheet.cols = 2;
  sheet.patch_m = {220 * mm, 220 * mm};
  for (int row = 0; row < 2; ++row)
    for (int col = 0; col < 2; ++col)
      sheet.marks.push_back({{row, col},
                             {row * 220 * mm, col * 220 * mm},
                             {row * 0.2, col * 0.2, 0},
                             1e-9 * Eigen::Matrix3d::Identity(),
                             3,
                             0.1});
  sheet.source = MeasuredSource{"rig", "C_2", {"cam0"}, std::string(64, 'a'), std::string(64, 'b')};
  write_sheet(file, sheet);
  const SheetFile own = read_sheet_file(file);
  EXPECT_EQ(own.scene(), "");
  EXPECT_EQ(own.ply_sha256, sha256_of_file(file));
  const auto json = folder.path() / "sheet.json";
  Json content = parse_json(read_text(json));
  content["source"]["asked_scene"] = {
      {"name", "E"}, {"sha256", std::string(64, 'c')}, {"surroundings", Json::object()}};
  write_json(json, content);
  EXPECT_EQ(read_sheet_file(file).scene(), "E") << "the first laying of a run";
  content["source"]["repeat"] = {{"scene", "C"}, {"repeat", "2"}, {"face", "back"}};
  write_json(json, content);
  EXPECT_EQ(read_sheet_file(file).scene(), "C");
  EXPECT_EQ(read_sheet_file(file).face(), "back");
}

TEST(RepeatSheets, OneLayingUnderTwoSetsIsNamed) {
  const auto measured = [](const std::string& name, const std::string& scene, double x_mm) {
    SheetFile sheet = laying(name, scene);
    for (int i = 0; i < 16; ++i)
      sheet.sheet.marks.push_back({{i / 4, i % 4},
                                   {20 * mm * (i / 4), 20 * mm * (i % 4)},
                                   Eigen::Vector3d(x_mm + 20 * i, 0, 0) * mm,
                                   Eigen::Matrix3d::Identity() * std::pow(0.03 * mm, 2),
                                   3,
                                   0.05});
    return sheet;
  };
  const SheetFile a = measured("A", "A", 0), again = measured("A_again", "B", 0.05),
                  b = measured("B", "B", 1), repeat = measured("A_2", "A", 0.05);
  const auto found = layings_twice({&a, &again, &b});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].reason, HasSubstr("sets A and A_again show one laying"));
  EXPECT_EQ(found[0].first, a.sha256);
  EXPECT_EQ(found[0].second, again.sha256);
  EXPECT_FALSE(found[0].one_drape);
  const auto unmoved = layings_twice({&a, &repeat, &b});
  ASSERT_EQ(unmoved.size(), 1U);
  EXPECT_TRUE(unmoved[0].one_drape);
}

}  // namespace
}  // namespace drape::compare
