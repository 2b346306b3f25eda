// SPDX-License-Identifier: Apache-2.0
// Mistakes of an operator that would give a plausible but wrong drape coefficient.
#include "compare/hems/hem_files.hpp"

#include <fmt/format.h>

#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {
namespace {

using testing::HasSubstr;
using units::mm;

/// A hem of five nodes.
double radius_mm(int angle_deg, double turn_deg = 0) {
  return 115 + 12 * std::cos(5 * (angle_deg - turn_deg) * units::deg) +
         4 * std::sin(angle_deg * units::deg);
}

std::vector<int> every(int step_deg, int end_deg = 360) {
  std::vector<int> angles;
  for (int angle = 0; angle < end_deg; angle += step_deg) angles.push_back(angle);
  return angles;
}

using Radius = std::function<double(int angle_deg)>;

std::string table(const std::vector<int>& angles_deg, const std::vector<Radius>& rows) {
  std::string text = "fabric,repeat";
  for (const int angle : angles_deg) text += fmt::format(",r{:03d}", angle);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    text += fmt::format("\nwool,{}", i + 1);
    for (const int angle : angles_deg) text += fmt::format(",{:.4f}", rows[i](angle));
  }
  return text + "\n";
}

class HemFiles : public testing::Test {
 protected:
  [[nodiscard]] HemSet read(const std::string& text, const HemReadOptions& options = {}) const {
    write_durable(folder_.path() / "hems.csv", text);
    return read_hems({folder_.path() / "hems.csv"}, options);
  }
  void expect_refused(const std::string& text, const std::string& reason) const {
    const HemSet set = read(text);
    EXPECT_TRUE(set.hems.empty());
    ASSERT_EQ(set.refused.size(), 1U) << reason;
    EXPECT_THAT(set.refused.front(), HasSubstr(reason));
  }
  test::TemporaryFolder folder_;
};

const Radius kHem = [](int angle) { return radius_mm(angle); };

Radius times(double factor) {
  return [factor](int angle) { return factor * radius_mm(angle); };
}

TEST_F(HemFiles, ColumnsStandInAnyOrderAndGoAllRound) {
  const HemSet usual = read(table(every(5), {kHem}));
  ASSERT_EQ(usual.hems.size(), 1U) << usual.refused.front();
  std::vector<int> mixed(72);
  for (int i = 0; i < 72; ++i) mixed[i] = 5 * (i * 29 % 72);
  const HemSet other = read(table(mixed, {kHem}));
  ASSERT_EQ(other.hems.size(), 1U);
  EXPECT_EQ(other.hems[0].nodes.size(), 5U);
  EXPECT_EQ(other.hems[0].hem.radius_m, usual.hems[0].hem.radius_m);
  EXPECT_NEAR(read(table(every(10), {kHem})).hems.at(0).drape_coefficient(),
              usual.hems[0].drape_coefficient(), 1e-3);
  // 50 steps of 7.2 degrees, in whole degrees.
  std::vector<int> fifty(50);
  for (int i = 0; i < 50; ++i) fifty[i] = static_cast<int>(std::lround(7.2 * i));
  EXPECT_EQ(read(table(fifty, {kHem})).hems.size(), 1U);
  expect_refused(table(every(5, 180), {kHem}), "equal steps");
  for (const int missing : {5, 180, 355}) {
    std::vector<int> fewer = every(5);
    std::erase(fewer, missing);
    expect_refused(table(fewer, {kHem}), "71 columns of radii do not go round in equal steps");
  }
  expect_refused(table(every(20), {kHem}), "18 columns");
}

