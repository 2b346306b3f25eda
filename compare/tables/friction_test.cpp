// SPDX-License-Identifier: Apache-2.0
// Friction in the budget of a drape.
#include <gmock/gmock.h>

#include "compare/tables/match.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;
using units::mm;

constexpr double kLeft_mm = 0.2;  // by a push down, away from the measured sheet

test::Shape raised(double by_m) {
  return [by_m](const Vector2d& m) -> Vector3d { return test::flat(m) + Vector3d(0, 0, by_m); };
}

std::vector<Vector3d> moves(double z_mm) {
  return std::vector<Vector3d>(121, Vector3d(0, 0, z_mm * mm));
}

/// Pushes up and down, of which the latter counts only if `counts`.
FrictionBand band_of(bool counts) {
  FrictionBand band{0.2,
                    {{"", "on another branch", Vector3d(0, 0, -0.1), {}},
                     {"", "at rest", Vector3d(0, 0, 0.1), moves(kLeft_mm)}},
                    {},
                    {}};
  if (counts) band.pushes[0].moves_m = moves(-kLeft_mm);
  for (int k = 0; k < 121; ++k)
    band.marks.push_back({{k / 11, k % 11},
                          Vector3d(0, 0, 5 * mm),
                          Vector3d(0, 0, (5 - kLeft_mm) * mm),
                          Vector3d(0, 0, (5 + kLeft_mm) * mm)});
  return band;
}

/// Writes the list of branches for the third simulation of a drape.
void set_list(const std::filesystem::path& file, const BranchList& list, DrapeInput& input) {
  write_record(file, list);
  input.simulations[2].sheet.file = file.parent_path() / "branch-01" / "sheet.ply";
  std::filesystem::create_directories(file.parent_path() / "branch-01");
  input.simulations[2].branch = test::branch(sha256_of_file(file), 1, 1, 1e-3, 32);
}

/// A drape 5 mm above the measured sheet, with a list of branches that has a band, and five drapes
/// with all values wrong of which so many stay on the branch.
DrapeInput drape_with(const std::filesystem::path& folder, bool counts, std::size_t stay = 3) {
  DrapeInput input =
      test::drape_of(test::measured_sheet(), {test::simulated_sheet(31, 5, raised(5 * mm)),
                                              test::simulated_sheet(21, 5, raised(5 * mm)),
                                              test::simulated_sheet(15, 5, raised(5 * mm))});
  BranchList list;
  list.friction_band = band_of(counts);
  BeyondFirstOrder& beyond = list.beyond_first_order.emplace();
  for (const MarkInterval& one : list.friction_band->marks) beyond.marks_at.push_back(one.mark);
  for (std::size_t k = 0; k < 5; ++k) {
    beyond.rests.push_back({k < stay ? "at rest" : "on another branch", {}, {}});
    if (k >= stay) continue;
    const double sign = k % 2 == 0 ? 1 : -1;
    beyond.rests.back().moves_m = moves(sign * kLeft_mm);
    beyond.rests.back().first_order_m = moves(sign * 0.6 * kLeft_mm);
  }
  set_list(folder / "branches.json", list, input);
  return input;
}

/// Every mark moves along its distance, so that the mean distance changes as much: three drapes
/// that move by 0.2 mm and by 0.12 mm to first order leave a root mean square of 0.16 mm, which
/// Student's t of three degrees of freedom widens. Drapes that move less than to first order leave
/// nothing.
TEST(BeyondFirstOrder, IsALineByWhatDrapesOnTheBranchMoveMore) {
  const drape::test::TemporaryFolder folder;
  constexpr double kStudent = 3.18245;  // 97.5 %, three degrees of freedom: printed tables
  for (const std::size_t stay : {3U, 1U}) {
    const DrapeInput input = drape_with(folder.path(), true, stay);
    const BudgetInputs inputs = budget_inputs_of(input, compare_drape(input, {}), std::nullopt);
    ASSERT_EQ(inputs.drawn.size(), stay);
    const Budget budget = budget_of(inputs);
    const auto line = std::find_if(budget.lines.begin(), budget.lines.end(), [](const auto& one) {
      return one.what == "answers beyond first order";
    });
    const bool is_missing =
        std::any_of(budget.missing.begin(), budget.missing.end(), [](const std::string& what) {
          return what.find("1 of 5 drapes with all stated values wrong") != std::string::npos;
        });
    EXPECT_EQ(is_missing, stay == 1);
    ASSERT_EQ(line == budget.lines.end(), stay == 1);
    if (stay == 1) continue;
    EXPECT_NEAR(line->u_m / mm, kStudent / 1.96 * 0.8 * kLeft_mm, 1e-5);
    std::vector<DrawnTogether> less = inputs.drawn;
    for (DrawnTogether& one : less) std::swap(one.moves_m, one.first_order_m);
    EXPECT_EQ(beyond_m(inputs.differences_m, less), 0);
    EXPECT_THAT(friction_sentence(*speaking_list(input)->friction_band),
                HasSubstr("up to 0.200 mm away"));
  }
}

