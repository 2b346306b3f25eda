// SPDX-License-Identifier: Apache-2.0
// A rule about a scene, print, target or fabric is applied by every program that reads it, with the
// same message.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "core/scene.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr const char* kScene = "scenes/C.toml";

/// A wrong value in one file of a bench, and the words of the rule that it breaks.
struct BrokenRule {
  std::string from, to, said;
};

class InputRules : public testing::Test {
 protected:
  /// Breaks each rule in turn; expects every line to exit with 3, the words and the location.
  void expect_refused(const char* file, const std::vector<BrokenRule>& rules,
                      const std::vector<std::string>& lines) const {
    const std::string good = read_text(bench_.rig() / file);
    for (const auto& [from, to, said] : rules) {
      bench_.replace(file, from, to);
      for (const std::string& line : lines) {
        const Outcome outcome = run_line(line);
        EXPECT_EQ(outcome.exit_code, 3) << line << outcome.text;
        EXPECT_THAT(outcome.text, HasSubstr(said)) << line;
        EXPECT_THAT(outcome.text, HasSubstr(fs::path(file).filename().string() + ":")) << line;
      }
      write_durable(bench_.rig() / file, good);
    }
  }

  [[nodiscard]] static std::string line(const char* name, const std::string& words) {
    return fmt::format("{} {}", program(name).string(), words);
  }
  [[nodiscard]] std::string path(const char* file) const { return (bench_.rig() / file).string(); }
  [[nodiscard]] std::string out(const char* file) const {
    return " --out " + (bench_.folder() / file).string();
  }
  [[nodiscard]] std::string checked() const { return line("drape", "check " + path("")); }
  /// A console that starts by mistake would serve for ever.
  [[nodiscard]] std::string console() const {
    return "timeout 60 " + line("drape-bench", path("") + " --replay --port 0" + out("bench"));
  }
  [[nodiscard]] std::string drawn() const {
    return line("drape-synth", path("") + " --sets drape_C --cameras " +
                                   (source_root() / "rigs/plans/three-cameras.toml").string() +
                                   out("drawn"));
  }
  [[nodiscard]] std::string detected(const char* surface) const {
    return line("drape-detect", path("recording") + " --rig " + path("rig.toml") + " --surface " +
                                    surface + out("found.json"));
  }
  [[nodiscard]] std::string simulated(const std::string& words) const {
    return line("drape-simulate",
                words + ' ' + path(kScene) + " --spacing-mm 10 --segments 1" + out("virtual"));
  }
  /// The reference can be any file: the scene is read before it.
  [[nodiscard]] std::string sensitive() const {
    return simulated("sensitivity --reference " + path("rig.toml"));
  }

  const SmallBench bench_{{"C"}};
};

TEST_F(InputRules, OfAScene) {
  const std::string friction = "friction = 0.4", any = path("rig.toml");
  expect_refused(
      kScene,
      {{friction, "friction = 21.8", "a friction coefficient of 21.8"},
       {friction, "friction = 0.4\nfriction_uncertainty = 0.5", "nothing would be known"},
       {friction, "friction = 0.4\ngravity_m_per_s2 = [0, 0, -1.6]",
        "gravity of 1.6 m/s2 is not the Earth's"},
       {friction, "friction = 0.4\ngravity_m_per_s2 = [0, 0, 9.8]", "gravity does not point down"},
       {"size_mm = [128.0, 128.0, 128.0]", "size_mm = [0.1, 0.1, 0.1]",
        "the object is 0.1 mm long"},
       {"edge_radius_mm = 1.5", "edge_radius_mm = 80", "the rounded edges are larger"},
       {"x_mm = -3.0", "x_mm = -30000", "places are in mm"},
       {"yaw_deg = 14.0", "yaw_deg = 1400", "an angle in degrees"},
       {"yaw_deg = 14.0\n", "", "`yaw_deg` of a box is missing"},
       {"clearance_mm = 3.0", "clearence_mm = 3.0", "start.clearance_mm"},
       {"stand_ins = [\"friction\"]", "stand_ins = [\"fricton\"]", "did you mean `friction`"},
       {friction, "friction = 0.4\n[[pin]]\nrow = 11\ncol = 0", "pin"}},
      {checked(), simulated(""), simulated("branches"), sensitive(),
       line("drape-simulate", "study " + path("") + out("study")), drawn(), console(),
       line("drape-triangulate", any + " --calibration " + any + " --set drape_C --scene " +
                                     path(kScene) + out("sheet.ply")),
       line("drape-triangulate", "object " + any + " --calibration " + any +
                                     " --set drape_C --scene " + path(kScene) +
                                     out("object.json"))});
}

TEST_F(InputRules, OfAPrint) {
  expect_refused("print.toml",
                 {{"tag36h11", "TAG36H11", "did you mean `tag36h11`"},
                  {"first_id = 0", "first_id = 560", "the family tag36h11 has no tag 587"},
                  {"edge_mm = 12.0", "edge_mm = 24.0", "would be printed over dot"},
                  {"patch_mm = [220.0, 220.0]", "patch_mm = [2200.0, 2200.0]", "is it 220?"},
                  {"dot_diameter_mm = 4.0", "dot_diameter_mm = 24.0", "smaller than pitch_mm"}},
                 {checked(), detected("cloth"), simulated(""), drawn(), console(),
                  line("drape-detect", "print cloth " + path("print.toml") + out("print.pdf"))});
}

TEST_F(InputRules, OfATarget) {
  const std::string any = path("rig.toml");
  expect_refused("target.toml",
                 {{"tag36h11", "TAG36H11", "did you mean `tag36h11`"},
                  {"id = 403", "id = 4003", "the family tag36h11 has no tag 4003"},
                  {"id = 403", "id = 402", "two tags have the id 402"},
                  {"[-80.0, -50.0]", "[-8.0, -5.0]", "would be printed over dot"},
                  {"dot_diameter_mm = 8.0", "dot_diameter_mm = 28.0", "smaller than pitch_mm"}},
                 {checked(), detected("target"), drawn(), console(),
                  line("drape-detect", "print target " + path("target.toml") + out("target.pdf")),
                  line("drape-calib", any + " --rig " + any + out("calibration.json"))});
}

TEST_F(InputRules, OfAFabric) {
  const std::string density = "areal_density_g_per_m2 = 138", fabric = path("fabrics/A.toml");
  expect_refused("fabrics/A.toml",
                 {{density, "areal_density_g_per_m2 = 0.138", "kg/m2"},
                  {density, "areal_density_g_per_m2 = 13800", "no textile weighs"},
                  {"\"shear curves\"", "\"sheer curves\"", "did you mean `shear curves`"},
                  {"warp = \"A/shear_warp.csv\"\n", "", "`warp` is missing"}},
                 {checked(), simulated(""), simulated("branches"), sensitive(),
                  line("drape-simulate", "fabric " + fabric),
                  line("drape-simulate", "cusick " + fabric + out("cusick"))});
}

TEST(EditedInput, CountsAsItWasRead) {
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