TEST_F(HemFiles, AHemThatNoDrapeOfTheGeometryCanHaveIsRefused) {
  for (const double factor : {0.1, 1 / 25.4, 0.001})  // cm, inches, metres
    expect_refused(table(every(5), {times(factor)}), "smaller than the disc of 180 mm");
  expect_refused(table(every(5), {times(10)}), "larger than the specimen of 300 mm");
  expect_refused(table(every(5), {[](int) { return 200; }}), "larger than the specimen");
  expect_refused(table(every(5), {[](int angle) { return angle == 90 ? 210 : radius_mm(angle); }}),
                 "mm wide");
  // The limits themselves: as limp and as stiff as cloth can be, with a scale 2 % wrong.
  for (const double radius : {90, 150})
    for (const double scale : {0.98, 1.02})
      EXPECT_EQ(read(table(every(5), {[=](int) { return scale * radius; }})).hems.size(), 1U);
  HemReadOptions uncertain;
  uncertain.scale_u = 0.05;
  const std::string wide = table(every(5), {[](int) { return 165; }});
  const HemSet taken = read(wide, uncertain);
  ASSERT_EQ(taken.hems.size(), 1U);
  EXPECT_EQ(read(hems_csv(uncertain.geometry, taken.hems)).hems.size(), 1U)
      << "hems.csv is an input again: U of its area tells how far its scale errs";
  uncertain.scale_u = 0.03;
  EXPECT_EQ(read(wide, uncertain).refused.size(), 1U);
  expect_refused(wide, "larger than the specimen");
}

TEST_F(HemFiles, ACopyIsNoRepeat) {
  const Radius turned = [](int angle) { return radius_mm(angle, 20); };
  const HemSet set = read(table(every(5), {kHem, turned, kHem}));
  EXPECT_EQ(set.hems.size(), 2U);
  ASSERT_EQ(set.refused.size(), 1U);
  EXPECT_THAT(set.refused[0], testing::AllOf(HasSubstr("hems.csv:4"), HasSubstr("hems.csv:2"),
                                             HasSubstr("a copy")));
  const auto file = folder_.path() / "hems.csv";
  EXPECT_EQ(read_hems({file, file}, {}).hems.size(), 2U);
}

TEST_F(HemFiles, ACopyOfARealHemIsNoVirtualOne) {
  HemSet real = read(table(every(5), {kHem, times(1.02)}));
  const Radius turned = [](int angle) { return radius_mm(angle - 35); };
  const Radius mirrored = [](int angle) { return radius_mm(360 - angle); };
  const Radius near = [](int angle) { return radius_mm(angle) + 0.01; };
  HemSet compared = read(table(every(5), {kHem, turned, mirrored, near}));
  ASSERT_EQ(compared.hems.size(), 4U);
  refuse_copies_of(real, compared);
  ASSERT_EQ(compared.hems.size(), 1U);
  EXPECT_THAT(compared.hems[0].file, HasSubstr("hems.csv:5"));
  EXPECT_EQ(compared.refused.size(), 3U);
  EXPECT_THAT(compared.refused[0], HasSubstr("hems.csv:2, a copy"));
  // hems.csv keeps radii to 0.1 um and no order 36.
  for (int i = 0; i < 720; ++i)
    real.hems[0].hem.radius_m[i] += 0.05 * mm * std::cos(36 * i * 0.5 * units::deg);
  HemSet stored = read(hems_csv({"", 0.180, 0.300}, real.hems));
  refuse_copies_of(real, stored);
  EXPECT_TRUE(stored.hems.empty());
}