/// With an ensemble: between the ends with the lowest and highest position, which include the rest.
/// Otherwise the displacement of the drape by the loops, up and down.
TEST(InternalFrictionInTheBudget, IsALineOfItsOwn) {
  const drape::test::TemporaryFolder folder;
  DrapeInput input = drape_with(folder.path(), true);
  const auto line_of = [&](const std::optional<SensitivityFile>& split) {
    const Report report = compare_drape(input, {});
    for (const InputEffect& effect : budget_inputs_of(input, report, split).effects)
      if (effect.what == "internal friction's interval") return std::optional(effect);
    return std::optional<InputEffect>();
  };
  EXPECT_FALSE(line_of(std::nullopt));
  SensitivityFile split;
  Eigen::MatrixX3d up_m = Eigen::MatrixX3d::Zero(121, 3);
  up_m.col(2).setConstant(0.4 * mm);
  for (int k = 0; k < 121; ++k) split.marks_at.push_back({k / 11, k % 11});
  split.scene.push_back({"internal_friction", 0.4 * mm, MarkMoves{1, 1.0, -up_m, up_m}});
  const auto by_loops = line_of(split);
  ASSERT_TRUE(by_loops);
  EXPECT_TRUE(by_loops->rectangular);
  EXPECT_EQ(by_loops->down_m, -up_m);
  EXPECT_THAT(by_loops->origin, HasSubstr("+0.400 mm"));

  BranchList list;
  list.friction_band = band_of(true);
  list.memory_band = MemoryBand{0.75, {}, list.friction_band->marks};
  for (const double z_mm : {-0.3, -0.1, 0.05})
    list.memory_band->ends.push_back({"pressed", "at rest", {}, moves(z_mm)});
  list.memory_band->ends.push_back({"draped once more", "on another branch", {}, {}});
  set_list(folder.path() / "branches.json", list, input);
  const auto by_band = line_of(split);
  ASSERT_TRUE(by_band);
  EXPECT_NEAR(by_band->down_m(60, 2) / mm, -0.3, 1e-12);
  EXPECT_NEAR(by_band->up_m(60, 2) / mm, 0.05, 1e-12);
  EXPECT_NEAR(
      alone_m(budget_inputs_of(input, compare_drape(input, {}), split).differences_m, *by_band) /
          mm,
      0.3 / std::sqrt(3.0), 1e-6)
      << "the farther end of the range, as if it were symmetrical";
  const std::string text = memory_sentence(*speaking_list(input)->memory_band);
  EXPECT_THAT(text, HasSubstr("lies at 75 %"));
  EXPECT_THAT(text, HasSubstr("1 of 4 ends"));
}

TEST(FrictionInTheBudget, AListThatIsAnotherByNowHasNone) {
  const drape::test::TemporaryFolder folder;
  const DrapeInput input = drape_with(folder.path(), true);
  const Report report = compare_drape(input, {});
  ASSERT_TRUE(speaking_list(input)->friction_band);
  write_durable(folder.path() / "branches.json", "{}");
  EXPECT_FALSE(speaking_list(input));
}

using Change = void (*)(Simulation&);
SimulatedSource& source_of(Simulation& simulation) {
  return std::get<SimulatedSource>(simulation.sheet.sheet.source);
}

/// Settings that make a simulation a different drape, unlike mesh or segments.
constexpr std::array<Change, 2> kOtherSetups{
    [](Simulation& one) { source_of(one).fabric_sha256 = std::string(64, 'f'); },
    [](Simulation& one) { source_of(one).scene_sha256 = std::string(64, '0'); }};

TEST(FrictionInTheBudget, IsThatOfAnEnsembleOfTheHeadlinesCloth) {
  const drape::test::TemporaryFolder folder;
  for (const std::size_t other : {0U, 1U}) {
    DrapeInput input = drape_with(folder.path(), true);
    kOtherSetups.at(other)(input.simulations[2]);
    const Report report = compare_drape(input, {});
    EXPECT_FALSE(speaking_list(input));
    EXPECT_TRUE(budget_inputs_of(input, report, std::nullopt).drawn.empty());
    EXPECT_THAT(report.warnings, testing::Contains(HasSubstr("count for neither match nor U")));
  }
}

}  // namespace
}  // namespace drape::compare
