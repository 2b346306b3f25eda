// SPDX-License-Identifier: Apache-2.0
// What friction and the grid leave open of a drape, as the budget takes it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "compare/tables/budget.hpp"
#include "compare/test_sheets.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;
using units::mm;

constexpr double kLeft_mm = 0.2;  // by a push down, off the measured sheet

test::Shape raised(double by_m) {
  return [by_m](const Vector2d& m) -> Vector3d { return test::flat(m) + Vector3d(0, 0, by_m); };
}

/// Pushes up and down, of which the latter counts or not.
Json band_of(bool counts) {
  Json marks = Json::array(), up = Json::array(), down = Json::array();
  for (int k = 0; k < 121; ++k) {
    marks.push_back({{"row", k / 11},
                     {"col", k % 11},
                     {"rest_mm", {0.0, 0.0, 5.0}},
                     {"low_mm", {0.0, 0.0, 5.0 - kLeft_mm}},
                     {"high_mm", {0.0, 0.0, 5.0 + kLeft_mm}}});
    up.push_back({0.0, 0.0, kLeft_mm});
    down.push_back({0.0, 0.0, -kLeft_mm});
  }
  Json pushes = Json::array();
  pushes.push_back({{"push_per_weight", {0.0, 0.0, -0.1}}, {"ending", "on another branch"}});
  if (counts) pushes.back()["moves_mm"] = down;
  pushes.push_back({{"push_per_weight", {0.0, 0.0, 0.1}}, {"ending", "at rest"}, {"moves_mm", up}});
  return {{"friction", 0.2}, {"pushes", pushes}, {"marks", marks}};
}

/// A drape 5 mm above the measured sheet, with a list of branches that has a band.
DrapeInput drape_with(const std::filesystem::path& folder, bool counts) {
  DrapeInput input =
      test::drape_of(test::measured_sheet(), {test::simulated_sheet(31, 5, raised(5 * mm)),
                                              test::simulated_sheet(21, 5, raised(5 * mm)),
                                              test::simulated_sheet(15, 5, raised(5 * mm))});
  const std::filesystem::path list = folder / "branches.json";
  Json json;
  json["schema"] = "drapebench/branches/1";
  json["friction_band"] = band_of(counts);
  write_json(list, json);
  input.simulations[2].sheet.file = folder / "branch-01" / "sheet.ply";
  std::filesystem::create_directories(folder / "branch-01");
  input.simulations[2].branch = Branch{sha256_of_file(list), 1, 1, 1e-3, 1e-7, true, 32, 4, false};
  return input;
}

TEST(FrictionInTheBudget, IsDrawnBetweenWhatOppositePushesLeave) {
  const drape::test::TemporaryFolder folder;
  for (const bool counts : {true, false}) {
    const DrapeInput input = drape_with(folder.path(), counts);
    const Report report = compare_drape(input, {});
    const BudgetInputs inputs = budget_inputs_of(input, report, std::nullopt);
    const auto effect = std::find_if(
        inputs.effects.begin(), inputs.effects.end(),
        [](const InputEffect& one) { return one.what.find("friction's interval") == 0; });
    ASSERT_NE(effect, inputs.effects.end());
    EXPECT_TRUE(effect->rectangular);
    ASSERT_EQ(effect->down_m.rows(), 121);
    EXPECT_NEAR(effect->up_m(60, 2) / mm, kLeft_mm, 1e-12);
    EXPECT_NEAR(effect->down_m(60, 2) / mm, counts ? -kLeft_mm : 0, 1e-12);
    // Every mark moves along its distance, so the mean distance as much.
    if (counts)
      EXPECT_NEAR(alone_m(inputs.differences_m, *effect) / mm, kLeft_mm / std::sqrt(3.0), 1e-6);
    else
      EXPECT_THAT(effect->origin, HasSubstr("one ends elsewhere"));
    EXPECT_THAT(friction_sentence(*friction_band_of(input, report)),
                HasSubstr("up to 0.200 mm away"));
  }
}

TEST(FrictionInTheBudget, AListThatIsAnotherByNowHasNone) {
  const drape::test::TemporaryFolder folder;
  const DrapeInput input = drape_with(folder.path(), true);
  const Report report = compare_drape(input, {});
  ASSERT_TRUE(friction_band_of(input, report).has_value());
  write_durable(folder.path() / "branches.json", "{}");
  EXPECT_FALSE(friction_band_of(input, report).has_value());
}

// Where the marks err by the square of the spacing, what is left is exact.
TEST(GridError, IsExtrapolatedOnOneBranchOnly) {
  constexpr double kCurve_m = 400 * mm;
  const auto simulated = [](int n) {
    return test::simulated_sheet(n, 5, raised(kCurve_m / ((n - 1) * (n - 1))));
  };
  DrapeInput input =
      test::drape_of(test::measured_sheet(), {simulated(31), simulated(21), simulated(11)});
  const Report report = compare_drape(input, {});
  const auto alone = grid_error_of(input, report);
  ASSERT_TRUE(alone.has_value());
  EXPECT_NEAR(alone->apart_m, kCurve_m * (1.0 / 400 - 1.0 / 900), 1e-12);
  EXPECT_FALSE(alone->left_m.has_value());
  EXPECT_THAT(grid_sentence(*alone), HasSubstr("without an ensemble"));
  input.ensemble = Ensemble{};
  input.ensemble->reach_m = 2 * alone->apart_m;
  const auto near = grid_error_of(input, report);
  ASSERT_TRUE(near && near->left_m);
  EXPECT_NEAR(*near->left_m, kCurve_m / 900, 1e-12);
  input.ensemble->reach_m = 0.5 * alone->apart_m;
  const auto far = grid_error_of(input, report);
  ASSERT_TRUE(far.has_value());
  EXPECT_FALSE(far->left_m.has_value());
  EXPECT_THAT(grid_sentence(*far), HasSubstr("other folds"));
}

}  // namespace
}  // namespace drape::compare
