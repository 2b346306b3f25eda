// SPDX-License-Identifier: Apache-2.0
#include "core/sheet.hpp"

#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

Sheet measured_sheet() {
  Sheet sheet{.rows = 2, .cols = 2, .patch_m = {0.04, 0.06}, .marks = {}, .gaps = {}, .source = {}};
  Eigen::Matrix3d covariance;
  covariance << 3e-10, 1e-10, 0, 1e-10, 2e-10, 0, 0, 0, 1e-10;
  sheet.marks = {{{0, 0}, {0.01, 0.01}, {0.1, 1.0 / 3.0, -0.2}, covariance, 3, 0.02},
                 {{0, 1}, {0.01, 0.03}, {0.2, 0, 0}, std::nullopt, std::nullopt, std::nullopt},
                 {{1, 1}, {0.03, 0.03}, {0.3, 0, 1e-9}, covariance, 2, 0.5}};
  sheet.gaps = {{{1, 0}, "seen by one camera"}};
  sheet.source = MeasuredSource{"bench", "drape_A", {"cam0", "cam1"}, "aa", "bb"};
  sheet.error_budget = ErrorBudget{1.0 / 64e3, std::nullopt, 3e-5, 4e-5, 1e-5};
  return sheet;
}

class SheetFile : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  fs::path file_ = folder_.path() / "sheet.ply";
};

TEST_F(SheetFile, ComesBackWithEverything) {
  const Sheet written = measured_sheet();
  write_sheet(file_, written);
  const Sheet read = read_sheet(file_);
  ASSERT_EQ(read.marks.size(), 3U);
  EXPECT_TRUE(read.is_measured());
  EXPECT_EQ(std::get<MeasuredSource>(read.source).cameras.size(), 2U);
  EXPECT_EQ(read.gaps.at(0).reason, "seen by one camera");
  ASSERT_TRUE(read.error_budget.has_value());
  EXPECT_NEAR(read.error_budget->detection_m, 1.0 / 64e3, 1e-18);
  EXPECT_FALSE(read.error_budget->calibration_m.has_value());
  EXPECT_NEAR(read.error_budget->total_m, 4e-5, 1e-18);
  EXPECT_NEAR(read.error_budget->target_m.value(), 1e-5, 1e-18);
  EXPECT_FALSE(read.marks[1].covariance_m2.has_value());
  EXPECT_FALSE(read.marks[1].views.has_value());
  for (std::size_t i = 0; i < 3; ++i) {
    // Metres to millimetres and back costs at most the last digit.
    EXPECT_LT((read.marks[i].point_in_world - written.marks[i].point_in_world).norm(), 1e-15);
  }
  EXPECT_LT((*read.marks[0].covariance_m2 - *written.marks[0].covariance_m2).norm(), 1e-24);
}

TEST_F(SheetFile, IsTheSameBytesAfterReadingAndWriting) {
  write_sheet(file_, measured_sheet());
  const std::string ply = read_text(file_), json = read_text(folder_.path() / "sheet.json");
  write_sheet(file_, read_sheet(file_));
  EXPECT_EQ(read_text(file_), ply);
  EXPECT_EQ(read_text(folder_.path() / "sheet.json"), json);
}

TEST_F(SheetFile, RefusesAPlyOfAnotherSheet) {
  Sheet other = measured_sheet();
  other.marks[0].point_in_world.x() += 1e-6;
  write_sheet(folder_.path() / "other.ply", other);
  write_sheet(file_, measured_sheet());
  fs::copy_file(folder_.path() / "other.ply", file_, fs::copy_options::overwrite_existing);
  EXPECT_THROW(static_cast<void>(read_sheet(file_)), Error);
}

TEST_F(SheetFile, RefusesMarksTwiceOrOutside) {
  for (const MarkId wrong : {MarkId{0, 0}, MarkId{2, 1}, MarkId{-1, 0}}) {
    Sheet sheet = measured_sheet();
    sheet.marks[1].mark = wrong;
    write_sheet(file_, sheet);
    EXPECT_THROW(static_cast<void>(read_sheet(file_)), Error) << wrong.row << ' ' << wrong.col;
  }
}

TEST_F(SheetFile, RefusesANewerFileInOneSentence) {
  write_sheet(file_, measured_sheet());
  const fs::path json = folder_.path() / "sheet.json";
  std::string text = read_text(json);
  const std::string schema = "drapebench/sheet/";
  text.replace(text.find(schema) + schema.size(), 1, "99");
  write_durable(json, text);
  try {
    static_cast<void>(read_sheet(file_));
    FAIL() << "a newer file was read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("newer"));
    EXPECT_EQ(error.what_failed().find('\n'), std::string::npos);
  }
}

TEST(SheetMarks, AreFoundByTheirIndex) {
  const Sheet sheet = measured_sheet();
  ASSERT_NE(sheet.find({1, 1}), nullptr);
  EXPECT_EQ(sheet.find({1, 1})->views, 2);
  EXPECT_EQ(sheet.find({1, 0}), nullptr);
}

}  // namespace
}  // namespace drape