TEST_F(HemFiles, HemsCsvKeepsTheVerdictTheTestTheAreasAndU) {
  HemReadOptions options;
  options.geometry = geometry_of(StandardTest::jis_254);
  options.scale_u = 0.01;
  HemSet set = read(table(every(5), {times(0.9), times(0.95)}), options);
  ASSERT_EQ(set.hems.size(), 2U) << set.refused.front();
  HemRecord& moving = set.hems[1];
  moving.hem.flat_area_m2 = 0.049;
  moving.hem.area_m2 *= 0.98;  // a fold overhangs
  moving.numbers = numbers_with_u(moving.hem, {{}, options.scale_u}, options.geometry);
  moving.go = false;
  moving.warnings = {"not at rest, # of steps\nused up"};
  const std::string text = hems_csv(options.geometry, set.hems);

  HemReadOptions same;
  same.geometry = options.geometry;
  const HemSet again = read(text, same);
  ASSERT_EQ(again.hems.size(), 2U) << again.refused.front();
  EXPECT_TRUE(again.hems[0].go);
  EXPECT_FALSE(again.hems[1].go);
  EXPECT_THAT(again.hems[1].warnings, testing::ElementsAre("not at rest, # of steps used up"));
  for (const int i : {0, 1}) {
    const HemNumber &before = set.hems[i].numbers.front(), &after = again.hems[i].numbers.front();
    EXPECT_NEAR(after.value, before.value, 1e-3);
    ASSERT_TRUE(before.u && after.u);
    EXPECT_NEAR(*after.u, *before.u, 0.005 * *before.u) << "three digits";
  }
  const HemSet other = read(text);
  EXPECT_TRUE(other.hems.empty());
  ASSERT_EQ(other.refused.size(), 1U);
  EXPECT_THAT(other.refused[0], HasSubstr("--disc-mm 127 --specimen-mm 254"));

  HemRecord silent = set.hems[0];
  silent.go = false;
  EXPECT_FALSE(read(hems_csv(same.geometry, {silent}), same).hems.at(0).go) << "without a reason";
}

TEST_F(HemFiles, AnAreaThatIsNotThatOfTheRadiiIsRefused) {
  std::string text = hems_csv({"", 0.180, 0.300}, read(table(every(5), {kHem})).hems);
  EXPECT_EQ(read(text).hems.size(), 1U);
  const std::size_t line = text.find('\n');
  text.insert(line, ",area_mm2");
  text.insert(text.size() - 1, ",30000");
  expect_refused(text, "two columns are named `area_mm2`");
  text = table(every(5), {kHem});
  text.insert(text.find('\n'), ",area_mm2");
  text.insert(text.size() - 1, ",30000");
  expect_refused(text, "the area is 3e+04 mm2");
}

TEST_F(HemFiles, ATableWithoutAHemIsRefused) {
  expect_refused(table(every(5), {}), "no row");
}

TEST_F(HemFiles, AColumnThatIsPassedOverCouldTellFabricsApart) {
  const std::string text = table(every(5), {kHem});
  const auto renamed = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    return other.replace(other.find(from), from.size(), to);
  };
  expect_refused(renamed("fabric", "Fabric"), "`Fabric`: did you mean `fabric`?");
  expect_refused(renamed("repeat", "Repeat"), "did you mean `repeat`?");
  expect_refused(renamed("repeat", "specimen"), "no column `specimen`");
  expect_refused(renamed("repeat", "series"), "no column `series`");
  expect_refused(renamed("repeat", "fabric"), "two columns are named `fabric`");
  EXPECT_EQ(read(renamed("repeat", "nodes")).hems.size(), 1U) << "a number";
}

/// A flat square of 200 mm from a cloth of 250 mm, which can hang over anything.
Sheet bench_sheet(int side = 3) {
  Sheet sheet;
  sheet.rows = sheet.cols = side;
  sheet.patch_m = {250 * mm, 250 * mm};
  const double step = 1.0 / (side - 1);
  for (int row = 0; row < side; ++row)
    for (int col = 0; col < side; ++col)
      sheet.marks.push_back({{row, col},
                             {row * step * 250 * mm, col * step * 250 * mm},
                             {row * step * 200 * mm, col * step * 200 * mm, 0},
                             {},
                             {},
                             {}});
  SimulatedSource source;
  source.scene = "C";
  source.fabric = "cotton";
  source.scene_sha256 = source.fabric_sha256 = std::string(64, 'a');
  source.segments = 5;
  source.model = "consistent";
  source.solver = "static";
  source.status = "at rest";
  sheet.source = source;
  return sheet;
}

std::filesystem::path write_bench_sheet(const std::filesystem::path& file) {
  write_sheet(file, bench_sheet());
  return file;
}

