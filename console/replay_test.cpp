// SPDX-License-Identifier: Apache-2.0
// Limits of a recording that is replayed: the real server and programs, no camera.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "core/files/files.hpp"
#include "core/scene.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/running_bench.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using units::mm;

class Replay : public testing::Test {
 protected:
  [[nodiscard]] fs::path out() const { return bench_.folder() / "out"; }
  static void take(const RunningBench& server, const std::vector<std::string>& sets) {
    for (const std::string& set : sets)
      ASSERT_EQ(server.act({{"do", "take"}, {"set", set}}), 200) << set;
    static_cast<void>(server.idle_state());
  }

  SmallBench bench_{{"C"}};
};

TEST_F(Replay, SaysThatARecordingCanNeitherBeExposedNorLaidAgain) {
  const RunningBench server(bench_.rig(), out());
  const CurlAnswer answer = curl(
      "-H 'Content-Type: application/json' --data-binary "
      "'{\"do\":\"light\",\"camera\":\"cam0\",\"gain_db\":1}' '" +
      server.address() + "api/do'");
  EXPECT_EQ(answer.status, 400);
  EXPECT_THAT(answer.body, HasSubstr("a recording is exposed already"));
  EXPECT_EQ(server.act({{"do", "lay"}, {"drape", "C"}}), 400);
}

TEST_F(Replay, AnObjectsPlateSaysWhereItStandsAndIsDrawnOverThePictures) {
  // The target at 90 mm stands for a plate: what lies there is known exactly.
  bench_.replace("rig.toml", "[[calibration.stage]]\nset = \"stage_z090\"\nz_mm = 90.0\n", "");
  bench_.replace("scenes/C.toml", "yaw_deg = 14.0",
                 "yaw_deg = 14.0\ntags_set = \"stage_z090\"\ntags_target = \"../target.toml\"");
  const RunningBench server(bench_.rig(), out());
  take(server, {"stage_z000", "pose_00", "pose_01", "pose_02"});
  ASSERT_EQ(server.act({{"do", "calibrate"}}), 200);
  static_cast<void>(server.idle_state());
  EXPECT_EQ(server.get("api/sheet?drape=C")["outlines"]["measured"], false);
  take(server, {"stage_z090"});
  const Json plate = server.get("api/state")["drapes"][0]["plates"][0];
  EXPECT_EQ(plate["verdict"], "NO-GO") << "the scene states another place";
  EXPECT_THAT(plate["sentence"].get<std::string>(), HasSubstr("x_mm = -3")) << plate.dump();
  const Json sheet = server.get("api/sheet?drape=C");
  EXPECT_EQ(sheet["outlines"]["measured"], true);
  const Scene scene = read_scene(out() / "console" / "C" / "scene_1.toml");
  const auto& box = std::get<Box>(scene.obstacles.front());
  EXPECT_NEAR(box.world_from_box.translation_m.x() / mm, 0, 0.1);
  for (int c = 0; c < 3; ++c) {
    const Camera& camera = bench1_truth().cameras.at(static_cast<std::size_t>(c));
    const Json& lines = sheet["outlines"]["cameras"][camera.name];
    ASSERT_EQ(lines.size(), 12U) << "edges of a box";
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d side(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, k & 4 ? 0.5 : -0.5);
      const auto corner =
          project(camera.model, camera.cam_from_world *
                                    (box.world_from_box * side.cwiseProduct(box.size_m).eval()));
      double nearest_px = 1e9;
      for (const Json& line : lines)
        for (const Json& point : {line.front(), line.back()})
          nearest_px =
              std::min(nearest_px, (Eigen::Vector2d(point[0], point[1]) - corner->px).norm());
      EXPECT_LT(nearest_px, 0.5) << camera.name;  // a tenth of a mm is 0.4 px
    }
  }
}

TEST_F(Replay, LayingsOfTheRigReachTheRunWithTheirFaces) {
  const fs::path rig = bench_.rig() / "rig.toml";
  write_durable(
      rig, read_text(rig) + "\n[[repeat]]\nscene = \"C\"\nset = \"drape_A\"\nrepeat = \"two\"\n");
  write_durable(bench_.rig() / "acceptance.json", "{}\n");
  const RunningBench server(bench_.rig(), out());
  take(server, {"stage_z000", "pose_00", "pose_01", "drape_C"});
  ASSERT_EQ(server.act({{"do", "take"}, {"set", "drape_A"}, {"face", "the \"back\""}}), 200);
  ASSERT_EQ(server.act({{"do", "run"}}), 200);
  const fs::path written = out() / "console" / "rig.toml";
  for (int k = 0; k < 600 && !fs::exists(written); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const Json jobs = server.get("api/state")["jobs"];
  static_cast<void>(server.act({{"do", "cancel"}, {"job", jobs.back()["id"]}}));
  static_cast<void>(server.idle_state());
  EXPECT_THAT(read_text(written), HasSubstr("[[repeat]]\nscene = \"C\"\nset = \"drape_A\"\nrepeat "
                                            "= \"two\"\nface = \"the \\\"back\\\"\"\n"));
  EXPECT_EQ(read_text(out() / "console" / "acceptance.json"), "{}\n");
  const Outcome checked =
      run_line(fmt::format("'{}' check '{}'", program("drape").string(), written.string()));
  EXPECT_THAT(checked.text, testing::Not(HasSubstr("repeat"))) << checked.text;
}

}  // namespace
}  // namespace drape::test
