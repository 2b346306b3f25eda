// SPDX-License-Identifier: Apache-2.0
// Points of another instrument, from the front door to a measured sheet.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "core/sheet.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

using testing::HasSubstr;
using units::mm;

TEST(ImportedPoints, BecomeTheMarksOfTheScenesPrint) {
  const TemporaryFolder folder;
  std::string table = "x_mm,y_mm,z_mm,warp_mm,weft_mm\n";
  const auto& truth = bench1_truth().drapes.at("C");
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Eigen::Vector3d at_mm = truth[i].point_in_world / mm;
    table += fmt::format("{},{},{},{},{}\n", at_mm.x(), at_mm.y(), at_mm.z(), 10 + 20 * (i / 11),
                         10 + 20 * (i % 11));
  }
  const auto cloud = folder.path() / "cloud.csv", out = folder.path() / "sheet.ply";
  write_durable(cloud, table);
  const auto import = [&](const std::string& more) {
    return run_line(fmt::format("'{}' import --points '{}' --scene '{}' --out '{}' {}",
                                program("drape").string(), cloud.string(),
                                (source_root() / "rigs/bench1/scenes/C.toml").string(),
                                out.string(), more));
  };
  const Outcome without = import("");
  EXPECT_EQ(without.exit_code, 3);
  EXPECT_THAT(without.text, HasSubstr("how far a point may be off"));
  const Outcome outcome = import("--sigma-mm 0.02");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_THAT(outcome.text, HasSubstr("121 of 121 marks from 121 points"));
  const Sheet sheet = read_sheet(out);
  ASSERT_EQ(sheet.marks.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_LT((sheet.marks[i].point_in_world - truth[i].point_in_world).norm(), 1e-9);
  EXPECT_EQ(std::get<MeasuredSource>(sheet.source).detections_sha256, sha256_of_file(cloud));
}

}  // namespace
}  // namespace drape::test