/// Writes a sheet of 5x5 marks, without the given ones.
std::filesystem::path write_measured_sheet(const std::filesystem::path& file,
                                           const std::vector<MarkId>& gaps) {
  Sheet sheet = bench_sheet(5);
  std::erase_if(sheet.marks, [&](const SheetMark& mark) {
    return std::find(gaps.begin(), gaps.end(), mark.mark) != gaps.end();
  });
  for (const MarkId gap : gaps) sheet.gaps.push_back({gap, "seen by one camera (cam0)"});
  for (SheetMark& mark : sheet.marks) {
    mark.covariance_m2 = 1e-9 * Eigen::Matrix3d::Identity();
    mark.views = 3;
    mark.reprojection_px = 0.1;
  }
  sheet.source = MeasuredSource{"rig", "C", {"cam0"}, std::string(64, 'a'), std::string(64, 'b')};
  write_sheet(file, sheet);
  return file;
}

HemReadOptions over_a_disc() {
  HemReadOptions options;
  options.disc_stated = true;
  return options;
}

TEST_F(HemFiles, AHemThatWasNotMeasuredAllAroundHasNoCoefficient) {
  const auto file = folder_.path() / "C" / "sheet.ply";
  const HemSet whole = read_hems({write_measured_sheet(file, {})}, over_a_disc());
  ASSERT_EQ(whole.hems.size(), 1U) << whole.refused.front();
  for (const std::vector<MarkId>& gaps : {std::vector<MarkId>{{0, 0}}, {{4, 2}, {1, 4}}}) {
    const HemSet broken = read_hems({write_measured_sheet(file, gaps)}, over_a_disc());
    EXPECT_TRUE(broken.hems.empty());
    ASSERT_EQ(broken.refused.size(), 1U);
    EXPECT_THAT(broken.refused[0], HasSubstr(fmt::format("{} of 16 outermost marks", gaps.size())));
  }
  const HemSet spanned =
      read_hems({write_measured_sheet(file, {{1, 1}, {2, 1}, {2, 3}})}, over_a_disc());
  ASSERT_EQ(spanned.hems.size(), 1U) << spanned.refused.front();
  EXPECT_NEAR(spanned.hems[0].drape_coefficient(), whole.hems[0].drape_coefficient(), 1e-9);
  EXPECT_THAT(spanned.hems[0].warnings, testing::ElementsAre(HasSubstr("3 marks inside the hem")));
}

TEST_F(HemFiles, ASheetsSpecimenIsItsOwnFlatArea) {
  const auto file = write_bench_sheet(folder_.path() / "C" / "sheet.ply");
  HemReadOptions options = over_a_disc();
  const HemSet set = read_hems({file}, options);
  ASSERT_EQ(set.hems.size(), 1U) << set.refused.front();
  const auto number = [](const HemRecord& hem, const std::string& name) {
    return number_named(hem.numbers, name);
  };
  const double radius = 250 / std::sqrt(std::numbers::pi);  // circle of equal area
  const double mean = number(set.hems[0], "mean_radius_mm");
  EXPECT_NEAR(number(set.hems[0], "drape_distance_ratio_percent"),
              100 * (radius - mean) / (radius - 90), 1e-9);
  EXPECT_NEAR(number(set.hems[0], "fold_depth_index_percent"),
              100 * (100 * std::sqrt(2.0) - 100) / (radius - 90), 1e-6);
  options.specimen_stated = true;
  const HemSet wrong = read_hems({file}, options);
  ASSERT_EQ(wrong.refused.size(), 1U);
  EXPECT_THAT(wrong.refused[0], HasSubstr("a round specimen of 282.1 mm, not 300 mm"));
  options.geometry.specimen_m = 280 * mm;
  EXPECT_EQ(read_hems({file}, options).hems.size(), 1U);

  const HemSet again = read(hems_csv({"", 0.180, 0.300}, set.hems));
  ASSERT_EQ(again.hems.size(), 1U) << again.refused.front();
  for (const char* name : {"drape_distance_ratio_percent", "fold_depth_index_percent"})
    EXPECT_NEAR(number(again.hems[0], name), number(set.hems[0], name), 1) << "72 radii";
  EXPECT_EQ(hems_csv({"", 0.180, 0.300}, again.hems).find(",300,"), std::string::npos);
}

