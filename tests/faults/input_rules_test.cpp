// SPDX-License-Identifier: Apache-2.0
// A rule about a scene is asked by every program that reads it, in the same words.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <tuple>

#include "core/files/files.hpp"
#include "core/scene.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr const char* kScene = "scenes/C.toml";

TEST(InputRules, AreAskedByEveryProgramThatReadsAScene) {
  const SmallBench bench({"C"});
  const std::string good = read_text(bench.rig() / kScene);
  const std::string scene = (bench.rig() / kScene).string(),
                    other = (bench.rig() / "rig.toml").string();
  const std::vector<std::string> lines = {
      fmt::format("{} check {}", program("drape").string(), bench.rig().string()),
      fmt::format("{} {} --spacing-mm 10 --segments 1 --out {}", program("drape-simulate").string(),
                  scene, (bench.folder() / "virtual").string()),
      fmt::format("{} {} --calibration {} --set drape_C --scene {} --out {}",
                  program("drape-triangulate").string(), other, other, scene,
                  (bench.folder() / "sheet.ply").string())};
  const std::string friction = "friction = 0.4";
  for (const auto& [from, to, said] :
       {std::tuple{friction, "friction = 21.8", "a friction coefficient of 21.8"},
        std::tuple{friction, "friction = 0.4\nfriction_uncertainty = 0.5",
                   "nothing would be known"},
        std::tuple{friction, "friction = 0.4\ngravity_m_per_s2 = [0, 0, -1.6]",
                   "gravity of 1.6 m/s2 is not the Earth's"},
        std::tuple{friction, "friction = 0.4\ngravity_m_per_s2 = [0, 0, 9.8]",
                   "gravity does not point down"},
        std::tuple{std::string("size_mm = [128.0, 128.0, 128.0]"), "size_mm = [0.1, 0.1, 0.1]",
                   "the object is 0.1 mm long"},
        std::tuple{std::string("edge_radius_mm = 1.5"), "edge_radius_mm = 80",
                   "the rounded edges are larger than the box"},
        std::tuple{std::string("x_mm = -3.0"), "x_mm = -30000", "places are in mm"},
        std::tuple{std::string("yaw_deg = 14.0"), "yaw_deg = 1400", "an angle in degrees"},
        std::tuple{std::string("clearance_mm = 3.0"), "clearence_mm = 3.0",
                   "start.clearance_mm"}}) {
    write_durable(bench.rig() / kScene, good);
    bench.replace(kScene, from, to);
    for (const std::string& line : lines) {
      const Outcome outcome = run_line(line);
      EXPECT_EQ(outcome.exit_code, 3) << line << outcome.text;
      EXPECT_THAT(outcome.text, HasSubstr(said)) << line;
      EXPECT_THAT(outcome.text, HasSubstr("C.toml:")) << line;
    }
  }
}

TEST(InputRules, AFileThatIsEditedMeanwhileCountsAsItWasRead) {
  const SmallBench bench({"C"});
  const std::string before = sha256_of_file(bench.rig() / kScene);
  const Scene scene = read_scene(bench.rig() / kScene);
  bench.replace(kScene, "128.0, 128.0, 128.0", "100.0, 100.0, 100.0");
  EXPECT_EQ(scene.document.sha256(), before);
  EXPECT_NE(sha256_of_file(bench.rig() / kScene), before);
  EXPECT_EQ(surroundings_of(scene, sha256_of_file).at("object.1.size_mm"), "128, 128, 128");
}

}  // namespace
}  // namespace drape::test
