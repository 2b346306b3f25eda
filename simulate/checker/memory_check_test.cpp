// SPDX-License-Identifier: Apache-2.0
// Drapes with internal friction: energy balance, independent check, and the files between them.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/test_drape.hpp"
#include "tests/support/judged_drape.hpp"

namespace drape::simulate {
namespace {

Case remembered(Solver solver, bool friction = true) {
  return {"C", SimulateOptions{.internal_friction = friction, .solver = solver}};
}

TEST(MemoryCheck, RestsWithInternalFrictionAreAcceptedAndSpoiltMemoriesAreNot) {
  for (const Solver solver : {Solver::fall, Solver::newton, Solver::rk4}) {
    Case drape = remembered(solver);
    ASSERT_EQ(drape.result.report.status, RestStatus::at_rest)
        << drape::name_of(solver) << ": " << drape.result.report.sentence;
    ASSERT_TRUE(drape.result.memory);
    EXPECT_GT(drape.result.report.lost_internal_friction_j.value_or(0), 0);
    const CertifyReport report = drape.judge();
    EXPECT_TRUE(report.accepted()) << drape::name_of(solver) << "\n" << listed(report);
    // The file says the same.
    const test::TemporaryFolder folder;
    write_durable(folder.path() / "memory.csv", memory_csv(*drape.result.memory));
    const ClothMemory read = read_memory(folder.path() / "memory.csv");
    EXPECT_EQ(read.bending[0], drape.result.memory->bending[0]);
    EXPECT_EQ(read.bending[1], drape.result.memory->bending[1]);
    EXPECT_EQ(read.shear, drape.result.memory->shear);
    // Slips forgotten: other forces. One lost: no memory of this grid.
    const ClothMemory whole = *drape.result.memory;
    ClothMemory& memory = *drape.result.memory;
    for (auto* slips : {&memory.bending[0], &memory.bending[1], &memory.shear})
      std::fill(slips->begin(), slips->end(), 0.0);
    drape.claim = claim_of(drape.result, drape.options);
    EXPECT_FALSE(drape.judge().accepted()) << drape::name_of(solver);
    drape.result.memory = whole;
    drape.result.memory->shear.pop_back();
    drape.claim = claim_of(drape.result, drape.options);
    EXPECT_FALSE(drape.judge().refusals.empty()) << drape::name_of(solver);
  }
}

TEST(MemoryCheck, RestsAfterAHistoryAreAcceptedAndDifferByIt) {
  for (const Solver solver : {Solver::fall, Solver::newton, Solver::rk4}) {
    Case fresh = remembered(solver), worn = fresh;
    worn.scene.start.history = {"bent 1 per cm along warp", "shaken 1 times by 30 %"};
    if (solver != Solver::rk4)
      worn.scene.start.history.insert(worn.scene.start.history.begin() + 1, "draped 1 times");
    worn.drape();
    ASSERT_EQ(worn.result.report.status, RestStatus::at_rest)
        << drape::name_of(solver) << ": " << worn.result.report.sentence;
    const CertifyReport report = worn.judge();
    EXPECT_TRUE(report.accepted()) << drape::name_of(solver) << "\n" << listed(report);
    EXPECT_NE(worn.result.memory->bending[0], fresh.result.memory->bending[0])
        << drape::name_of(solver);
    EXPECT_GT(farthest_m(worn.result.sheet, fresh.result.sheet), 0.05 * units::mm)
        << drape::name_of(solver);
  }
  Case plain = remembered(Solver::newton, false);
  plain.scene.start.history = {"draped 1 times"};
  plain.drape();
  const auto& warnings = plain.result.report.warnings;
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const std::string& text) {
    return text.find("start.history leaves no trace") == 0;
  }));
}

/// The interval: what friction holds is another rest than that without, and both are accepted.
TEST(MemoryCheck, FrictionMovesTheRest) {
  const Case with = remembered(Solver::fall), without = remembered(Solver::fall, false);
  ASSERT_EQ(with.result.report.status, RestStatus::at_rest);
  ASSERT_EQ(without.result.report.status, RestStatus::at_rest);
  EXPECT_FALSE(without.result.memory);
  EXPECT_GT(farthest_m(with.result.sheet, without.result.sheet), 0.5 * units::mm);
}

}  // namespace
}  // namespace drape::simulate