TEST_F(HemFiles, WhatIsJudgedIsVirtualAndWhatItIsJudgedByIsNot) {
  const auto simulated = write_bench_sheet(folder_.path() / "C" / "sheet.ply");
  const auto measured = write_measured_sheet(folder_.path() / "M" / "sheet.ply", {{2, 2}});
  HemSet real = read_hems({measured, simulated}, over_a_disc()),
         compared = read_hems({simulated, measured}, over_a_disc());
  refuse_other_kinds(real, compared);
  ASSERT_EQ(real.hems.size(), 1U);
  EXPECT_EQ(real.hems[0].file, measured.string());
  EXPECT_THAT(real.refused, testing::ElementsAre(HasSubstr(simulated.string())));
  ASSERT_EQ(compared.hems.size(), 1U);
  EXPECT_EQ(compared.hems[0].file, simulated.string());
  EXPECT_THAT(compared.refused, testing::ElementsAre(HasSubstr(measured.string())));
  HemSet pictures = read(table(every(5), {kHem})), others = pictures;
  refuse_other_kinds(pictures, others);
  EXPECT_EQ(pictures.hems.size() + others.hems.size(), 2U) << "which do not say what they are";
  EXPECT_THAT(match_hems(pictures.hems, compared.hems, {}).at(0).reason,
              HasSubstr("another flat area"));
}

TEST_F(HemFiles, AHemThatComesInsideTheDiscIsDoubted) {
  const auto wavy = [](double mean_mm) {
    return Radius([mean_mm](int angle) { return mean_mm + 12 * std::cos(5 * angle * units::deg); });
  };
  EXPECT_TRUE(read(table(every(5), {wavy(105)})).hems.at(0).warnings.empty());
  EXPECT_THAT(read(table(every(5), {wavy(95)})).hems.at(0).warnings,
              testing::ElementsAre(HasSubstr("inside the disc of 180 mm")));
}

TEST_F(HemFiles, ASheetOfABenchNeedsItsDiscStated) {
  const auto a = write_bench_sheet(folder_.path() / "C" / "sheet.ply");
  const HemSet assumed = read_hems({a}, {});
  EXPECT_TRUE(assumed.hems.empty());
  ASSERT_EQ(assumed.refused.size(), 1U);
  EXPECT_THAT(assumed.refused[0], HasSubstr("--disc-mm"));
  EXPECT_EQ(read_hems({a}, over_a_disc()).hems.size(), 1U);
}

TEST_F(HemFiles, FilesOfOneNameInSeveralFoldersAreSeveralFabrics) {
  const auto flat = [&](const std::string& folder, double radius_mm) {
    auto file = folder_.path() / folder / "sheet.obj";
    std::string corners, face = "f";
    for (int k = 0; k < 32; ++k) {
      const double angle = 11.25 * k * units::deg;
      corners +=
          fmt::format("v {} {} 0\n", radius_mm * std::cos(angle), radius_mm * std::sin(angle));
      face += fmt::format(" {}", k + 1);
    }
    write_durable(file, corners + face + "\n");
    return file;
  };
  HemReadOptions small;
  small.geometry.disc_m = 0.12;
  small.geometry.specimen_m = 0.202;
  const HemSet set = read_hems({flat("A", 100), flat("C", 102)}, small);
  ASSERT_EQ(set.hems.size(), 2U) << set.refused.front();
  EXPECT_NE(set.hems[0].fabric, set.hems[1].fabric);
  EXPECT_EQ(read_hems({flat("A", 100)}, small).hems.at(0).fabric, "sheet");
  EXPECT_THAT(read_hems({flat("A", 100)}, {}).refused,
              testing::ElementsAre(HasSubstr("specimen of 199.4 mm, not 300 mm")));
}

}  // namespace
}  // namespace drape::compare
