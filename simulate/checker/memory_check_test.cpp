// SPDX-License-Identifier: Apache-2.0
// Drapes with internal friction: energy balance, independent check, and the files between them.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

struct RememberedDrape {
  RememberedDrape(const std::string& name, const std::string& solver, bool friction, int grid)
      : scene(read_scene(test::source_root() / "rigs/paper/scenes" / (name + ".toml"))),
        fabric(read_fabric(scene.fabric_file)),
        print(read_print(scene.print_file)) {
    options.rows = options.cols = grid;
    options.solver = solver;
    options.internal_friction = friction;
    result = simulate(scene, fabric, print, std::nullopt, options);
  }
  [[nodiscard]] CertifyReport judge() const {
    return certify(result.sheet, scene, fabric, print, claim_of(result, options));
  }
  Scene scene;
  Fabric fabric;
  Print print;
  SimulateOptions options;
  SimulateResult result;
};

std::string what_fails(const CertifyReport& report) {
  std::string text;
  for (const CertifyLine& line : report.lines)
    if (!line.passes())
      text += line.what + ": found " + std::to_string(line.found) + ", stated " +
              std::to_string(line.claimed) + "\n";
  for (const std::string& refusal : report.refusals) text += refusal + "\n";
  return text;
}

TEST(MemoryCheck, RestsWithInternalFrictionAreAcceptedAndSpoiltMemoriesAreNot) {
  for (const char* solver : {"fall", "static", "rk4"}) {
    RememberedDrape drape("C", solver, true, 11);
    ASSERT_EQ(drape.result.report.status, RestStatus::at_rest)
        << solver << ": " << drape.result.report.sentence;
    ASSERT_TRUE(drape.result.memory);
    EXPECT_GT(drape.result.report.lost_internal_friction_j.value_or(0), 0);
    const CertifyReport report = drape.judge();
    EXPECT_TRUE(report.accepted()) << solver << "\n" << what_fails(report);
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
    EXPECT_FALSE(drape.judge().accepted()) << solver;
    drape.result.memory = whole;
    drape.result.memory->shear.pop_back();
    EXPECT_FALSE(drape.judge().refusals.empty()) << solver;
  }
}

TEST(MemoryCheck, RestsAfterAHistoryAreAcceptedAndDifferByIt) {
  for (const char* solver : {"fall", "static", "rk4"}) {
    RememberedDrape fresh("C", solver, true, 11), worn = fresh;
    worn.scene.start.history = {"bent 1 per cm along warp", "shaken 1 times by 30 %"};
    if (solver != std::string("rk4"))
      worn.scene.start.history.insert(worn.scene.start.history.begin() + 1, "draped 1 times");
    worn.result = simulate(worn.scene, worn.fabric, worn.print, std::nullopt, worn.options);
    ASSERT_EQ(worn.result.report.status, RestStatus::at_rest)
        << solver << ": " << worn.result.report.sentence;
    const CertifyReport report = worn.judge();
    EXPECT_TRUE(report.accepted()) << solver << "\n" << what_fails(report);
    EXPECT_NE(worn.result.memory->bending[0], fresh.result.memory->bending[0]) << solver;
    double farthest = 0;
    for (std::size_t i = 0; i < worn.result.sheet.marks.size(); ++i)
      farthest = std::max(farthest, (worn.result.sheet.marks[i].point_in_world -
                                     fresh.result.sheet.marks[i].point_in_world)
                                        .norm());
    EXPECT_GT(farthest, 0.05 * units::mm) << solver;
  }
  RememberedDrape plain("C", "static", false, 11);
  plain.scene.start.history = {"draped 1 times"};
  plain.result = simulate(plain.scene, plain.fabric, plain.print, std::nullopt, plain.options);
  const auto& warnings = plain.result.report.warnings;
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const std::string& text) {
    return text.find("start.history leaves no trace") == 0;
  }));
}

/// The interval: what friction holds is another rest than that without, and both are accepted.
TEST(MemoryCheck, FrictionMovesTheRest) {
  const RememberedDrape with("C", "fall", true, 11), without("C", "fall", false, 11);
  ASSERT_EQ(with.result.report.status, RestStatus::at_rest);
  ASSERT_EQ(without.result.report.status, RestStatus::at_rest);
  EXPECT_FALSE(without.result.memory);
  double farthest = 0;
  for (std::size_t i = 0; i < with.result.sheet.marks.size(); ++i)
    farthest = std::max(farthest, (with.result.sheet.marks[i].point_in_world -
                                   without.result.sheet.marks[i].point_in_world)
                                      .norm());
  EXPECT_GT(farthest, 0.5 * units::mm);
}

}  // namespace
}  // namespace drape::simulate
